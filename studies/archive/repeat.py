"""Find values of a dataset again: grid points are solved anew, transitions searched anew, and compared.

What a file says of itself excuses nothing: a point that it calls critical must be critical again, its
`error` is measured against the new one, and what cannot be compared is counted.

Not here: what a file can be told to be wrong without solving anything (`checking`).
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from elastica.codes import Event, Stability, Status
from studies.design.block import Gaps
from studies.running.evaluate import find_events, solve_points
from studies.schema import VARIABLES, absent, first_root, nothing_found, word_failed
from studies.store.transition_table import in_order, place_of

SAMPLE_GAPS = 3
"""At how many gaps points are solved again under prescribed shortening, since each is traced."""
SAMPLE_EVENTS = 3
"""States at one gap whose transitions are found again."""
AGREE = 1e-9
"""Relative difference between events from different processors."""
ROUNDING = 1e-12
ROOM = 100.0
"""Values differ between processors by rounding; `error` bounds it for κ, lengths and energy, the others
follow from these with a factor."""
CHAIN_ROOM = 1e-6
"""The error of a chain is that of its links, which are the same here."""
CRITICAL_ROOM = 1e-6
"""Where a state is about to change, rounding counts by its square root."""
RELATIVE = ("energy", "bending_energy", "shortening", "P")
NOT_COMPARED = ("not computed", "failed in the file", "failed now", "critical now", "not followed now")
VERDICT = ("stability", "index", "nullity")


class Repeated(NamedTuple):
    """What came of solving points again.

    Attributes
    ----------
    points : int
        Grid points solved again.
    compared : int
        States there that could be compared, of those that are not absent in both.
    not_compared : dict of str to int
        How many could not, by the reason.
    problems : list of str
    """

    points: int
    compared: int
    not_compared: dict
    problems: list


def repeat_points(study, labels, values, sample, seed, older, unsearched):
    """Solve some grid points again and compare: flags exactly, numbers within the error of the new ones.

    Parameters
    ----------
    study : Study
    labels, values : dict of str to ndarray
        Of the dataset.
    sample, seed : int
        How many points, and which.
    older : bool
        Whether the dataset is by numerics that had no word for what was not followed.
    unsearched : collection of str
        States that the dataset says are not computed at all points.

    Returns
    -------
    Repeated
    """
    names = [str(name) for name in labels["state"]]
    control = study.grid.control
    computed = (values["status"] != Status.NOT_COMPUTED).any(axis=-1)
    e, i, j = _chosen(computed, control, sample, seed)
    problems, compared, left = [], 0, dict.fromkeys(NOT_COMPARED, 0)
    for number, ends in enumerate(study.grid.ends):
        here = (number, i[e == number], j[e == number])
        H, prescribed = labels["H"][here[1]], labels[control][here[2]]
        found, solved, _ = solve_points(ends, H, control, prescribed, study.task)
        again = _labelled(solved, found, names, study, ends)
        old = {name: values[name][here] for name in again}
        unknown_here = old["status"] == Status.NOT_COMPUTED
        failed, fails = (word_failed(some["status"], names) & ~unknown_here for some in (old, again))
        unclear = older & (old["status"] == Status.NO_EQUILIBRIUM) & (again["status"] == Status.NOT_FOLLOWED)
        critical = again["stability"] == Stability.CRITICAL
        missing = unknown_here & (again["status"] != Status.NOT_COMPUTED)
        for reason, where in zip(left, (missing, failed, fails & ~failed, critical, unclear), strict=True):
            left[reason] += int(where.sum())
        sure = ~(failed | fails | unknown_here | unclear)
        compared += int((sure & ~critical).sum())
        room = ROOM * np.fmax(again["error"], ROUNDING)
        if study.solve.method == "chain":
            room = np.minimum(room, CHAIN_ROOM)
        room = np.where(critical, np.maximum(room, CRITICAL_ROOM), room)
        differing = {name: _differs(name, old, again, sure, critical, room) for name in again}
        lost = [name for name in found if name not in names and first_root(name) not in unsearched]
        status = solved["status"][:, [found.index(name) for name in lost]]
        differing["state"] = (status == Status.SOLVED).any(axis=1) & ~missing.any(axis=1)
        for name, differs in differing.items():
            if differs.any():
                point = int(np.flatnonzero(differs)[0])
                problems.append(
                    f"{name} cannot be found again at {differs.sum()} of {H.size} points of {ends}, "
                    f"first at H={H[point]:g}, {control}={prescribed[point]:g}"
                )
    return Repeated(e.size, compared, {reason: count for reason, count in left.items() if count}, problems)


def _chosen(computed, control, sample, seed):
    """Indices along ends, H and the control of those points computed that are to be solved again."""
    rng = np.random.default_rng(seed)
    if control != "P":
        gaps = rng.permutation(np.flatnonzero(computed.any(axis=(0, 2))))[:SAMPLE_GAPS]
        computed = computed & np.isin(np.arange(computed.shape[1]), gaps)[:, None]
    points = np.argwhere(computed)
    chosen = np.sort(rng.choice(len(points), min(sample, len(points)), replace=False))
    return points[chosen].T


def _labelled(solved, found, names, study, ends):
    """What was solved now, with the states in the order of the dataset."""
    arrays = nothing_found(len(solved["status"]), ends, study.grid.control, names, study.outputs)
    common = [(state, found.index(name)) for state, name in enumerate(names) if name in found]
    for name in arrays.keys() & solved.keys():
        new, old = arrays[name], solved[name]
        extra = tuple(slice(min(sizes)) for sizes in zip(new.shape[2:], old.shape[2:], strict=True))
        for state, place in common:
            new[(slice(None), state, *extra)] = old[(slice(None), place, *extra)]
    for state, name in enumerate(names):
        arrays["status"][:, state] = absent(name, arrays["status"][:, state], solved["status"], found)
    return arrays


def _differs(name, old, new, sure, critical, room):
    """Points where a variable differs by more than rounding, of those states that are sure, shape (n,)."""
    a, b = old[name], new[name]
    if VARIABLES[name].dtype != "f8":
        # Where a state is critical now, the file may tell a side of it.
        return ((a != b) & sure & ~(critical & (name in VERDICT))).any(axis=1)
    extra = (1,) * (a.ndim - 2)
    if name == "error":
        same = (a <= ROOM * np.fmax(b, ROUNDING)) & (b <= ROOM * np.fmax(a, ROUNDING))
    else:
        scale = np.abs(b) if name in RELATIVE else np.maximum(np.abs(b), 1.0)
        same = np.abs(a - b) <= room.reshape(*sure.shape, *extra) * scale
    same |= (np.isnan(a) & np.isnan(b)) | ~sure.reshape(*sure.shape, *extra)
    return ~same.all(axis=tuple(range(1, a.ndim)))


def repeat_events(study, labels, events, without, sample, seed):
    """Rows of the transition table that cannot be; and those of some states at some gaps, found again.

    Parameters
    ----------
    study : Study
    labels : dict of str to ndarray
    events : list of studies.store.transition_table.Row
    without : str
        Where the file says that they could not be found.
    sample, seed : int

    Returns
    -------
    Repeated
        Its points are states at one gap.
    """
    nothing = Repeated(0, 0, {}, [])
    if not study.outputs.transitions:
        unasked = ["there is a transition table, for which the study did not ask"] if events else []
        return nothing._replace(problems=unasked)
    names = [str(name) for name in labels["state"]]
    first, last = study.grid.prescribed[0], study.grid.prescribed[-1]
    codes = [event.value for event in Event]
    wrong = [
        row
        for row in events
        if row.ends not in study.grid.ends
        or row.H not in study.grid.H
        or row.state not in names
        or row.event not in codes
        or not first <= row.P <= last
    ]
    if wrong:
        told = f"{len(wrong)} rows of the transition table do not belong to the dataset, first {wrong[0]}"
        return nothing._replace(problems=[told])
    in_its_order = in_order(events, study.grid.ends, names) == events
    problems = [] if in_its_order else ["the transitions are not in order"]
    every = list(product(study.grid.ends, study.grid.H, names))
    searched = [place for place in every if f"{place_of(*place)}: " not in without]
    chosen = np.random.default_rng(seed).permutation(len(searched))[: min(sample, SAMPLE_EVENTS)]
    for ends, H, name in (searched[number] for number in chosen):
        block = Gaps((0, 0, 0), ends, (H,), "P", (first, last))
        new = in_order(find_events(block, [name])[0], study.grid.ends, names)
        old = [row for row in events if (row.ends, row.H, row.state) == (ends, H, name)]
        if [row[4:] for row in old] != [row[4:] for row in new] or not np.allclose(
            [row[2:4] for row in old], [row[2:4] for row in new], rtol=AGREE, atol=AGREE
        ):
            problems.append(f"the transitions of {name} cannot be found again at {ends} H={H:g}")
    lost = len(every) - len(searched)
    not_compared = {"transitions could not be found, says the file": lost} if lost else {}
    return Repeated(len(chosen), len(chosen), not_compared, problems)
