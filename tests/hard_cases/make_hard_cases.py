"""Hard cases with known right answers: both sides of every transition, limits of loads, gaps, springs, words.

Every case is a state at a point with what is true there. Transition loads come from closed forms (theory
of the pendulum) at 50 digits; a point lies beside one at a relative distance of 1e-2 … 1e-12, as a double.
Equilibria are Newton's method at 50 digits on the equations of `references.make_states`, from starts that
the closed forms give; verdicts follow from the side of the transition. Nothing is imported from the package.

Run ``python -m hard_cases.make_hard_cases`` in the folder ``tests`` to write ``hard_cases.json``.
"""

import json
import math
from pathlib import Path

from mpmath import matrix as vector
from mpmath import mp, mpf
from references.make_states import Kind, _Double, _newton, layout, locate, measure

DIGITS = 50
POWERS = (2, 4, 6, 8, 9, 10, 11, 12)
CC, PP = "clamped-clamped", "pinned-pinned"
OUTPUT = Path(__file__).parent / "hard_cases.json"
TOLERANCE = mpf(10) ** -38


def thrust(P):
    """Thrust p of a dimensionless load."""
    return 4 * mp.pi**2 * mpf(P)


def sides(load):
    """Doubles beside a load with the side they lie on, −1 or 1."""
    for power in POWERS:
        for side in (-1, 1):
            yield float(load * (1 + side * mpf(10) ** -power)), side


def strain(kind, kappa, lam, p):
    """Bending energy ½∫θ'² and shortening of a segment, from its first integral."""
    length, rise, advance = measure(kind, kappa, lam, p)
    return p * advance + lam * rise + (kappa**2 / 2 - p) * length, length - advance


def values(kinds, kappa, lams, p):
    """What is compared: curvature, energy, lengths of the first and second segment, flat length."""
    bent = [strain(kind, kappa, lam, p) for kind, lam in zip(kinds, lams, strict=True)]
    energy = sum(b - p * s for b, s in bent) / (4 * mp.pi**2)
    lengths = [measure(kind, kappa, lam, p)[0] for kind, lam in zip(kinds, lams, strict=True)]
    return {"kappa": kappa, "energy": energy, "lengths": lengths}


def point(kinds, rises, p, kappa, lams):
    """κ and λ of each distinct kind of a point state, or of a free one, from a start."""
    distinct = list(dict.fromkeys(zip(kinds, rises, strict=True)))

    def residual(kappa, *lams):
        found = [measure(kind, kappa, lam, p) for (kind, _), lam in zip(distinct, lams, strict=True)]
        total = sum(found[distinct.index(pair)][0] for pair in zip(kinds, rises, strict=True))
        return [total - 1] + [part[1] - pair[1] for part, pair in zip(found, distinct, strict=True)]

    kappa, *lams = _newton(residual, vector([kappa, *lams]), TOLERANCE)
    if kappa < 0:
        raise ArithmeticError("negative curvature")
    return kappa, [lams[distinct.index(pair)] for pair in zip(kinds, rises, strict=True)]


def case(topic, state, ends, P, H, status, stability=None, index=None, **numbers):
    """One record; numbers with 17 digits."""
    record = {"topic": topic, "state": state, "ends": ends, "P": P, "H": H, "status": status}
    if stability is not None:
        record |= {"stability": stability, "index": index}
    for name, value in numbers.items():
        record[name] = [_round(v) for v in value] if isinstance(value, list) else _round(value)
    return record


def _round(x):
    return float(mp.nstr(x, 17))


