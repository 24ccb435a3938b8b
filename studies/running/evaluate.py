"""Solve one block of a study: a pure function from labels to arrays, or to events.

An exception at one point costs that point: the block is halved until the point stands alone, then the
states that are searched together until the guilty one does, which is recorded as failed with the reason.

Not here: files, processes, progress.
"""

import warnings
from functools import partial
from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.control import CONTROLS
from elastica.ends import parse_ends
from elastica.finding import search
from elastica.paths.transitions import transitions
from elastica.properties import QUANTITIES
from elastica.scene import Scene
from elastica.solving import solve
from elastica.state import is_canonical, parse_state
from studies.errors import StudyError
from studies.schema import VARIABLES, absent, nothing_found
from studies.store.transition_table import Row, place_of


class Outcome(NamedTuple):
    """One state at some points: values by variable, and reasons of failure by position in `points`."""

    name: str
    points: np.ndarray
    values: dict
    reasons: dict


class Failure(NamedTuple):
    """A point that could not be solved: its indices in the block along ends, H, control, state; and why."""

    ends: int
    H: int
    prescribed: int
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
    H, prescribed = block.labels()
    names, arrays, failed = solve_points(block.ends, H, block.control, prescribed, task, within)
    failures = []
    for point, state, reason in failed:
        of_ends, of_H, of_prescribed = map(int, np.unravel_index(point, block.shape))
        failures.append(Failure(of_ends, of_H, of_prescribed, state, reason))
    arrays = {name: values.reshape(block.shape + values.shape[1:]) for name, values in arrays.items()}
    return names, arrays, failures


def solve_points(ends, H, control, prescribed, task, within=here):
    """Solve every state at n points.

    Parameters
    ----------
    ends : str
    H : ndarray, shape (n,)
    control : str
    prescribed : ndarray, shape (n,)
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
    outcomes = []
    for solver, names in solvers:
        compute = partial(within, solver, ends, H, control, prescribed, task)
        outcomes += isolate_failures(compute, names, H.size)
    exist = [some.name for some in outcomes if (some.values["status"] != Status.NO_EQUILIBRIUM).any()]
    names = task.in_order(exist)
    arrays = nothing_found(H.size, ends, control, names, task.outputs)
    failed = []
    place = {name: number for number, name in enumerate(names)}
    for name, points, values, reasons in outcomes:
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


def isolate_failures(compute, names, points):
    """Solve names at all points; where that raises, at the halves, then half of the names.

    Yields
    ------
    Outcome
    """
    parts = [(np.arange(points), names)] if names else []
    while parts:
        points, names = parts.pop()
        try:
            outcomes = compute(names, points)
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
                yield Outcome(names[0], points, status, {0: f"{type(problem).__name__}: {problem}"})
            continue
        yield from outcomes


def _solve(ends, H, control, prescribed, task, names, points):
    """Single states, one root each."""
    for name in names:
        with warnings.catch_warnings():
            # Points with too few links are seen by their `error`.
            warnings.simplefilter("ignore", UserWarning)
            solution = solve(
                name, H=H[points], ends=ends, **{control: prescribed[points]}, **task.method.arguments
            )
        yield Outcome(name, points, _values(solution, task.outputs), solution.reasons)


def _search(ends, H, control, prescribed, task, names, points):
    """Every root of words; of a chain those that the strip has."""
    chain = task.method.method == "chain"
    scene = Scene(parse_ends(ends), H[points])
    for place, numbers, solution in search(names, scene, CONTROLS[control], prescribed[points]):
        values = {} if chain else _values(solution, task.outputs)
        for number in np.unique(numbers):
            own = np.flatnonzero(numbers == number)
            name = solution.state.name + (f":{number}" if number > 1 else "")
            if chain:
                yield from _solve(ends, H, control, prescribed, task, [name], points[place[own]])
            else:
                there = {key: value[own] for key, value in values.items()}
                yield Outcome(name, points[place[own]], there, {})


def _values(solution, outputs):
    """What a dataset stores of a solution, by variable."""
    values = {
        name: getattr(solution, name)
        for name in VARIABLES.keys() & QUANTITIES.keys() - {solution.control}
        if solution.state.word or not QUANTITIES[name].along
    }
    if outputs.eigenvalues:
        values["eigenvalue"] = solution.eigenvalues(outputs.eigenvalues)
    if outputs.frequencies:
        values["frequency"] = solution.frequencies(outputs.frequencies)
    if outputs.shapes:
        shape = solution.shape(outputs.shapes)
        values |= {"theta": shape.theta, "x": shape.x, "y": shape.y}
    return values


def find_events(block, names, within=here):
    """Events of states at the gaps of a block.

    Parameters
    ----------
    block : Gaps
    names : sequence of str
        Those that have no meaning with these ends are left out.
    within : callable
        As for `evaluate`: what it raises costs one state at one gap.

    Returns
    -------
    rows : list of Row
    failed : list of str
        Where events could not be found, and why.
    """
    H, rows, failed = np.array(block.H), [], []
    find = partial(within, _transitions, block.ends, H, block.prescribed)
    for name in (name for name in names if is_canonical(name, block.ends)):
        for _, points, values, reasons in isolate_failures(find, [name], H.size):
            failed += [f"{place_of(block.ends, H[points[i]], name)}: {why}" for i, why in reasons.items()]
            rows += values.get("rows", [])
    return rows, failed


def _transitions(ends, H, prescribed, names, selected):
    """Rows of states at the gaps selected."""
    first, last = prescribed
    for name in names:
        found = transitions(name, H[selected], ends, P_max=last)
        columns = (getattr(found, column).tolist() for column in Row._fields[1:])
        rows = [Row(ends, *row) for row in zip(*columns, strict=True)]
        yield Outcome(name, selected, {"rows": [row for row in rows if row.P >= first]}, {})
