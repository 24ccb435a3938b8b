"""Join files, the shards of a run or finished datasets, to one dataset, in bands of rows.

Codes are put together anew, since what a state is at a point may depend on what others found. Numbers of
shards that have chunks of the dataset are copied as they are (`copying`).

Not here: whether the files are there and intact (`shards`), are still what they were (`sources`), and agree
(`merging`).
"""

from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.control import CONTROLS
from studies.errors import StudyError
from studies.schema import (
    Variable,
    control_of,
    coordinates,
    failure_indices,
    first_root,
    per_state,
    variables,
    word_failed,
)
from studies.store.content import content_hash
from studies.store.files import opened, read_labels
from studies.store.layout import define, whole_planes, write, write_failures
from studies.store.sources import positions, read_points, read_rows, reading, shared
from studies.store.transition_table import join_events, write_events
from studies.whole_files import written_whole

GROUP_BYTES = 300_000_000
"""Bytes of variables that are copied together, so that each source is opened once for all of them."""


class Survey(NamedTuple):
    """What is to be known of sources before they are joined.

    Attributes
    ----------
    seconds : list of float
        What the shards among them took.
    names : set of str
        States solved, or failed, anywhere in the grid.
    failing : set of Path
        Sources with points that failed.
    """

    seconds: list
    names: set
    failing: set

    def __or__(self, other):
        """Of the sources of both."""
        return Survey(self.seconds + other.seconds, self.names | other.names, self.failing | other.failing)


def survey(sources, grid):
    """Read the status of everything that sources hold of a grid."""
    found = Survey([], set(), set())
    for source in sources:
        points, _ = shared(source, np.array(grid.H), np.array(grid.prescribed))
        with reading(source) as file:
            if "seconds" in file.ncattrs():
                found.seconds.append(float(file.getncattr("seconds")))
            if "failure" in file.dimensions:
                found.failing.add(source.path)
            names = read_labels(file.variables["state"], source.path)
            there = np.zeros(names.size, bool)
            for number in [i for i, ends in enumerate(source.ends) if ends in grid.ends]:
                status = read_points(file.variables["status"], number, points)
                there |= np.isin(status, (Status.SOLVED, Status.FAILED)).any(axis=0)
        found.names.update(str(name) for name in names[there])
    return found


def reduce(study, sources, surveyed, out, attributes, events=(), tile=None):
    """Join files to one dataset, written whole.

    One band of rows is in memory at a time, as high as a chunk, so that each chunk is written once. What
    none holds is not computed.

    Parameters
    ----------
    study : Study
        Whose grid, states and outputs the dataset has.
    sources : list of Source
        Of two that hold the same state of a point, the later one is believed.
    surveyed : Survey
        Of these sources.
    out : Path
    attributes : dict
        Global attributes of the dataset.
    events : iterable of Path
        Shards of its transition table.
    tile : (int, int) or None
        That of the plan, if all sources are shards of blocks that it cut the grid into.
    """
    grid = study.grid
    names = joined_labels(study, surveyed)
    labels = coordinates(grid.ends, grid.H, grid.control, grid.prescribed, names, study.outputs)
    with _new_dataset(out) as temporary:
        with opened(temporary, "w") as dataset:
            attributes = attributes | _timing(surveyed.seconds)
            tiles = tile or whole_planes(grid)
            define(dataset, labels, variables(labels, study.outputs), attributes, tiles)
            rows = tiles[0]
            reasons: dict[tuple, str] = {}
            for number, ends in enumerate(grid.ends):
                here = _by_band([source for source in sources if ends in source.ends], grid.H, rows)
                for first, among in zip(range(0, len(grid.H), rows), here, strict=True):
                    band = slice(first, min(first + rows, len(grid.H)))
                    status = _reduce_band(study, among, dataset, labels, number, band, tile is not None)
                    for source in among:
                        if source.path in surveyed.failing:
                            reasons |= _failures(source, ends, number, band, labels, status)
            write_failures(dataset, grid.control, sorted((*where, why) for where, why in reasons.items()))
            write_events(dataset, *join_events(events, grid.ends, names))
        if tile:
            # Its own HDF5 library is loaded only where chunks are copied.
            from studies.store.copying import copy_numbers

            copy_numbers(sources, temporary, labels, per_state(labels, study.outputs))
        _seal(temporary, out)


@contextmanager
def _new_dataset(out):
    """`written_whole`, where nobody else may have written meanwhile."""
    try:
        with written_whole(out, replaces=False) as temporary:
            yield temporary
    except FileExistsError:
        raise StudyError(
            f"{out}: this file appeared while the study was computed, and is left as it is; move it away, "
            "and the same command writes the dataset of what is computed, all of which is kept"
        ) from None


def joined_labels(study, surveyed):
    """States of the dataset that is joined from these sources, in order."""
    asked = set(study.task.names)
    return study.task.in_order(name for name in surveyed.names if first_root(name) in asked)


def _seal(path, out):
    """Read a finished file back and store the hash of what it holds."""
    try:
        digest = content_hash(path)
    except StudyError as problem:
        raise StudyError(
            f"{out}: what is written does not read back, so shards were damaged while they were joined, or "
            f"the disk is ({problem}); the same command computes damaged shards again and writes the dataset"
        ) from None
    with opened(path, "a") as dataset:
        dataset.setncattr("content_hash", digest)


