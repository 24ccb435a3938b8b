"""The line regime along the load: where segments exist at κ = 0, and where the strip is long enough for them.

The rise of a segment at κ = 0 has a greatest value, so its line shapes end at a fold at a load of their own.
Its length falls with the load: the strip is long enough from one load on, if it is at any below the fold.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.equilibria.sweep import LINE_FOLD, line_force
from elastica.pendulum.segments import arc, geometry, length, pendulum, shortening

EDGE_STEPS, NEARLY_THERE = 14, 0.98
"""Steps towards the fold of a segment on a spring, and the part of the way to it that each may go."""
INSIDE = 1e-13
"""Relative distance from the fold at which the last shapes are looked at: there they are still told apart."""


class LineRange(NamedTuple):
    """Thrusts between which line states exist at n gaps.

    Attributes
    ----------
    first : ndarray, shape (n,)
        Where the strip is just long enough; NaN if it never is.
    last : ndarray, shape (n,)
        The fold, or the greatest thrust asked about.
    folds : ndarray of bool, shape (n,)
        Which of the two it is.
    """

    first: np.ndarray
    last: np.ndarray
    folds: np.ndarray


def line_range(segments, scene, smallest, largest, folds):
    """The range of line states of some segments.

    Parameters
    ----------
    segments : Mapping of Segment to int
    scene : Scene
        Of n points.
    smallest, largest : float
        Thrusts: one at which all segments exist and are longer than the strip, and the last of interest.
    folds : dict of Segment to ndarray
        Folds that are known already for these arguments; those found are added.

    Returns
    -------
    LineRange
    """
    for segment in segments.keys() - folds.keys():
        folds[segment] = _fold(segment, scene, smallest, largest)
    last = np.min([folds[segment] for segment in segments], axis=0)
    ends, last = last < largest, np.minimum(last, largest)
    first = np.full(last.size, np.nan)
    enough = np.flatnonzero(line_shapes(segments, last, scene)[1] >= 0)
    low = np.full(enough.size, smallest)

    def room(p, at):
        return line_shapes(segments, p, scene.at(at))[1]

    root = find_root(room, (low, last[enough]), args=(enough,))
    first[enough] = np.where(root.success, root.x, last[enough])
    return LineRange(first, last, ends)


def _fold(segment, scene, smallest, largest):
    """Thrust at which the line shapes of one segment fold, shape (n,); infinite if above `largest`."""
    n = scene.size
    if not segment.rise:
        return np.full(n, np.inf)
    if not segment.kind.springs:
        quarters = segment.kind.first + segment.kind.second
        p = (LINE_FOLD * quarters * np.pi / 2 / scene.rise(segment)) ** 2 * (1 - INSIDE)
        return np.where(p < largest, p, np.inf)
    last = np.full(n, np.inf)
    at = np.flatnonzero(~np.isfinite(line_force(segment, np.full(n, largest), scene)))
    scene = scene.at(at)
    inside, outside = np.full(at.size, smallest), np.full(at.size, largest)
    before, slope_before = 0.5 * inside, _slope(segment, 0.5 * inside, scene)
    slope = _slope(segment, inside, scene)
    for _ in range(EDGE_STEPS):
        # The square of the slope falls to zero there nearly in proportion to the distance.
        ahead = inside + NEARLY_THERE * slope * (inside - before) / (slope_before - slope)
        ahead = np.where((ahead > inside) & (ahead < outside), ahead, 0.5 * (inside + outside))
        there = _slope(segment, ahead, scene)
        good = np.isfinite(there)
        before, slope_before = np.where(good, inside, before), np.where(good, slope, slope_before)
        inside, outside = np.where(good, ahead, inside), np.where(good, outside, ahead)
        slope = np.where(good, there, slope)
    last[at] = inside
    return last


def _slope(segment, p, scene):
    """Square of the slope d(rise)/dλ of line shapes, in units of the load; NaN beyond their fold."""
    piece = arc(segment.kind, pendulum(p, np.zeros_like(p), line_force(segment, p, scene)))
    return (geometry(piece).rise_lam * p**1.5) ** 2


def line_shapes(segments, p, scene):
    """Total shortening of the segments at κ = 0, and the length that they leave of the strip.

    Parameters
    ----------
    segments : Mapping of Segment to int
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.

    Returns
    -------
    shorter, room : ndarray, shape (n,)
        NaN where the segments do not exist.
    """
    shorter, room = 0.0, 1.0
    for segment, count in segments.items():
        piece = arc(segment.kind, pendulum(p, np.zeros_like(p), line_force(segment, p, scene)))
        shorter = shorter + count * shortening(piece)
        room = room - count * length(piece)
    return shorter, room
