"""Solve one block of a study: a pure function from labels to arrays.

An exception at one point costs that point: the block is halved until the point stands alone, then the
states that are searched together until the guilty one does, which is recorded as failed with the reason.
Not here: files, processes, progress.
"""

import warnings
from dataclasses import fields
from functools import partial
from math import prod
from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.ends import parse_ends
from elastica.finding import search
from elastica.solution import Solution, solve
from elastica.state import is_canonical, parse_state
from studies.errors import StudyError
from studies.schema import PER_CONTACT, VARIABLES, coordinates, per_state

PER_CONTACT_NAMES = [name for name, variable in VARIABLES.items() if variable.dims == PER_CONTACT]
FIELDS = {field.name for field in fields(Solution)}


class Block(NamedTuple):
    """A rectangle of the grid: one end condition, some half gaps, some loads or shortenings, every state.

    `place` is the position (ends, first H, first of those given) in the grid; `control` says what is given.
    """

    place: tuple[int, int, int]
    ends: str
    H: tuple[float, ...]
    control: str
    given: tuple[float, ...]

    @property
    def shape(self):
        """Extent of its arrays along ends, H and the control."""
        return 1, len(self.H), len(self.given)

    @property
    def points(self):
        """Number of grid points."""
        return prod(self.shape)

    def labels(self):
        """Labels H and those given of every point, in the order of the arrays, shape (points,)."""
        return tuple(grid.ravel() for grid in np.meshgrid(self.H, self.given, indexing="ij"))


class Scattered(Block):
    """Some points of the grid, wherever they are: `H` and `given` have the labels of each, in one row."""

    __slots__ = ()

    @property
    def shape(self):
        """Extent of its arrays along ends, H and the control."""
        return 1, 1, len(self.given)

    def labels(self):
        """Labels H and those given of every point, shape (points,)."""
        return np.array(self.H), np.array(self.given)


class Task(NamedTuple):
    """What is computed at every grid point.

    With `every_root`, all roots of the words among `names`, which are then those of first roots;
    `outputs` and `method` are those of the study.
    """

    names: tuple[str, ...]
    every_root: bool
    outputs: object
    method: object

    def in_order(self, found):
        """Names that label a dataset in which these were found: by name, then by root; never none."""
        if not self.every_root:
            return self.names
        place = {name: number for number, name in enumerate(self.names)}

        def rank(name):
            first, _, root = name.partition(":")
            return place[first], int(root or 1)

        return tuple(sorted(set(found), key=rank)) or self.names[:1]


class Piece(NamedTuple):
    """One state at some points: values by variable, and reasons of failure by position in `points`."""

    name: str
    points: np.ndarray
    values: dict
    reasons: dict


class Failure(NamedTuple):
    """A point that could not be solved: its indices in the block along ends, H, control, state; and why."""

    ends: int
    H: int
    given: int
    state: int
    reason: str


def here(solver, *arguments):
    """Let a solver work in this process."""
    return list(solver(*arguments))


def evaluate(block, task, within=here):
    """Solve every state at every point of a block.

    Parameters
    ----------
    block : Block
    task : Task
    within : callable
        Calls a solver of some states at some points; what it raises costs these states at these points.

    Returns
    -------
    names : tuple of str
        Labels of the states; of a search those that have an equilibrium somewhere in the block.
    arrays : dict of str to ndarray
        The variables of the block, first dimension `ends` of length one.
    failures : list of Failure
    """
    H, given = block.labels()
    names, arrays, failed = solve_points(block.ends, H, block.control, given, task, within)
    failures = [
        Failure(*map(int, np.unravel_index(point, block.shape)), state, reason)
        for point, state, reason in failed
    ]
    arrays = {name: values.reshape(block.shape + values.shape[1:]) for name, values in arrays.items()}
    return names, arrays, failures


def solve_points(ends, H, control, given, task, within=here):
    """Solve every state at n points.

    Parameters
    ----------
    ends : str
    H : ndarray, shape (n,)
    control : str
    given : ndarray, shape (n,)
        Loads or shortenings.
    task : Task
    within : callable
        As for `evaluate`.

    Returns
    -------
    names : tuple of str
    arrays : dict of str to ndarray, shape (n, states, ...)
    failed : list of (point, state, reason)
    """
    solvers = []
    alone = [name for name in task.names if is_canonical(name, ends)]
    if task.every_root:
        # Shapes without contact have one root, and `solve` says where they are too steep to be found.
        words = [name for name in alone if parse_state(name, ends).word]
        alone = [name for name in alone if name not in words]
        solvers.append((_search, words))
    solvers += [(_solve, [name]) for name in alone]
    pieces = []
    for solver, names in solvers:
        compute = partial(within, solver, ends, H, control, given, task)
        pieces += isolate_failures(compute, names, H.size)
    exist = [piece.name for piece in pieces if (piece.values["status"] != Status.NO_EQUILIBRIUM).any()]
    names = task.in_order(exist)
    labels = coordinates((ends,), (), control, (), names, task.outputs)
    arrays = {
        name: unknown(name, variable, (H.size, *(labels[dim].size for dim in variable.dims[3:])), names, ends)
        for name, variable in per_state(labels, task.outputs).items()
    }
    failed = []
    place = {name: number for number, name in enumerate(names)}
    for name, points, values, reasons in pieces:
        if name not in place:
            continue
        state = place[name]
        for variable, value in values.items():
            # A state may have fewer contacts, or be asked for fewer modes, than there are labels.
            extra = tuple(slice(size) for size in value.shape[1:])
            arrays[variable][(points, state, *extra)] = value
        failed += [(int(points[i]), state, reason) for i, reason in reasons.items()]
    status = arrays["status"]
    for state, name in enumerate(names):
        status[:, state] = absent(name, status[:, state], status, names)
    return names, arrays, sorted(failed)


