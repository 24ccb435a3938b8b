"""Solve one block of a study: a pure function from labels to arrays.

An exception at one point costs that point: the block is halved until the point stands alone, which is
recorded as failed with the reason. Left out: files, processes, progress.
"""

from dataclasses import fields
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from elastica.codes import Status
from elastica.solution import Solution, solve
from elastica.states import is_canonical
from studies.schema import PER_CONTACT, VARIABLES, coordinates, per_state

PER_CONTACT_NAMES = [name for name, variable in VARIABLES.items() if variable.dims == PER_CONTACT]
FIELDS = {field.name for field in fields(Solution)}


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
    outputs : studies.study.Outputs

    Returns
    -------
    arrays : dict of str to ndarray
        The variables of the block, first dimension `ends` of length one.
    failures : list of Failure
    """
    H, P = (grid.ravel() for grid in np.meshgrid(block.H, block.P, indexing="ij"))
    arrays, failed = solve_points(block.ends, H, P, names, outputs)
    shape = (1, len(block.H), len(block.P))
    failures = []
    for point, state, reason in failed:
        row, column = divmod(point, len(block.P))
        ends, first_row, first_column = block.place
        failures.append(Failure(ends, first_row + row, first_column + column, state, reason))
    return {name: values.reshape(shape + values.shape[1:]) for name, values in arrays.items()}, failures


def solve_points(ends, H, P, names, outputs):
    """Solve every state at n points.

    Parameters
    ----------
    ends : str
    H, P : ndarray, shape (n,)
    names : sequence of str
    outputs : studies.study.Outputs

    Returns
    -------
    arrays : dict of str to ndarray, shape (n, states, ...)
    failed : list of (point, state, reason)
    """
    labels = coordinates((ends,), (), (), names, outputs)
    arrays = {
        name: np.full(
            (H.size, *(labels[dim].size for dim in variable.dims[3:])), variable.missing, variable.dtype
        )
        for name, variable in per_state(labels).items()
    }
    failed = []
    # Threads of BLAS would compete with the other workers for the same cores.
    with threadpool_limits(limits=1):
        for state, name in enumerate(names):
            if not is_canonical(name, ends):
                continue
            for points, values, reasons in _survive(name, ends, H, P, outputs):
                for variable, value in values.items():
                    target = arrays[variable]
                    if variable in PER_CONTACT_NAMES:
                        target[points, state, : value.shape[1]] = value
                    else:
                        target[points, state] = value
                failed += [(int(points[i]), state, reason) for i, reason in sorted(reasons.items())]
    return arrays, failed


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
    values = {name: getattr(solution, name) for name in VARIABLES if name in FIELDS}
    if not solution.state.word:
        for name in PER_CONTACT_NAMES:
            del values[name]
    if outputs.eigenvalues:
        values["eigenvalue"] = solution.eigenvalues(outputs.eigenvalues)
    if outputs.shapes:
        shape = solution.shape(outputs.shapes)
        values |= {"theta": shape.theta, "x": shape.x, "y": shape.y}
    return values, solution.reasons
