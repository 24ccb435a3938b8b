"""Folds of contact words, where two roots of one word merge: under load, and at prescribed shortening."""

from typing import NamedTuple

import numpy as np
from hard_cases.contact_words import (
    every_root,
    numbered,
    patterns,
    record,
)
from hard_cases.curves import curve, extreme, place
from hard_cases.equilibria import point
from hard_cases.records import CC, CP, PP, case, thrust
from mpmath import mp, mpf

DISTANCES = (4, 6, 8, 9, 10, 11, 12)
SAMPLES = np.concatenate([np.geomspace(1e-6, 0.01, 80), np.linspace(0.01, np.sqrt(2), 240)[1:]])
MOST_PERIODS = 3
"""Further periods that a search at prescribed shortening has to look at."""


class Fold(NamedTuple):
    """A word with one of its patterns, and which extreme along its curve."""

    state: str
    ends: str
    H: float
    periods: tuple
    number: int = 0


UNDER_LOAD = (
    Fold("UU", CC, 0.05, (1, 0, 1)),
    Fold("U", CC, 0.05, (1, 1)),
    Fold("Ua", CC, 0.05, (2, 0)),
    Fold("Ua", CC, 0.05, (1, 1)),
    Fold("UUa", CC, 0.05, (1, 0, 0)),
    Fold("aUDa", CC, 0.05, (0, 1, 0)),
    Fold("UDa", CC, 0.05, (1, 1, 0)),
    Fold("aUa", CP, 0.05, (0, 0)),
    Fold("aU", CP, 0.03, (0, 1)),
    Fold("UD", CP, 0.04, (1, 1, 0)),
    Fold("aUa", PP, 0.05, (0, 0)),
    Fold("UU", PP, 0.05, (1, 0, 0)),
    Fold("UD", PP, 0.03, (0, 1, 0)),
)
AT_SHORTENING = (
    Fold("Ua", CC, 0.05, (0, 0)),
    Fold("Ua", CC, 0.05, (1, 0)),
    Fold("Ua", CC, 0.001, (0, 0)),
    Fold("Ua", CC, 0.15, (0, 0)),
    Fold("U", CC, 0.05, (1, 0)),
    Fold("UU", CC, 0.05, (0, 0, 0)),
    Fold("UDa", CC, 0.05, (0, 0, 0)),
    Fold("UD", CC, 0.03, (0, 1, 0)),
    Fold("aU", CP, 0.05, (0, 0)),
    Fold("Ua", CP, 0.05, (0, 0)),
    Fold("Ua", PP, 0.05, (0, 0)),
    Fold("aUa", PP, 0.05, (0, 0)),
)


def folds_under_load():
    """Two roots of a word beside the load at which they merge, and none of them beyond."""
    for fold in UNDER_LOAD:
        yield from beside(fold, "p")


def folds_at_shortening():
    """The same beside a shortening."""
    for fold in AT_SHORTENING:
        yield from beside(fold, "shortening")


def beside(fold, control):
    """Cases of a fold: two roots on one side at every distance, on the other side their names are free.

    The extreme is that of a function of κ, so the two roots differ in the sign of its slope; that of the
    other control's slope does not change.
    """
    state, ends, H, periods, number = fold
    (pattern,) = (one for one in patterns(state, ends, sum(periods)) if one.periods == periods)
    sampled = curve(pattern, H, SAMPLES)
    sample = sampled.turns(control)[number]
    top, bend, slopes = extreme(pattern, H, control, sampled, sample)
    value = top.p / (4 * mp.pi**2) if control == "p" else top.shortening
    near = 1 if bend > 0 else -1
    first, count = _numbers(fold, pattern, control, value * (1 + near * mpf(10) ** -DISTANCES[0]), top)
    topic = f"folds of words, {'load' if control == 'p' else 'shortening'}"
    for distance in DISTANCES:
        given = float(value * (1 + near * mpf(10) ** -distance))
        beyond = float(value * (1 - near * mpf(10) ** -distance))
        target = thrust(given) if control == "p" else mpf(given)
        away = mp.sqrt(2 * (target - getattr(top, control)) / bend)
        for offset, side in enumerate((-1, 1)):
            start = top._replace(
                kappa=top.kappa + side * away,
                lams=[lam + side * away * slope for lam, slope in zip(top.lams, slopes[:-1], strict=True)],
                p=top.p + side * away * slopes[-1],
            )
            name = numbered(state, first + offset)
            if control == "p":
                kappa, lams = point(pattern.kinds, pattern.rises(H), target, start.kappa, start.lams)
                index = pattern.turns - (side * near > 0)
                yield record(topic, name, ends, given, H, kappa, lams, pattern, index)
            else:
                found = place(pattern, H, start, shortening=target)
                rises = slopes[-1] > 0
                index = pattern.turns - rises - (side * near * (1 if rises else -1) < 0)
                P = found.p / (4 * mp.pi**2)
                lams = found.every_lam(pattern)
                yield record(topic, name, ends, P, H, found.kappa, lams, pattern, index) | {
                    "shortening": given
                }
            if control == "p":
                yield case(topic, numbered(state, count - offset), ends, beyond, H, "no_equilibrium") | {
                    "periods": None
                }
            else:
                yield case(topic, numbered(state, count - offset), ends, None, H, "no_equilibrium") | {
                    "periods": None,
                    "shortening": beyond,
                }


def _numbers(fold, pattern, control, value, top):
    """Number of the first of the two roots that merge, and number of all roots of the word there."""
    if control == "p":
        roots = [(root.kappa, root.pattern.periods) for root in every_root(*fold[:2], float(value), fold.H)]
    else:
        roots = roots_at_shortening(*fold[:3], float(value))
    merging = [
        i
        for i, (kappa, periods) in enumerate(roots)
        if periods == pattern.periods and abs(kappa - top.kappa) < 0.03 * mp.sqrt(top.p)
    ]
    if len(merging) != 2 or merging[1] != merging[0] + 1:
        raise ArithmeticError(f"the scan finds {roots} at {fold}, fold at {top.kappa}")
    return merging[0] + 1, len(roots)


def roots_at_shortening(state, ends, H, shortening):
    """κ and periods of every root of a word at a shortening, in the order in which they are numbered."""
    found = []
    for pattern in patterns(state, ends, MOST_PERIODS):
        sampled = curve(pattern, H, SAMPLES)
        k = SAMPLES
        for turn in sampled.turns("shortening"):
            k = np.append(k, np.linspace(SAMPLES[turn - 1], SAMPLES[turn + 1], 200))
        sampled = curve(pattern, H, np.unique(k))
        missing = sampled.shortening - shortening
        kappa = sampled.k * np.sqrt(sampled.p)
        for i in np.flatnonzero(missing[:-1] * missing[1:] < 0):
            share = missing[i] / (missing[i] - missing[i + 1])
            found.append((kappa[i] + share * (kappa[i + 1] - kappa[i]), pattern.periods))
    return sorted(found)
