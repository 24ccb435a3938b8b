"""Files that hold points of a dataset: shards of a run, or finished datasets that must stay what was proved.

Not here: how a dataset is made of what they hold (`joining`).
"""

from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from studies.design.block import Scattered
from studies.design.refinement import UNKNOWN
from studies.errors import StudyError
from studies.schema import absent, first_root, status_unless_found
from studies.store.files import mark_of, opened, read_labels


class Source(NamedTuple):
    """A file that holds some points of a dataset.

    `searched` are the states that were asked for there, of words the first root if every root was sought.
    If the points are `scattered`, `H` and `prescribed` have the labels of each, and in the file they are one
    row.
    `mark` is that of the file (`files.mark_of`) when its content was proved; None for a shard of ours.
    """

    path: Path
    ends: tuple[str, ...]
    H: np.ndarray
    prescribed: np.ndarray
    searched: tuple[str, ...]
    every_root: bool
    scattered: bool = False
    mark: tuple | None = None


@contextmanager
def reading(source):
    """A source as an open dataset, which is still what was proved, from the beginning to the end.

    Raises
    ------
    StudyError
        If it is not.
    """
    refuse_changed(source)
    try:
        with opened(source.path) as file:
            yield file
    finally:
        refuse_changed(source)


def refuse_changed(source):
    """Refuse a file that is not the one whose content was proved, as `reading` does."""
    if source.mark not in (None, mark_of(source.path)):
        raise StudyError(
            f"{source.path}: this file was changed, or replaced by another, since its content was proved; "
            "nothing of it is taken, the same command reads it anew, and what is computed is kept"
        )


def source_of(block, path, task):
    """A shard as a source."""
    labels = (np.array(block.H), np.array(block.prescribed))
    scattered = isinstance(block, Scattered)
    return Source(path, (block.ends,), *labels, task.names, task.every_root, scattered)


def positions(labels, wanted):
    """Positions in `labels`, and in `wanted`, of the labels that are in both; both increase."""
    labels, wanted = np.asarray(labels), np.asarray(wanted)
    if labels.size > wanted.size:
        return positions(wanted, labels)[::-1]
    place = np.searchsorted(wanted, labels)
    both = wanted[np.minimum(place, wanted.size - 1)] == labels
    return np.flatnonzero(both), place[both]


def shared(source, H, prescribed):
    """Points that a source and a grid with these labels have both: rows and columns there, and here.

    Parameters
    ----------
    source : Source
    H, prescribed : ndarray
        Increasing labels.

    Returns
    -------
    there, here : tuple of ndarray of int, each (rows, columns) of the points
    """
    if source.scattered:
        places = [
            np.searchsorted(labels, wanted).clip(max=labels.size - 1)
            for labels, wanted in ((H, source.H), (prescribed, source.prescribed))
        ]
        found = np.flatnonzero((H[places[0]] == source.H) & (prescribed[places[1]] == source.prescribed))
        return (np.zeros_like(found), found), tuple(place[found] for place in places)
    both = [positions(source.H, H), positions(source.prescribed, prescribed)]
    return tuple(
        tuple(place.ravel() for place in np.meshgrid(*places, indexing="ij"))
        for places in zip(*both, strict=True)
    )


def read_points(variable, number, points):
    """Values of a variable of a file at some points, rows and columns, of one end condition."""
    if not points[0].size:
        return variable[number, :0, 0]
    first, last = ([place.min() for place in points], [place.max() + 1 for place in points])
    slab = variable[number, first[0] : last[0], first[1] : last[1]]
    return slab[points[0] - first[0], points[1] - first[1]]


def read_rows(source, group, ends, H, prescribed, names, values):
    """Copy what a source holds of some rows into `values`, by variable, shape (rows, columns, state, …)."""
    there, here = shared(source, np.asarray(H), np.asarray(prescribed))
    if not there[0].size:
        return
    number = source.ends.index(ends)
    with reading(source) as file:
        place = {str(state): i for i, state in enumerate(read_labels(file.variables["state"], source.path))}
        arrays = {
            name: read_points(file.variables[name], number, there)
            for name in ("status", *group)
            if name in file.variables
        }
    computed = arrays["status"] != Status.NOT_COMPUTED
    nowhere = status_unless_found(names, ends)
    for state, label in enumerate(names):
        if label in place:
            which = computed[:, place[label]]
        elif _searched(source, label):
            which = np.ones(len(computed), bool)
        else:
            continue
        rows, columns = (index[which] for index in here)
        for name, variable in group.items():
            target = values[name]
            if label in place and name in arrays:
                # A file has labels for the contacts of its own states only.
                array = arrays[name]
                extra = tuple(
                    slice(min(sizes)) for sizes in zip(array.shape[2:], target.shape[3:], strict=True)
                )
                target[(rows, columns, state, *extra)] = array[(which, place[label], *extra)]
            else:
                target[rows, columns, state] = variable.missing
                if name == "status":
                    target[rows, columns, state] = absent(label, nowhere[state], arrays["status"], place)


def _searched(source, label):
    """Whether a state was looked for in a file, so that its absence means that it exists nowhere there."""
    return (first_root(label) if source.every_root else label) in source.searched


class StableStates:
    """What is known of a grid: at each point a number for the set of states that are stable there.

    Attributes
    ----------
    codes : ndarray of int, shape (ends, H, prescribed)
    """

    def __init__(self, grid):
        self.codes = np.full((len(grid.ends), len(grid.H), len(grid.prescribed)), UNKNOWN, "i4")
        self._grid = grid
        self._number = {}

    def learn(self, source):
        """Take what a file holds."""
        grid = self._grid
        there, here = shared(source, np.array(grid.H), np.array(grid.prescribed))
        with reading(source) as file:
            names = read_labels(file.variables["state"], source.path)
            for ends in set(source.ends) & set(grid.ends):
                status, stability = (
                    read_points(file.variables[name], source.ends.index(ends), there)
                    for name in ("status", "stability")
                )
                known = (status != Status.NOT_COMPUTED).any(axis=1)
                stable = (status == Status.SOLVED) & (stability == Stability.STABLE)
                sets, which = np.unique(stable[known], axis=0, return_inverse=True)
                codes = [self._number.setdefault(frozenset(names[row]), len(self._number)) for row in sets]
                plane = self.codes[grid.ends.index(ends)]
                plane[tuple(place[known] for place in here)] = np.array(codes, "i4")[which.ravel()]
