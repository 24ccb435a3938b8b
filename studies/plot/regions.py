"""Regions of the plane of gap and load in which a label holds, and their exact boundaries.

A label is known at the grid points of a dataset. Between neighbours that agree it is theirs; between others
it is asked of the solver, on a grid that is halved until it is as fine as a picture. Then each place where
the label changes is narrowed down along the line of the grid on which it lies.
"""

from typing import Any, NamedTuple

import numpy as np
from contourpy import contour_generator
from scipy.ndimage import distance_transform_edt

from studies.plot.multisection import narrow

FINE = (200, 400)
"""Least numbers of points of a picture along H and the control."""
TRACED = (140, 280)
"""Lines of the grid on which boundaries are traced."""
NARROWED = 5
"""How often the way across a boundary is divided."""


class Plane(NamedTuple):
    """Labels (H, given) over two axes, integers."""

    H: np.ndarray
    given: np.ndarray
    labels: np.ndarray


def fill(labels, known):
    """Labels with those of points that were not computed taken from the nearest that was."""
    if known.all() or not known.any():
        return labels
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return labels[tuple(nearest)]


def spread(plane):
    """The plane on a grid as fine as a picture, every point with the label of the nearest grid point."""
    axes, places = [], []
    for labels, fine in zip(plane[:2], FINE, strict=True):
        even = np.geomspace if log_spaced(labels) else np.linspace
        axes.append(even(labels[0], labels[-1], max(fine, len(labels))))
        steps = np.interp(axes[-1], labels, np.arange(len(labels)))
        places.append(np.clip(np.floor(steps + 0.5).astype(int), 0, len(labels) - 1))
    H, given = axes
    return Plane(H, given, plane.labels[np.ix_(*places)])


def sharpen(plane, decide):
    """Halve the grid until it is fine enough, asking `decide` where neighbours differ.

    Parameters
    ----------
    plane : Plane
    decide : callable
        Of H, given (n,) and the labels (2, n) of the two neighbours; gives labels (n,).
    """
    while len(plane.H) < FINE[0]:
        plane = _halved(plane, decide)
    # The other axis is the same with rows and columns exchanged.
    turned = Plane(plane.given, plane.H, plane.labels.T)
    while len(turned.H) < FINE[1]:
        turned = _halved(turned, lambda given, H, around: decide(H, given, around))
    return Plane(turned.given, turned.H, turned.labels.T)


def _halved(plane, decide):
    """The plane with a row between each two rows."""
    rows, columns, labels = plane
    middle = between(rows[:-1], rows[1:], log_spaced(rows))
    new = labels[:-1].copy()
    i, j = np.nonzero(labels[:-1] != labels[1:])
    if i.size:
        new[i, j] = decide(middle[i], columns[j], np.stack([labels[i, j], labels[i + 1, j]]))
    finer = np.empty((2 * len(rows) - 1, len(columns)), labels.dtype)
    finer[::2], finer[1::2] = labels, new
    at = np.empty(2 * len(rows) - 1)
    at[::2], at[1::2] = rows, middle
    return Plane(at, columns, finer)


def trace(H, given, inside, decide):
    """Curves that bound where a condition holds.

    Parameters
    ----------
    H, given : ndarray, shape (n,), (m,)
    inside : ndarray of bool, shape (n, m)
    decide : callable
        Of H and given (k,); gives bool (k,).

    Returns
    -------
    list of (ndarray, ndarray, ndarray)
        For each curve the places (2, k) next to it where the condition still holds, and those where it does
        not any more, both of H and given, and numbers (k,) of the grid edges that it crosses.
    """
    rows, columns = (_spread(len(axis), most) for axis, most in zip((H, given), TRACED, strict=True))
    H, given, inside = H[rows], given[columns], inside[np.ix_(rows, columns)]
    # Arrays, one a line; other settings of contourpy give other types.
    lines: Any = contour_generator(z=inside.astype(float)).lines(0.5)
    if not lines:
        return []
    ends = np.cumsum([len(line) for line in lines])[:-1]
    place = np.concatenate(lines)[:, ::-1]
    near, far = np.floor(place).astype(int), np.ceil(place).astype(int)
    swap = ~inside[tuple(near.T)]
    near[swap], far[swap] = far[swap], near[swap]
    edge = np.ravel_multi_index(np.minimum(near, far).T, inside.shape) * 2 + (near[:, 0] == far[:, 0])
    within, beyond = (np.stack([H[at[:, 0]], given[at[:, 1]]]) for at in (near, far))
    within, beyond = narrow(lambda places, _: decide(*places), within, beyond, NARROWED)
    return list(zip(*(np.split(values, ends, axis=-1) for values in (within, beyond, edge)), strict=True))


def _spread(count, most):
    """At most about `most` of `count` positions, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def log_spaced(labels):
    """Whether labels are spaced evenly on a logarithmic axis and not on a linear one."""
    return len(labels) > 2 and labels[0] > 0 and np.ptp(np.diff(np.log(labels))) < 1e-6


def between(low, high, logarithmic):
    """Middles of intervals, on a linear or a logarithmic axis."""
    return np.sqrt(low * high) if logarithmic else (low + high) / 2
