"""Angle and position along the strip, by Jacobi functions.

Every free segment is evaluated in its rising convention and put in place: mirrored where it falls, reversed
where it leads from the last contact to end B. Flat stretches lie straight on their wall.
"""

from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.equilibria.roots import pendulums_of
from elastica.pendulum.swing import course
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene


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
                theta[points], x[points], y[points] = _bent(solution, points, segments, s)
    shape = (*solution.status.shape, samples)
    return Shape(s, theta.reshape(shape), x.reshape(shape), y.reshape(shape))


def angles(solution, point, s):
    """Exact θ at arc lengths `s` (samples,) of a bent state at one point, given by its flat index."""
    ((points, segments),) = solution.patterns(np.array([point]))
    with np.errstate(invalid="ignore"):
        return _bent(solution, points, segments, s)[0][0]


def _bent(solution, points, segments, s):
    """θ, x, y at flat indices that share their segments, each of shape (points, samples)."""
    state = solution.state
    p = FOUR_PI_SQUARED * solution.P.ravel()[points]
    scene = Scene(solution.ends, solution.H.ravel()[points, None])
    kappa = solution.curvature.ravel()[points]
    lam, lengths = (field.reshape(-1, len(segments))[points].T for field in (solution.lam, solution.lengths))
    pendulums = pendulums_of(segments, p, kappa, lam)
    flat = solution.flat_length.ravel()[points, None] / max(len(state.word), 1)
    walls = state.walls
    reverses = state.reversed_segments(solution.ends)
    theta, y = np.zeros((2, points.size, s.size))
    x = np.zeros_like(y)
    begin = np.zeros((points.size, 1))
    x_begin = np.zeros((points.size, 1))
    for i, (segment, reverse) in enumerate(zip(segments, reverses, strict=True)):
        q = pendulums[i]
        ell = lengths[i][:, None]
        side = 1 if not walls else walls[min(i, len(walls) - 1)]
        along = np.clip(s - begin, 0, ell)
        angle, advance, height = course(segment.kind, q, ell - along if reverse else along)
        whole = course(segment.kind, q, ell)[1]
        # Later segments overwrite, so that the last sample belongs to the last one despite rounding.
        inside = (s > begin) | (i == 0)
        theta = np.where(inside, side * (-angle if reverse else angle), theta)
        x = np.where(inside, x_begin + (whole - advance if reverse else advance), x)
        y = np.where(inside, side * (scene.height(segment.start) + height), y)
        begin, x_begin = begin + ell, x_begin + whole
        if i < len(walls):
            lies = s > begin
            x = np.where(lies, x_begin + s - begin, x)
            y = np.where(lies, scene.height(walls[i]), y)
            theta = np.where(lies, 0.0, theta)
            begin, x_begin = begin + flat, x_begin + flat
    return theta, x, y