# ------------------------------------------------------------------------------ the straight strip
def straight():
    """Index of the straight strip beside its first four Euler loads."""
    tangent = [
        mp.findroot(lambda r: mp.sin(r) - r * mp.cos(r), (k + mpf(1) / 2) * mp.pi - 0.1 / k)
        for k in (1, 2, 3, 4)
    ]
    roots = {
        CC: [2 * mp.pi, 2 * tangent[0], 4 * mp.pi, 2 * tangent[1]],
        PP: [mp.pi, 2 * mp.pi, 3 * mp.pi, 4 * mp.pi],
        "clamped-pinned": tangent,
    }
    for ends, found in roots.items():
        for mode, root in enumerate(found):
            for P, side in sides(root**2 / (4 * mp.pi**2)):
                index = mode + (side > 0)
                yield case(
                    "Euler loads", "0", ends, P, 0.1, "solved", "unstable" if index else "stable", index
                )


def springs():
    """First Euler load of strips with equal springs from 1e-12 to 1e12; even modes: c = q cot(q/2)·… ."""
    for exponent in range(-12, 13):
        k = 10.0**exponent
        c = 4 * mp.pi**2 * mpf(k)
        # Symmetric mode: tan(q/2) = −q/c, q between π and 2π.
        q = mp.findroot(
            lambda q, c=c: c * mp.sin(q / 2) + q * mp.cos(q / 2), (mp.pi, 2 * mp.pi), solver="anderson"
        )
        for power in (3, 9, 12):
            for side in (-1, 1):
                P = float(q**2 / (4 * mp.pi**2) * (1 + side * mpf(10) ** -power))
                yield case(
                    "springs",
                    "0",
                    f"{k!r}/{k!r}",
                    P,
                    0.1,
                    "solved",
                    "unstable" if side > 0 else "stable",
                    int(side > 0),
                )


# ------------------------------------------------------------------------------------ free shapes
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


def narrow():
    """Point contact in gaps down to 1e-8, where deflections vanish: started from the linear strip."""
    for ends, loads in ((CC, (1.2, 2.0, 3.9)), (PP, (0.3, 0.5, 0.9))):
        for exponent in range(1, 9):
            H = 10.0**-exponent
            for P in loads:
                if exponent > 1 or P < 3.9:
                    yield one_point("deflection to zero", ends, P, H, "solved", "stable", 0)


def linear_start(ends, P, H):
    """κ and λ of the one-point state of a linear strip: θ'' = −pθ + λ on half of it, θ = 0 at the wall."""
    p, half = thrust(P), mpf(1) / 2
    q = mp.sqrt(p)
    # θ = (λ/p)(1 − cos qs) + b sin qs + a cos qs from the end.
    if ends == CC:
        b = -(1 - mp.cos(q * half)) / mp.sin(q * half)
        rise = half - mp.sin(q * half) / q + b * (1 - mp.cos(q * half)) / q
        lam = mpf(H) * p / rise
        return abs(lam / p * q * b), lam
    a = -1 / mp.cos(q * half)
    rise = half + a * mp.sin(q * half) / q
    lam = mpf(H) * p / rise
    return abs(lam / p * q * a * mp.sin(q * half)), lam


def one_point(topic, ends, P, H, status, stability=None, index=None, start=None):
    """The symmetric one-point state."""
    kind = Kind("clamped" if ends == CC else "pinned", "S")
    p = thrust(P)
    kappa, lam = start or linear_start(ends, P, H)
    kappa, lams = point([kind, kind], [mpf(H)] * 2, p, kappa, [lam])
    return case(topic, "U", ends, P, H, status, stability, index, **values([kind] * 2, kappa, lams, p))