def unknown(name, variable, shape, states, ends):
    """Values of a variable where nothing was found: no equilibrium, if the state has a meaning there.

    Parameters
    ----------
    name : str
    variable : Variable
    shape : tuple of int
    states : sequence of str
        Labels of the states, the last axis of `status`.
    ends : str

    Returns
    -------
    ndarray
    """
    values = np.full(shape, variable.missing, variable.dtype)
    if name == "status":
        known = [is_canonical(state.partition(":")[0], ends) for state in states]
        values[..., known] = Status.NO_EQUILIBRIUM
    return values


def absent(name, status, among, states):
    """Status of a state where it was not found: if a root of its word was not followed, neither was it.

    Parameters
    ----------
    name : str
    status : ndarray of int, shape (...)
        NO_EQUILIBRIUM where it was not found.
    among : ndarray of int, shape (..., states)
        Status of other roots of the word, among others.
    states : sequence of str
        Their labels.

    Returns
    -------
    ndarray of int, shape (...)
    """
    word = name.partition(":")[0]
    roots = [number for number, state in enumerate(states) if state.partition(":")[0] == word]
    lost = (among[..., roots] == Status.NOT_FOLLOWED).any(axis=-1)
    return np.where(lost & (status == Status.NO_EQUILIBRIUM), Status.NOT_FOLLOWED, status)


def word_failed(status, states):
    """Whether the search for a state's word failed: then nothing is known of its further roots.

    Parameters
    ----------
    status : ndarray, shape (..., states)
    states : sequence of str
        Labels of the states.

    Returns
    -------
    ndarray of bool, shape (..., states)
    """
    failed = status == Status.FAILED
    place = {state: number for number, state in enumerate(states)}
    first = [place.get(state.partition(":")[0], number) for state, number in place.items()]
    return failed | failed[..., first]


def isolate_failures(compute, names, points):
    """Solve names at all points; where that raises, at the halves, then half of the names.

    Yields
    ------
    Piece
    """
    parts = [(np.arange(points), names)] if names else []
    while parts:
        points, names = parts.pop()
        try:
            pieces = compute(names, points)
        except StudyError:
            # That there is nothing to solve with is no matter of the point.
            raise
        except Exception as problem:  # Whatever went wrong is recorded with the point.
            if points.size > 1:
                parts += [(half, names) for half in np.array_split(points, 2)[::-1]]
            elif len(names) > 1:
                middle = len(names) // 2
                parts += [(points, names[middle:]), (points, names[:middle])]
            else:
                status = {"status": np.array([Status.FAILED])}
                yield Piece(names[0], points, status, {0: f"{type(problem).__name__}: {problem}"})
            continue
        yield from pieces


def _solve(ends, H, control, given, task, names, points):
    """Single states, one root each."""
    for name in names:
        with warnings.catch_warnings():
            # Points with too few links are seen by their `error`.
            warnings.simplefilter("ignore", UserWarning)
            solution = solve(
                name, H=H[points], ends=ends, **{control: given[points]}, **task.method.arguments
            )
        yield Piece(name, points, _values(solution, task.outputs), solution.reasons)


def _search(ends, H, control, given, task, names, points):
    """Every root of words; of a chain those that the strip has."""
    chain = task.method.method == "chain"
    for place, numbers, solution in search(names, parse_ends(ends), control, given[points], H[points]):
        values = None if chain else _values(solution, task.outputs)
        for number in np.unique(numbers):
            own = np.flatnonzero(numbers == number)
            name = solution.state.name + (f":{number}" if number > 1 else "")
            if chain:
                yield from _solve(ends, H, control, given, task, [name], points[place[own]])
            else:
                yield Piece(name, points[place[own]], {key: value[own] for key, value in values.items()}, {})


def _values(solution, outputs):
    """What a dataset stores of a solution, by variable."""
    values = {
        name: getattr(solution, name) for name in VARIABLES if name in FIELDS and name != solution.control
    }
    if not solution.state.word:
        for name in PER_CONTACT_NAMES:
            del values[name]
    if outputs.eigenvalues:
        values["eigenvalue"] = solution.eigenvalues(outputs.eigenvalues)
    if outputs.frequencies:
        values["frequency"] = solution.frequencies(outputs.frequencies)
    if outputs.shapes:
        shape = solution.shape(outputs.shapes)
        values |= {"theta": shape.theta, "x": shape.x, "y": shape.y}
    return values