def _timing(seconds):
    """What the blocks took, for those who plan the next study."""
    if not seconds:
        return {}
    return {
        "block_seconds": f"{len(seconds)} blocks, median {np.median(seconds):.3g} s, "
        f"longest {max(seconds):.3g} s, sum {sum(seconds):.4g} s"
    }


def _by_band(sources, H, rows):
    """The sources of each band of rows, in their order: a list for each band."""
    bands: list[list] = [[] for _ in range(0, len(H), rows)]
    for source in sources:
        for band in np.unique(positions(np.unique(source.H), H)[1] // rows):
            bands[band].append(source)
    return bands


def _reduce_band(study, sources, dataset, labels, number, band, codes_only):
    """Put together rows of one end condition from the files that hold them: their status."""
    grid = study.grid
    ends, control = grid.ends[number], grid.control
    potential = CONTROLS[control].potential
    names = [str(name) for name in labels["state"]]
    needed = {
        name: variable
        for name, variable in per_state(labels, study.outputs).items()
        if not codes_only or variable.dtype != "f8" or name == potential
    }
    verdict: dict[str, np.ndarray] = {}
    for group in _groups(needed, labels, band):
        for rows, columns in _pieces(group, dataset, labels, band):
            H, prescribed = labels["H"][rows], labels[control][columns]
            values = {
                name: np.full(
                    (H.size, prescribed.size, *(labels[dim].size for dim in variable.dims[3:])),
                    variable.missing,
                    variable.dtype,
                )
                for name, variable in group.items()
            }
            for source in sources:
                read_rows(source, group, ends, H, prescribed, names, values)
            if "status" in values and study.task.every_root:
                status = values["status"]
                status[word_failed(status, names) & (status == Status.NO_EQUILIBRIUM)] = Status.NOT_COMPUTED
            for name, array in values.items():
                if not codes_only or array.dtype != "f8":
                    write(dataset.variables[name], (slice(number, number + 1), rows, columns), array[None])
        verdict |= {name: values[name] for name in ("status", "stability", potential) if name in values}
    stable, preferred = summarise(verdict["status"], verdict["stability"], verdict[potential])
    dataset.variables["stable_count"][number, band] = stable
    dataset.variables["preferred_state"][number, band] = preferred
    return verdict["status"]


def _groups(variables, labels, band):
    """Variables that are copied together: those along the strip alone, the others as memory allows."""
    group: dict[str, Variable] = {}
    room = GROUP_BYTES
    for name, variable in variables.items():
        if "s" in variable.dims:
            yield {name: variable}
            continue
        cells = (band.stop - band.start) * np.prod([labels[dim].size for dim in variable.dims[2:]])
        size = cells * np.dtype(variable.dtype).itemsize
        if group and size > room:
            yield group
            group, room = {}, GROUP_BYTES
        group[name] = variable
        room -= size
    yield group


def _pieces(group, dataset, labels, band):
    """Rows and columns of a band that are put together: all, but of what is along the strip some chunks."""
    name, variable = next(iter(group.items()))
    control = variable.dims[2]
    if "s" not in variable.dims:
        yield band, slice(0, labels[control].size)
        return
    _, height, width, *_ = dataset.variables[name].chunking()
    chunk = height * width * labels["state"].size * labels["s"].size * np.dtype(variable.dtype).itemsize
    width *= max(1, int(GROUP_BYTES // chunk))
    for row in range(band.start, band.stop, height):
        for column in range(0, labels[control].size, width):
            yield slice(row, min(row + height, band.stop)), slice(column, column + width)


def summarise(status, stability, energy):
    """Number of stable states (−1: not computed), and position of the one of least energy (−1: none).

    Parameters
    ----------
    status, stability, energy : ndarray, shape (..., states)

    Returns
    -------
    stable_count, preferred_state : ndarray of int, shape (...)
    """
    stable = (status == Status.SOLVED) & (stability == Stability.STABLE)
    lowest = np.where(stable, energy, np.inf).argmin(axis=-1)
    computed = (status != Status.NOT_COMPUTED).any(axis=-1)
    return np.where(computed, stable.sum(axis=-1), -1), np.where(stable.any(axis=-1), lowest, -1)


def _failures(source, ends, number, band, labels, status):
    """Why points of a band failed, as a file tells, by their indices in the dataset."""
    with reading(source) as file:
        control = control_of(file.dimensions)
        columns = [file.variables[name][:] for name in failure_indices(control)]
        reasons = read_labels(file.variables["failure_reason"], source.path)
        states = read_labels(file.variables["state"], source.path)
    names = [str(name) for name in labels["state"]]
    there, here = (np.transpose(points).tolist() for points in shared(source, labels["H"], labels[control]))
    place_of = {tuple(point): place for point, place in zip(there, here, strict=True)}
    found = {}
    for end, *point, state, reason in zip(*columns, reasons, strict=True):
        row, column = place_of.get(tuple(point), (-1, -1))
        if band.start <= row < band.stop and source.ends[end] == ends and states[state] in names:
            where = row, column, names.index(states[state])
            # Another file may have solved it since.
            if status[where[0] - band.start, *where[1:]] == Status.FAILED:
                found[number, *where] = str(reason)
    return found
