"""Solve one block of a study: a pure function from labels to arrays.

An exception at one point costs that point: the block is halved until the point stands alone, which is
recorded as failed with the reason. Left out: files, processes, progress.
"""

from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from elastica.codes import Status
from elastica.solution import solve
from elastica.states import is_canonical
from studies.schema import STATES, coordinates, variables


class Block(NamedTuple):
    """A rectangle of the grid: one end condition, some half gaps, some loads, every state.

    `place` is the position (ends, first H, first P) in the grid.
    """

    place: tuple[int, int, int]
    ends: str
    H: tuple[float, ...]
    P: tuple[float, ...]

    @property
    def points(self):
        """Number of grid points."""
        return len(self.H) * len(self.P)


class Failure(NamedTuple):
    """A point that could not be solved: indices along ends, H, P and state, and why."""

    ends: int
    H: int
    P: int
    state: int
    reason: str


def evaluate(block, names, outputs):
    """Solve every state at every point of a block.

    Parameters
    ----------
    block : Block
    names : sequence of str
        Canonical names of the states.
    outputs : Outputs

    Returns
    -------
    arrays : dict of str to ndarray
        The variables of the block, first dimension `ends` of length one.
    failures : list of Failure
    """
    labels = coordinates((block.ends,), block.H, block.P, names, outputs)
    arrays = {
        name: np.full([labels[dim].size for dim in variable.dims], variable.missing, variable.dtype)
        for name, variable in variables(labels).items()
        if variable.dims[: len(STATES)] == STATES
    }
    H, P = (grid.ravel() for grid in np.meshgrid(block.H, block.P, indexing="ij"))
    failures = []
    # Threads of BLAS would compete with the other workers for the same cores.
    with threadpool_limits(limits=1):
        for number, name in enumerate(names):
            if not is_canonical(name, block.ends):
                continue
            for points, values, reasons in _survive(name, block.ends, H, P, outputs):
                place = np.unravel_index(points, (len(block.H), len(block.P)))
                for variable, value in values.items():
                    target = arrays[variable][0, place[0], place[1], number]
                    if target.ndim > 1:
                        value = _pad(value, target.shape)
                    arrays[variable][0, place[0], place[1], number] = value
                failures += [
                    Failure(
                        block.place[0],
                        block.place[1] + int(place[0][i]),
                        block.place[2] + int(place[1][i]),
                        number,
                        reason,
                    )
                    for i, reason in sorted(reasons.items())
                ]
    return arrays, failures


def _pad(value, shape):
    """Fill missing contacts with NaN."""
    padded = np.full(shape, np.nan)
    padded[:, : value.shape[1]] = value
    return padded


def _survive(name, ends, H, P, outputs):
    """Solve the points given; where that raises, solve the halves.

    Yields
    ------
    points : ndarray of int
    values : dict of str to ndarray
    reasons : dict of int to str
        By position in `points`.
    """
    parts = [np.arange(H.size)]
    while parts:
        points = parts.pop()
        try:
            values, reasons = _solve(name, ends, H[points], P[points], outputs)
        except Exception as problem:  # Whatever went wrong is recorded with the point.
            if points.size > 1:
                parts += [points[points.size // 2 :], points[: points.size // 2]]
                continue
            values = {"status": np.array([Status.FAILED])}
            reasons = {0: f"{type(problem).__name__}: {problem}"}
        yield points, values, reasons


def _solve(name, ends, H, P, outputs):
    solution = solve(name, P=P, H=H, ends=ends)
    values = {
        field: getattr(solution, field)
        for field in [
            "status",
            "stability",
            "index",
            "nullity",
            "curvature",
            "energy",
            "bending_energy",
            "shortening",
            "flat_length",
            "max_slope",
            "clearance",
            "error",
        ]
    }
    if solution.state.word:
        values |= {field: getattr(solution, field) for field in ("reaction", "contact_position")}
    if outputs.eigenvalues:
        values["eigenvalue"] = solution.eigenvalues(outputs.eigenvalues)
    if outputs.shapes:
        shape = solution.shape(outputs.shapes)
        values |= {"theta": shape.theta, "x": shape.x, "y": shape.y}
    return values, solution.reasons
