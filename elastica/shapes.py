"""Angle and position along the strip, by Jacobi functions.

Every free segment is evaluated in its rising convention and put in place: mirrored where it falls, reversed
where it leads from the last contact to end B. Flat stretches lie straight on their wall.
"""

from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.equilibria.roots import pendulums_of
from elastica.pendulum.segments import Pendulum
from elastica.pendulum.swing import Course, course, start_phase
from elastica.pendulum.theta import Series
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene

TOGETHER = 5000
"""Samples that are evaluated together, so that what belongs to them stays in cache."""


class Shape(NamedTuple):
    """The strip at arc lengths `s` (samples,): `theta`, `x`, `y` of shape (..., samples)."""

    s: np.ndarray
    theta: np.ndarray
    x: np.ndarray
    y: np.ndarray


def arc_lengths(samples):
    """`samples` equidistant arc lengths from end A to end B.

    Raises
    ------
    ValueError
        If that is not a whole number above 1.
    """
    if not isinstance(samples, (int, np.integer)) or samples < 2:
        raise ValueError(f"samples = {samples!r}; ask for at least two points along the strip")
    return np.linspace(0, 1, samples)


def sample(solution, samples):
    """Points of the strip at equidistant arc lengths from end A to end B.

    Parameters
    ----------
    solution : Solution
    samples : int
        At least 2.

    Returns
    -------
    Shape
        NaN where there is no equilibrium.

    Raises
    ------
    ValueError
        As `arc_lengths`.
    """
    s = arc_lengths(samples)
    n = solution.status.size
    theta, x, y = np.full((3, n, samples), np.nan)
    exists = np.flatnonzero(np.isin(solution.status, (Status.SOLVED, Status.INADMISSIBLE)).ravel())
    if solution.state.straight:
        theta[exists], x[exists], y[exists] = 0.0, s, 0.0
    else:
        with np.errstate(invalid="ignore"):
            for points, segments in solution.patterns(exists):
                for some, fields in _bent(solution, points, segments, s):
                    theta[some], x[some], y[some] = fields
    shape = (*solution.status.shape, samples)
    return Shape(s, theta.reshape(shape), x.reshape(shape), y.reshape(shape))


def angles(solution, point, s):
    """Exact θ at ascending arc lengths `s` (samples,) of a bent state at the point of a flat index."""
    ((points, segments),) = solution.patterns(np.array([point]))
    with np.errstate(invalid="ignore"):
        ((_, (theta, *_)),) = _bent(solution, points, segments, s)
        return theta[0]


class _Pieces(NamedTuple):
    """Free segments and flat stretches from end A to end B, arrays of one shape.

    Where along the strip each begins, its length, the place from which its own arc length is counted (0, or
    its end if it is reversed), and its course along that.
    """

    begin: np.ndarray
    length: np.ndarray
    origin: np.ndarray
    course: Course

    @classmethod
    def of(cls, table):
        """The pieces whose fields are the rows of a table (fields, ...)."""
        first, last = len(cls._fields) - 1, -len(Series._fields)
        course = Course._make((*table[first:last], Series._make(table[last:])))
        return cls._make((*table[:first], course))

    def rows(self):
        """The rows of that table."""
        return [*self[:-1], *self.course[:-1], *self.course.series]


def _bent(solution, points, segments, s):
    """Blocks of those flat indices, which share their segments, with θ, x, y of shape (some, samples)."""
    table = _pieces(solution, points, segments)
    # A sample belongs to the last piece that begins before it, also where a flat's length is negative.
    bounds = np.searchsorted(s, table[0, :, 1:], side="right")
    bounds = np.minimum.accumulate(bounds[:, ::-1], axis=1)[:, ::-1]
    samples = np.diff(bounds, prepend=0, append=s.size)
    together = max(1, TOGETHER // s.size)
    for first in range(0, points.size, together):
        block = slice(first, first + together)
        part = table[:, block].reshape(len(table), -1)
        spread = np.repeat(part, samples[block].ravel(), axis=1)
        own = _Pieces.of(spread.reshape(len(table), -1, s.size))
        along = np.abs(own.origin - np.minimum(s - own.begin, own.length))
        yield points[block], own.course.at(along)


def _pieces(solution, points, segments):
    """Table of the `_Pieces` of points that share their segments, shape (fields, points, pieces)."""
    state, walls = solution.state, np.array(solution.state.walls, float)
    P, H, kappa, flat = (
        field.ravel()[points, None]
        for field in (solution.P, solution.H, solution.curvature, solution.flat_length)
    )
    lam, lengths = (field.reshape(-1, len(segments))[points] for field in (solution.lam, solution.lengths))
    (q,) = pendulums_of(segments, FOUR_PI_SQUARED * P, kappa, [lam])
    q = Pendulum(*np.broadcast_arrays(*q))
    phases = [
        start_phase(segment.kind, Pendulum(*(field[:, i] for field in q)))
        for i, segment in enumerate(segments)
    ]
    rising = course(np.stack(phases, axis=1), q)
    wholes = rising.at(lengths)[1]

    every = 2 if state.line else 1
    number = every * (len(segments) - 1) + 1
    length, advance = np.tile(flat / max(walls.size, 1), (2, 1, number))
    length[:, ::every], advance[:, ::every] = lengths, wholes
    begin, x = np.zeros((2, *length.shape))
    np.cumsum(length[:, :-1], axis=1, out=begin[:, 1:])
    np.cumsum(advance[:, :-1], axis=1, out=x[:, 1:])

    scene = Scene(solution.ends, H)
    reverse = np.array(state.reversed_segments(solution.ends))
    side = np.append(walls, walls[-1:] if walls.size else 1.0)
    y = side * scene.height(np.array([segment.start for segment in segments]))
    placed = rising.placed(x[:, ::every] + reverse * wholes, y, side, 1 - 2 * reverse)
    free = _Pieces(begin[:, ::every], lengths, reverse * lengths, placed).rows()
    table = np.zeros((len(free), *length.shape))
    table[:, :, ::every] = free
    if state.line:
        lying = _Pieces.of(table[:, :, 1::2])
        lying.begin[:], lying.length[:] = begin[:, 1::2], length[:, 1::2]
        lying.course.x[:], lying.course.x_along[:], lying.course.y[:] = x[:, 1::2], 1, scene.height(walls)
        lying.course.series.e0[:], lying.course.series.period[:] = 1, np.inf
    return table
