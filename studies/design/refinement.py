"""Where a refined study computes: a tree that halves the cells in which the stable states change.

On the grid of integers, whose steps are those of the finest labels, a cell is mixed if the points known in
it, or on its boundary, do not all have the same stable states. A mixed cell is cut in four, so the points
that are wanted follow from the points that are known: no tree is stored, and a run that was stopped goes on
from its shards. What is found on an edge is known to both cells beside it, so a boundary is followed
wherever it leads.

Not here: what is known in files (`sources`), how the points are computed (`runner`).
"""

import numpy as np

UNKNOWN = -1
SEED = 20261122


def first_points(shape, refine):
    """Points that are wanted before anything is known: the coarse grid, and random ones in its cells.

    Parameters
    ----------
    shape : (int, int)
        Of the finest grid.
    refine : Refine

    Returns
    -------
    ndarray of bool, shape (H, prescribed)
    """
    wanted = np.zeros(shape, bool)
    wanted[first_places(shape, refine)] = True
    return wanted


def first_places(shape, refine):
    """Positions of these points, row by row, in time and memory that do not grow with the finest grid.

    Returns
    -------
    rows, columns : ndarray of int
    """
    stride = refine.stride
    coarse = np.arange(0, shape[0], stride)[:, None] * shape[1] + np.arange(0, shape[1], stride)
    corners = np.moveaxis(np.indices([(size - 1) // stride for size in shape]), 0, -1) * stride
    # Raw numbers, because NumPy may change what it makes of them, which would be other points.
    drawn = np.random.PCG64(SEED).random_raw((refine.audit, *corners.shape)) % np.uint64(stride - 1)
    rows, columns = np.moveaxis(corners + 1 + drawn.astype(int), -1, 0)
    # `np.unique` takes twenty times as long as to sort.
    places = np.sort(np.concatenate([coarse.ravel(), (rows * shape[1] + columns).ravel()]))
    return np.divmod(places[np.diff(places, prepend=-1) > 0], shape[1])


def next_points(codes, refine):
    """Points that are wanted next: of every mixed cell, those that cut it in four.

    Parameters
    ----------
    codes : ndarray of int, shape (H, prescribed)
        A number for each set of stable states; `UNKNOWN` where nothing is computed.
    refine : Refine

    Returns
    -------
    ndarray of bool, shape (H, prescribed)
        Unknown points only; none when the refinement is complete.
    """
    wanted = np.zeros(codes.shape, bool)
    least = np.where(codes == UNKNOWN, np.iinfo(codes.dtype).max, codes)
    lowest, highest = _of_corners(np.minimum, least), _of_corners(np.maximum, codes)
    half = 1
    while half < refine.stride:
        lowest, highest = _of_quarters(np.minimum, lowest), _of_quarters(np.maximum, highest)
        mixed = lowest < highest
        lattice = wanted[::half, ::half]
        rows, columns = mixed.shape
        for i in range(3):
            for j in range(3):
                lattice[i : i + 2 * rows - 1 : 2, j : j + 2 * columns - 1 : 2] |= mixed
        half *= 2
    return wanted & (codes == UNKNOWN)


def _of_corners(function, values):
    """The least, or the greatest, of the values at the four corners of each of the smallest cells."""
    edges = function(values[:-1], values[1:])
    return function(edges[:, :-1], edges[:, 1:])


def _of_quarters(function, cells):
    """The least, or the greatest, of the values of the four cells that make one of twice their side."""
    halves = function(cells[::2], cells[1::2])
    return function(halves[:, ::2], halves[:, 1::2])
