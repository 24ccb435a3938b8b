"""One point contact: gaps down to 1e-8, the wall just touched, strips steeper than 90°."""

from hard_cases.equilibria import point, values
from hard_cases.free_shapes import free_strip
from hard_cases.records import CC, PP, case, sides, thrust
from mpmath import mp, mpf
from references.make_states import Kind


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
