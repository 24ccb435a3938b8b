"""One free segment that begins and ends without curvature, κ = 0, as it does next to a line contact.

Its rise is a concave function of λ: two shapes have the same rise, and where they meet, at its greatest
value, the line shapes fold.

Not here: how many such segments fit into the strip (`equilibria.line`).
"""

from functools import cache

import numpy as np

from elastica.convergence import diverged, small, stagnated
from elastica.pendulum.elliptic import ROUNDING, integrals
from elastica.pendulum.segments import arc, geometry, pendulum

FOLD = 0.5281603073179724
"""H√P at the fold of the clamped line states, the maximum of sin α √cos α (2E − K)/(π/2) at α = 47.761°;
beyond it there are none. A segment from a pin ends at half of it."""
FOLD_ANGLE = np.radians(47.761)
MOST_STEPS = 60
NODES = 200
"""Of the table of rough lengths."""
BEYOND_TABLE = 1e-2
"""Relative distance behind the last node of that table from which on there is certainly no shape."""
FOLD_STEPS, NEARLY_THERE = 14, 0.98
"""Steps towards the fold of a segment on a spring, and the part of the way to it that each may go."""
INSIDE = 1e-13
"""Relative distance from the fold at which the last shapes are looked at: there they are still told apart."""


def line_force(kind, p, rise):
    """λ of a segment at κ = 0, from the small-deflection form on; NaN where it has none before its fold.

    Newton climbs the concave rise to the root without passing it.

    Parameters
    ----------
    kind : Kind
    p, rise : ndarray, shape (n,)
        Thrust, and height gained: 0 everywhere or nowhere.

    Returns
    -------
    ndarray, shape (n,)
    """
    if not rise.any():
        return np.zeros_like(p)
    root_p = np.sqrt(p)
    phase, jump = (kind.first + kind.second) * np.pi / 2, 0.0
    fold = FOLD * phase / (2 * np.pi)
    for c, sigma in kind.springs:
        eta = 2 * np.arctan(root_p / c) - np.pi / 2 if sigma > 0 else np.pi / 2
        phase, jump = phase - eta, np.cos(eta)
        fold = np.inf
    lam = p * root_p * rise / (phase + jump)
    below = (rise * root_p / (2 * np.pi) <= fold * (1 + 4 * ROUNDING)) & (p > 0)
    lam[~below] = np.nan
    found = np.zeros(p.size, bool)
    previous = np.full(p.size, np.inf)
    live = np.flatnonzero(below)
    for _ in range(MOST_STEPS):
        if not live.size:
            break
        here = lam[live]
        g = geometry(_line_shape(kind, p[live], here))
        step = (rise[live] - g.rise) / g.rise_lam
        lam[live] += step
        # λ/√F is a curvature.
        root_F = np.sqrt(np.hypot(p[live], here))
        size = np.abs(step / root_F) / np.abs(here / root_F)
        found[live] = small(size) | stagnated(size, previous[live])
        previous[live] = size
        live = live[~found[live] & ~diverged(size)]
    lam[~found] = np.nan
    known = np.flatnonzero(found)
    before_fold = geometry(_line_shape(kind, p[known], lam[known])).rise_lam > 0
    lam[known[~before_fold]] = np.nan
    return lam


def line_shape(kind, p, rise):
    """The arc of a segment at κ = 0; NaN where it has none before its fold."""
    return _line_shape(kind, p, line_force(kind, p, rise))


def _line_shape(kind, p, lam):
    return arc(kind, pendulum(p, np.zeros_like(p), lam))


def rough_line_length(kind, p, rise):
    """Length of a segment at κ = 0 to 1e-3; infinite beyond the fold, NaN next to it and on springs.

    Such a segment is a number of equal quarters of a period, with √p ℓ = K √cos α and
    √p d = sin α √cos α (2E − K) each, m = sin²(α/2).

    Returns
    -------
    ndarray, shape (n,)
    """
    if kind.springs:
        return np.full_like(p, np.nan)
    if not rise.any():
        return np.zeros_like(p)
    root_p = np.sqrt(p)
    quarters = kind.first + kind.second
    rises, lengths = _quarters()
    each = root_p * rise / quarters
    length = np.interp(each, rises, lengths, right=np.nan)
    length[each > rises[-1] * (1 + BEYOND_TABLE)] = np.inf
    return quarters * length / root_p


@cache
def _quarters():
    """√p times rise and length of a quarter of a period, up to the fold."""
    alpha = np.linspace(0, FOLD_ANGLE, NODES)
    m1 = np.cos(alpha / 2) ** 2
    K, DK, _, _ = integrals(m1, np.zeros_like(alpha), np.ones_like(alpha))
    stretch = np.sqrt(np.cos(alpha))
    return np.sin(alpha) * stretch * (K - 2 * (1 - m1) * DK), K * stretch


def line_fold(kind, rise, smallest, largest):
    """Thrust at which the line shapes of a segment fold, shape (n,); infinite if above `largest`.

    Parameters
    ----------
    kind : Kind
    rise : ndarray, shape (n,)
    smallest, largest : float
        Thrusts: one at which there are line shapes, and the last of interest.
    """
    if not rise.any():
        return np.full(rise.size, np.inf)
    if not kind.springs:
        quarters = kind.first + kind.second
        p = (FOLD * quarters * np.pi / 2 / rise) ** 2 * (1 - INSIDE)
        return np.where(p < largest, p, np.inf)
    last = np.full(rise.size, np.inf)
    at = np.flatnonzero(~np.isfinite(line_force(kind, np.full(rise.size, largest), rise)))
    last[at] = _fold_on_springs(kind, rise[at], smallest, largest)
    return last


def _fold_on_springs(kind, rise, smallest, largest):
    """The fold between two thrusts: the square of the slope falls to zero nearly in proportion to p."""
    inside, outside = np.full(rise.size, smallest), np.full(rise.size, largest)
    before, slope_before = 0.5 * inside, _square_slope(kind, 0.5 * inside, rise)
    slope = _square_slope(kind, inside, rise)
    for _ in range(FOLD_STEPS):
        ahead = inside + NEARLY_THERE * slope * (inside - before) / (slope_before - slope)
        ahead = np.where((ahead > inside) & (ahead < outside), ahead, 0.5 * (inside + outside))
        there = _square_slope(kind, ahead, rise)
        good = np.isfinite(there)
        before, slope_before = np.where(good, inside, before), np.where(good, slope, slope_before)
        inside, outside = np.where(good, ahead, inside), np.where(good, outside, ahead)
        slope = np.where(good, there, slope)
    return inside


def _square_slope(kind, p, rise):
    """Square of the slope d(rise)/dλ of line shapes, in units of the load; NaN beyond their fold."""
    return (geometry(line_shape(kind, p, rise)).rise_lam * p**1.5) ** 2