# ------------------------------------------------------------------------------- the wall touched
def touching():
    """Free shape and one-point state beside the load at which the wall is touched, μ = 0."""
    for ends in (CC, PP):
        for H in (1e-3, 0.01, 0.05, 0.1, 0.2, 0.3):
            k = mp.findroot(lambda k, H=H: k / mp.ellipk(k * k) - mpf(H), mpf(H) * mp.pi / 2)
            load = (2 * mp.ellipk(k * k) / mp.pi) ** 2 / (1 if ends == CC else 4)
            p = 4 * mp.pi**2 * load
            start = 2 * k * mp.sqrt(p) if ends == CC else mpf(0)
            for P, side in sides(load):
                free, held = ("solved", "inadmissible")[::-side]
                verdict = ("stable", 0)
                if P > (1 if ends == CC else 0.25):
                    yield case(
                        "wall touched",
                        "B1",
                        ends,
                        P,
                        H,
                        free,
                        *(verdict if side < 0 else ()),
                        **free_strip(P, ends),
                    )
                kappa = start if ends == CC else 2 * k * mp.sqrt(p)
                yield one_point(
                    "reaction to zero",
                    ends,
                    P,
                    H,
                    held,
                    *(verdict if side > 0 else ()),
                    start=(kappa, mpf(10) ** -20),
                )


# ---------------------------------------------------------------------------------- point to line
def line_force(scaled_gap):
    """α of the segment of a line state from H√P of a clamped one (twice that of a pinned one)."""

    def gap(alpha):
        m = mp.sin(alpha / 2) ** 2
        K, E = mp.ellipk(m), mp.ellipe(m)
        return 2 * K / mp.pi * mp.sqrt(mp.cos(alpha)) * mp.sin(alpha) * (2 * E / K - 1) - scaled_gap

    # A parabola with its top at the fold.
    below = mp.sqrt(1 - scaled_gap / GAP_FOLD)
    start = ALPHA_FOLD * (1 - below)
    alpha = mp.findroot(gap, (start, start * (1 + below / 1000)), tol=mpf(10) ** -76, maxsteps=60)
    if not 0 < alpha < ALPHA_FOLD:
        raise ArithmeticError("not the shallow branch")
    return alpha


def line_length(alpha, P):
    """Length of a clamped segment of a line state; a pinned one is half of it."""
    return 2 * mp.ellipk(mp.sin(alpha / 2) ** 2) / mp.pi * mp.sqrt(mp.cos(alpha) / mpf(P))


def _fold_of_lines():
    def gap(alpha):
        m = mp.sin(alpha / 2) ** 2
        return 2 / mp.pi * mp.sqrt(mp.cos(alpha)) * mp.sin(alpha) * (2 * mp.ellipe(m) - mp.ellipk(m))

    alpha = mp.findroot(lambda a: mp.diff(gap, a), mpf("0.8336"))
    return alpha, gap(alpha)


mp.dps = DIGITS
ALPHA_FOLD, GAP_FOLD = _fold_of_lines()


def line(topic, word, ends, P, H, status, stability=None, index=None):
    """A line state with alternating word: end segments rise by H, inner ones by 2H."""
    p = thrust(P)
    root = mpf(H) * mp.sqrt(mpf(P))
    outer = line_force(root * (1 if ends == CC else 2))
    inner = line_force(2 * root) if len(word) > 1 else None
    end = Kind("clamped" if ends == CC else "pinned", "S")
    kinds = [end, *[Kind("clamped", "S")] * (len(word) - 1), end]
    lams = [p * mp.tan(alpha) for alpha in (outer, *[inner] * (len(word) - 1), outer)]
    found = values(kinds, mpf(0), lams, p)
    flat = 1 - sum(found["lengths"])
    if stability is None and status == "solved":
        stability, index = line_verdict(word, ends, flat * mp.sqrt(p) > 2 * mp.pi)
    found["lengths"] = found["lengths"][:2]
    return case(topic, word + "-", ends, P, H, status, stability, index, flat=flat, **found)


def line_verdict(word, ends, buckled):
    """Stability of a line state and its index."""
    if buckled:
        return "unstable", 1
    if ends == CC:
        return "unstable_third_order", 0
    return ("neutral_family" if len(word) > 1 else "stable"), 0


