"""The straight strip beside its Euler loads, also between springs from 1e-12 to 1e12."""

from hard_cases.records import CC, PP, case, sides
from mpmath import mp, mpf


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
