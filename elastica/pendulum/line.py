"""One free segment that begins and ends without curvature, κ = 0, as it does next to a line contact.

Its rise is a concave function of λ: two shapes have the same rise, and where they meet, at its greatest
value, the line shapes fold.

Not here: how many such segments fit into the strip (`equilibria.line`).
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from elastica.convergence import diverged, small, stagnated
from elastica.pendulum.elliptic import ROUNDING, integrals
from elastica.pendulum.segments import arc, geometry, length, pendulum
from elastica.pendulum.segments import rise as height

FOLD = 0.5281603073179724
"""H√P at the fold of the clamped line states, the maximum of sin α √cos α (2E − K)/(π/2) at α = 47.761°;
beyond it there are none. A segment from a pin ends at half of it."""
FOLD_ANGLE = np.radians(47.761)
MOST_STEPS = 60
NODES = 200
"""Of the table of rough lengths."""
SPRINGS, STEPS, STEEPEST, ALMOST_ZERO = 64, 64, np.radians(80), 1e-6
"""Of the table of segments on springs: its size, the angles α up to which they fold, and one for zero."""
FOLD_ERROR = 3e-4
"""Relative error that the folds in that table certainly keep."""
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
    if kind.springs:
        alpha, _ = _rough_on_spring(kind, p, rise)
        lam = p * np.tan(alpha)
        below = np.isfinite(lam) & (p > 0)
    else:
        phase = (kind.first + kind.second) * np.pi / 2
        lam = p * root_p * rise / phase
        fold = FOLD * phase / (2 * np.pi)
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
    """Length of a segment at κ = 0 to 1e-3; infinite beyond the fold, NaN next to it.

    Without springs such a segment is a number of equal quarters of a period, with √p ℓ = K √cos α and
    √p d = sin α √cos α (2E − K) each, m = sin²(α/2).

    Returns
    -------
    ndarray, shape (n,)
    """
    if not rise.any():
        return np.zeros_like(p)
    if kind.springs:
        return _rough_on_spring(kind, p, rise)[1]
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


class _OnSpring(NamedTuple):
    """Segments at κ = 0 on springs from the pin to the clamp, c/(c + √p) equidistant.

    Attributes
    ----------
    fold : ndarray, shape (springs,)
        √p times the greatest rise.
    shapes : ndarray, shape (2, steps, springs)
        α and √p ℓ where √p times the rise is s(2 − s) `fold`, for equidistant s up to 1.
    """

    fold: np.ndarray
    shapes: np.ndarray


@cache
def _on_spring(kind):
    """Tabulate what a segment is at κ = 0 whatever the spring that it has.

    Returns
    -------
    _OnSpring
    """
    alpha = np.linspace(0, STEEPEST, NODES)
    alpha[0] = ALMOST_ZERO
    ones, even = np.ones_like(alpha), np.linspace(0, 1, STEPS)
    folds, shapes = [], []
    for share in np.linspace(0, 1, SPRINGS):
        shape = _line_shape(kind.on_spring(share / max(1 - share, ROUNDING)), ones, np.tan(alpha))
        heights, lengths = height(shape), length(shape)
        last = np.argmax(heights)
        before, most, after = heights[last - 1 : last + 2]
        fold = most + (after - before) ** 2 / (8 * (2 * most - before - after))
        s = 1 - np.sqrt(np.maximum(1 - heights[: last + 1] / fold, 0))
        s[0] = 0
        folds.append(fold)
        shapes.append([np.interp(even, s, value[: last + 1]) for value in (alpha, lengths)])
    return _OnSpring(np.array(folds), np.array(shapes).transpose(1, 2, 0))


def _rough_on_spring(kind, p, rise):
    """α and length of a segment on a spring at κ = 0 by a table; NaN and infinite beyond the fold."""
    ((c, _),) = kind.springs
    table, root_p = _on_spring(kind.on_spring(1.0)), np.sqrt(p)
    place = (SPRINGS - 1) * c / (c + root_p)
    column = np.clip(place.astype(int), 0, SPRINGS - 2)
    soft, stiff = 1 - (place - column), place - column
    share = rise * root_p / (soft * table.fold[column] + stiff * table.fold[column + 1])
    # Certainly before the fold, from where Newton climbs.
    inside = np.minimum(share, 1) * (1 - FOLD_ERROR)
    place = (STEPS - 1) * inside / (1 + np.sqrt(1 - inside))
    row = np.clip(place.astype(int), 0, STEPS - 2)
    low, high = 1 - (place - row), place - row
    alpha, scaled = (
        low * (soft * values[row, column] + stiff * values[row, column + 1])
        + high * (soft * values[row + 1, column] + stiff * values[row + 1, column + 1])
        for values in table.shapes
    )
    beyond = ~(share <= 1 + FOLD_ERROR)
    near = np.abs(share - 1) <= FOLD_ERROR
    return np.where(beyond, np.nan, alpha), np.where(beyond, np.inf, np.where(near, np.nan, scaled / root_p))


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
