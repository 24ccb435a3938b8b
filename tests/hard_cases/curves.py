"""Load and shortening of a pattern as functions of k = κ/√p, and the places where they turn round.

At fixed k the total length falls as p grows, so a bisection gives p(k). Where p(k) has an extreme two roots
of one word merge under load, where ΔL(k) has one, at prescribed shortening. Along the curve ΣD has the sign
of dp/dk. The scan in double precision is the start of Newton's method at 50 digits.
"""

from typing import NamedTuple

import numpy as np
from hard_cases.contact_words import excess, force
from hard_cases.equilibria import TOLERANCE, strain
from mpmath import matrix as vector
from mpmath import mpf
from references.make_states import _Double, _newton, measure

LEAST_LOAD, LARGEST_LOAD = 0.02, 60.0
"""Thrusts p/4π² between which a curve is looked for."""
BISECTIONS = 52
STEP = mpf(10) ** -12
"""Step of the differences along a curve: good to 24 digits."""


class Curve(NamedTuple):
    """Samples k, thrust p and shortening along the branch of a pattern, NaN where there is none."""

    k: np.ndarray
    p: np.ndarray
    shortening: np.ndarray

    def turns(self, control):
        """Samples next to the extremes of "p" or "shortening"."""
        values = getattr(self, control)
        rising = np.diff(values)
        return np.flatnonzero(rising[:-1] * rising[1:] < 0) + 1


def curve(pattern, H, k):
    """Bisect the thrust at every k, below 90° and a little beyond."""
    low = np.full(k.size, 4 * np.pi**2 * LEAST_LOAD)
    high = np.full(k.size, 4 * np.pi**2 * LARGEST_LOAD)
    with np.errstate(all="ignore"):
        for _ in range(BISECTIONS):
            p = np.sqrt(low * high)
            # Where a segment has no shape below 90° its rise is too large for this k, in units of 1/√p.
            long = excess(pattern, k * np.sqrt(p), p, H) > 0
            low, high = np.where(long, p, low), np.where(long, high, p)
        missing = excess(pattern, k * np.sqrt(p), p, H)
        shorter = 0.0
        for kind, multiple in zip(pattern.kinds, pattern.multiples, strict=True):
            lam = force(kind, k * np.sqrt(p), p, multiple * H)
            length, _, advance = measure(kind, k * np.sqrt(p), lam, p, _Double)
            shorter = shorter + length - advance
    good = np.abs(missing) < 1e-9
    return Curve(k, np.where(good, p, np.nan), np.where(good, shorter, np.nan))


class Place(NamedTuple):
    """A point of a branch at 50 digits: κ, λ of each distinct segment, thrust, shortening."""

    kappa: mpf
    lams: list
    p: mpf
    shortening: mpf

    def every_lam(self, pattern):
        """λ of the segments from end A to end B."""
        pairs = list(zip(pattern.kinds, pattern.multiples, strict=True))
        known = dict(zip(dict.fromkeys(pairs), self.lams, strict=True))
        return [known[pair] for pair in pairs]


def place(pattern, H, start, kappa=None, shortening=None):
    """The point of a branch with given κ or shortening, from a start nearby."""
    pairs = list(zip(pattern.kinds, pattern.multiples, strict=True))
    several = {pair: pairs.count(pair) for pair in pairs}

    def residual(x, *lams_and_p):
        *lams, p = lams_and_p
        parts = [measure(kind, x, lam, p) for (kind, _), lam in zip(several, lams, strict=True)]
        bent = sum(count * (part[0] - part[2]) for count, part in zip(several.values(), parts, strict=True))
        return [
            x - kappa if shortening is None else bent - shortening,
            sum(count * part[0] for count, part in zip(several.values(), parts, strict=True)) - 1,
            *(part[1] - multiple * mpf(H) for (_, multiple), part in zip(several, parts, strict=True)),
        ]

    x, *lams, p = _newton(
        residual, vector([start.kappa if kappa is None else kappa, *start.lams, start.p]), TOLERANCE
    )
    bent = sum(
        count * strain(kind, x, lam, p)[1]
        for ((kind, _), count), lam in zip(several.items(), lams, strict=True)
    )
    return Place(x, lams, p, bent)


def extreme(pattern, H, control, sampled, sample):
    """The point where the load or the shortening has its extreme next to a sample, with its curvature.

    Returns
    -------
    Place
    bend : mpf
        Second derivative of `control` with respect to κ there.
    slopes : list of mpf
        Derivatives of the λ of distinct segments and of p.
    """
    p = float(sampled.p[sample])
    kappa = float(sampled.k[sample]) * p**0.5
    lams = [
        mpf(float(force(kind, np.array([kappa]), p, multiple * H)[0]))
        for kind, multiple in dict.fromkeys(zip(pattern.kinds, pattern.multiples, strict=True))
    ]
    here = place(pattern, H, Place(kappa, lams, mpf(p), None), kappa=mpf(kappa))
    for _ in range(40):
        low, high = (place(pattern, H, here, kappa=here.kappa + shift) for shift in (-STEP, STEP))
        values = [getattr(one, control) for one in (low, here, high)]
        slope = (values[2] - values[0]) / (2 * STEP)
        bend = (values[2] - 2 * values[1] + values[0]) / STEP**2
        change = -slope / bend
        if abs(change) < mpf(10) ** -20:
            break
        limit = mpf("0.2")
        here = place(pattern, H, here, kappa=here.kappa + max(-limit, min(limit, change)))
    else:
        raise ArithmeticError("no extreme nearby")
    slopes = [(b - a) / (2 * STEP) for a, b in zip([*low.lams, low.p], [*high.lams, high.p], strict=True)]
    return here, bend, slopes