def onset(ends, H, factor):
    """Load at which flat length is `factor` − 1 times 1/√P: 1 point to line, 2 the flat stretch buckles."""
    share = 1 if ends == CC else 2

    # √P = factor − 1 + 2·(2K/π)√cos α / share, and H√P·share = gap(α).
    def room(root):
        alpha = line_force(root * mpf(H) * share)
        return (factor - 1) + 2 * line_length(alpha, 1) / share - root

    start = mpf(factor - 1) + mpf(2) / share
    return mp.findroot(room, (start * (1 - mpf(H) ** 2), start), tol=mpf(10) ** -70) ** 2


def point_to_line():
    """Point and line beside the load at which κ = 0 and nothing is left to lie flat."""
    for ends in (CC, PP):
        for H in (1e-6, 1e-3, 0.01, 0.05, 0.1, 0.2):
            load = onset(ends, H, 1)
            share = 1 if ends == CC else 2
            lam = 4 * mp.pi**2 * load * mp.tan(line_force(mpf(H) * mp.sqrt(load) * share))
            for P, side in sides(load):
                if side < 0:
                    yield one_point(
                        "point to line",
                        ends,
                        P,
                        H,
                        "solved",
                        "stable",
                        0,
                        start=(lam * (load - mpf(P)) / load, lam),
                    )
                yield line("point to line", "U", ends, P, H, "solved" if side > 0 else "inadmissible")


def pitchfork():
    """The asymmetric state beside the load at which it leaves the symmetric one, κ → 0."""
    S, A = Kind("clamped", "S"), Kind("clamped", "A")
    for H in (1e-3, 0.02, 0.05, 0.1, 0.15):
        load = onset(CC, H, 1)
        lam = 4 * mp.pi**2 * load * mp.tan(line_force(mpf(H) * mp.sqrt(load)))
        for P, side in sides(load):
            if side < 0:
                p = thrust(P)
                symmetric, _ = point([S, S], [mpf(H)] * 2, p, lam * (load - mpf(P)) / load, [lam])
                kappa, lams = point([S, A], [mpf(H)] * 2, p, 2 * symmetric, [lam, lam])
                yield case(
                    "pitchfork", "Ua", CC, P, H, "solved", "unstable", 1, **values([S, A], kappa, lams, p)
                )


def flat_buckles():
    """The line state beside the load at which its flat stretch buckles, p ℓ_f² = 4π²."""
    for ends in (CC, PP):
        for H in (1e-6, 0.01, 0.05, 0.1):
            for P, _ in sides(onset(ends, H, 2)):
                yield line("flat buckles", "U", ends, P, H, "solved")


def folds():
    """Line states beside their fold at α = 47.76°, and free shapes with a fold."""
    for ends in (CC, PP):
        for H in (0.06, 0.1, 0.15):
            share = 1 if ends == CC else 2
            for P, side in sides((GAP_FOLD / (mpf(H) * share)) ** 2):
                if side < 0:
                    yield line("fold of lines", "U", ends, P, H, "solved")
                else:
                    yield case("fold of lines", "U-", ends, P, H, "no_equilibrium")
    for state, ends, P in (("B2", CC, 2.1), ("B1", "clamped-pinned", 0.53)):
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


# ---------------------------------------------------------------------------------------- words
def words():
    """Alternating words with 10 to 50 contacts, and families of lines at loads up to 1e4."""
    for contacts in (1, 2, 3, 5, 10, 20, 50):
        word = "".join("UD"[i % 2] for i in range(contacts))
        for ends in (CC, PP):
            room = contacts + (1 if ends == CC else 0)
            for P in (1.02 * room**2, (room + 0.9) ** 2, (room + 1.5) ** 2, 1e4):
                for slope in (1e-3, 0.1, 0.2):
                    H = slope / (2 * math.sqrt(P))
                    try:
                        yield (
                            line("several lines", word, ends, P, H, "solved")
                            if room**2 < 0.9 * P
                            else line_near(word, ends, P, H)
                        )
                    except Skip:
                        continue
    for contacts in (2, 10, 20, 30, 40, 50):
        for ends in (CC, PP):
            room = contacts + (1 if ends == CC else 0)
            for part in (0.5, 0.9, 0.98):
                for slope in (1e-3, 0.05, 0.3):
                    try:
                        yield alternating(contacts, ends, (part * room) ** 2, slope)
                    except Skip:
                        continue


