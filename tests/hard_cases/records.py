"""Records of hard cases: points beside a transition, and what is compared there."""

from mpmath import mp, mpf

DIGITS = 50
POWERS = (2, 4, 6, 8, 9, 10, 11, 12)
CC, CP, PP = "clamped-clamped", "clamped-pinned", "pinned-pinned"
mp.dps = DIGITS


def thrust(P):
    """Thrust p of a dimensionless load."""
    return 4 * mp.pi**2 * mpf(P)


def sides(load, powers=POWERS):
    """Doubles beside a load with the side they lie on, −1 or 1."""
    for power in powers:
        for side in (-1, 1):
            yield float(load * (1 + side * mpf(10) ** -power)), side


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
