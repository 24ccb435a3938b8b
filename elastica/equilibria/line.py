"""The line regime along the load: where segments exist at κ = 0, and where the strip is long enough for them.

The length of segments at κ = 0 falls with the load: the strip is long enough from one load on, if it is at
any before their shapes fold.

Not here: one such segment (`pendulum.line`).
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.equilibria.newton import Roots
from elastica.pendulum.line import line_fold, line_force, line_shape
from elastica.pendulum.segments import length, shortening


def line_roots(segments, p, scene):
    """The segments at κ = 0, wherever all exist.

    Returns
    -------
    Roots
        Of n points.
    """
    return Roots.of_lines([line_force(segment.kind, p, scene.rise(segment)) for segment in segments])


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
        folds[segment] = line_fold(segment.kind, scene.rise(segment), smallest, largest)
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
        shape = line_shape(segment.kind, p, scene.rise(segment))
        shorter = shorter + count * shortening(shape)
        room = room - count * length(shape)
    return shorter, room