class Skip(Exception):
    """A point where there is no such state."""


def line_near(word, ends, P, H):
    """A line state close to its onset, if there is any length to lie flat."""
    record = line("several lines", word, ends, P, H, "solved")
    if record["flat"] < 0:
        raise Skip
    return record


def alternating(contacts, ends, P, slope):
    """A long alternating word: κ by bisection of the total length, λ of each rise inside."""
    H, p = slope / (2 * math.sqrt(P)), thrust(P)
    end, inner = Kind("clamped" if ends == CC else "pinned", "S"), Kind("clamped", "S")

    def force(kind, kappa, rise):
        low, high = -float(p), float(p)
        for _ in range(48):
            middle = (low + high) / 2
            below = measure(kind, kappa, middle, float(p), _Double)[1] < rise
            low, high = (middle, high) if below else (low, middle)
        return low

    def total(kappa):
        lams = force(end, kappa, H), force(inner, kappa, 2 * H)
        ends_, inners = (
            measure(k, kappa, lam, float(p), _Double)[0] for k, lam in zip((end, inner), lams, strict=True)
        )
        return 2 * ends_ + (contacts - 1) * inners, lams

    low, high = 1e-9, math.sqrt(p)
    for _ in range(40):
        kappa = (low + high) / 2
        low, high = (kappa, high) if total(kappa)[0] > 1 else (low, kappa)
    lams = total(low)[1]
    kinds = [end, *[inner] * (contacts - 1), end]
    rises = [mpf(H), *[2 * mpf(H)] * (contacts - 1), mpf(H)]
    try:
        kappa, lams = point(kinds, rises, p, low, lams)
    except ArithmeticError:
        raise Skip from None
    word = "".join("UD"[i % 2] for i in range(contacts))
    found = values([end, inner], kappa, lams[:2], p)
    parts = [
        values([kind], kappa, [lam], p)["energy"] for kind, lam in zip((end, inner), lams[:2], strict=True)
    ]
    found["energy"] = 2 * parts[0] + (contacts - 1) * parts[1]
    pushes = lams[0] + lams[1] >= 0 and lams[1] >= 0
    if not pushes:
        return case("many contacts", word, ends, P, H, "inadmissible", None, None, **found)
    return case("many contacts", word, ends, P, H, "solved", "stable", 0, **found)


def overhanging():
    """One-point states beyond 90°, followed from a shallow gap in steps."""
    S = Kind("clamped", "S")
    for P in (1.3, 1.5, 1.7, 1.725):
        p = thrust(P)
        kappa, lam = linear_start(CC, P, 0.1)
        for number in range(10, 40):
            H = number / 100
            try:
                found, lams = point([S, S], [mpf(H)] * 2, p, kappa, [lam])
            except (ArithmeticError, ValueError, ZeroDivisionError):
                break
            if abs(found - kappa) > 5 or lams[0] < 0:
                break
            kappa, lam = found, lams[0]
            yield case("large gaps", "U", CC, P, H, "solved", None, None, **values([S] * 2, kappa, lams, p))


FAMILIES = (
    straight,
    springs,
    buckling,
    loops,
    narrow,
    touching,
    point_to_line,
    pitchfork,
    flat_buckles,
    folds,
    words,
    overhanging,
)


def main():
    """Write the file."""
    cases = []
    for family in FAMILIES:
        before = len(cases)
        cases += family()
        print(f"{family.__name__}: {len(cases) - before}", flush=True)
    text = ",\n".join(json.dumps(record, separators=(",", ":")) for record in cases)
    OUTPUT.write_text(f"[\n{text}\n]\n", encoding="utf-8")
    print(len(cases), "cases,", OUTPUT.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
