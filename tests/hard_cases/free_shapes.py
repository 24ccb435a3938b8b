"""Free shapes: deflections that vanish, loops near the separatrix, folds."""

from hard_cases.equilibria import TOLERANCE, point, values
from hard_cases.records import CC, CP, PP, case, sides, thrust
from mpmath import matrix as vector
from mpmath import mp, mpf
from references.make_states import _newton, layout, locate, measure


def free_strip(P, ends, mode=1):
    """κ, energy of a free shape with λ = 0: K(m) = √p over its number of quarter periods."""
    p = thrust(P)
    quarter = mp.sqrt(p) / ((2 if ends == PP else 4) * mode)
    # ln(1 − m) is nearly linear in K.
    x = (
        mp.findroot(
            lambda x: mp.ellipk(1 - mp.exp(x)) - quarter, min(mp.log(16) - 2 * quarter, -(mpf(10) ** -20))
        )
        if quarter > 1.7
        else None
    )
    m = (
        1 - mp.exp(x)
        if x is not None
        else mp.findroot(lambda m: mp.ellipk(m) - quarter, 8 * (quarter / mp.pi - mpf(1) / 2))
    )
    K, E = mp.ellipk(m), mp.ellipe(m)
    shortening = 2 * (1 - E / K)
    bent = 2 * p * (E / K - 1 + m)
    return {
        "kappa": 2 * mp.sqrt(m * p),
        "energy": (bent - p * shortening) / (4 * mp.pi**2),
        "lengths": [mpf(1)],
    }


def buckling():
    """Free shapes just above their Euler load: the deflection goes to zero; and none below."""
    for ends, first in ((CC, 1), (PP, mpf(1) / 4)):
        for mode in (1, 2) if ends == PP else (1,):
            for P, side in sides(first * mode**2):
                if side < 0:
                    yield case("deflection to zero", f"B{mode}", ends, P, 0.45, "no_equilibrium")
                else:
                    verdict = "stable" if mode == 1 else "unstable"
                    yield case(
                        "deflection to zero",
                        f"B{mode}",
                        ends,
                        P,
                        0.45,
                        "solved",
                        verdict,
                        mode - 1,
                        **free_strip(P, ends, mode),
                    )


def loops():
    """Free shapes up to narrow loops, m → 1."""
    for ends, loads in (
        (PP, (0.26, 0.5, 1, 2, 4.5, 10, 20, 40, 90)),
        (CC, (1.1, 2, 4, 8, 18, 40, 80, 160, 360)),
    ):
        for P in loads:
            yield case("m to 1", "B1", ends, float(P), 0.4999, "solved", None, None, **free_strip(P, ends))


def folds_of_free_shapes():
    """Free shapes with λ ≠ 0 beside their fold."""
    for state, ends, P in (("B2", CC, 2.1), ("B1", CP, 0.53)):
        yield from fold_of(state, ends, P)


def fold_of(state, ends, P):
    """Beside the largest load of a free shape with λ ≠ 0: there dp/dκ = 0 along rise 0, length 1.

    It is approached from a smaller load P.
    """
    ((kind,), _), (guess, (force,)) = layout(state, ends), locate(state, ends, P, 5.0)

    def along(kappa, start):
        return _newton(
            lambda lam, p: [measure(kind, kappa, lam, p)[0] - 1, measure(kind, kappa, lam, p)[1]],
            vector(start),
            TOLERANCE,
        )

    step, kappa, start = mpf("1e-12"), mpf(guess), [mpf(force), thrust(P)]
    for _ in range(60):
        low, middle, high = (along(kappa + shift, start) for shift in (-step, 0, step))
        slope, bend = (high[1] - low[1]) / (2 * step), (high[1] - 2 * middle[1] + low[1]) / step**2
        change = slope / bend
        if bend > 0 or abs(change) > 0.5:
            change = -0.5 * mp.sign(slope)
        kappa, start = kappa - change, middle
        if abs(change) < mpf(10) ** -20:
            break
    top = start[1]
    # From the fold outwards, κ and λ nearly linear in the root of the distance.
    ahead, last, force = -mp.sqrt(2 / -bend), [mpf(0), mpf(0)], start[0]
    for P, side in reversed(list(sides(top / (4 * mp.pi**2)))):
        if side > 0:
            yield case("fold of free shapes", state, ends, P, 5.0, "no_equilibrium")
            continue
        p = thrust(P)
        root = mp.sqrt(top - p)
        kappa_low, lams = point(
            [kind], [mpf(0)], p, kappa + root * (last[0] or ahead), [force + root * last[1]]
        )
        last = [(kappa_low - kappa) / root, (lams[0] - force) / root]
        index = 1 if state == "B2" else 0
        yield case(
            "fold of free shapes",
            state,
            ends,
            P,
            5.0,
            "solved",
            "unstable" if index else "stable",
            index,
            **values([kind], kappa_low, lams, p),
        )
