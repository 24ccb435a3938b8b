"""Join files, the shards of a run or finished datasets, to one dataset, in bands of rows.

Left out: whether the files are there and intact (`shards`), and agree (`merging`).
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from studies.evaluate import unknown, word_failed
from studies.files import (
    chunks,
    content_hash,
    define,
    failure_indices,
    opened,
    read_labels,
    write_failures,
    written_whole,
)
from studies.schema import control_of, coordinates, per_state, variables

GROUP_BYTES = 300_000_000
"""Bytes of variables that are copied together, so that each source is opened once for all of them."""


class Source(NamedTuple):
    """A file that holds some points of a dataset.

    `searched` are the states that were asked for there, of words the first root if every root was sought.
    """

    path: Path
    ends: tuple[str, ...]
    H: np.ndarray
    given: np.ndarray
    searched: tuple[str, ...]
    every_root: bool

    def seconds_and_states(self, grid):
        """Seconds that its points took, if it is a shard; names solved, or failed, anywhere in a grid."""
        rows, columns = positions(self.H, grid.H)[0], positions(self.given, grid.given)[0]
        with opened(self.path) as file:
            seconds = float(file.getncattr("seconds")) if "seconds" in file.ncattrs() else None
            names = read_labels(file.variables["state"], self.path)
            there = np.zeros(names.size, bool)
            for number in [i for i, ends in enumerate(self.ends) if ends in grid.ends]:
                status = file.variables["status"][number][np.ix_(rows, columns)]
                there |= np.isin(status, (Status.SOLVED, Status.FAILED)).any(axis=(0, 1))
        return seconds, {str(name) for name in names[there]}


def source_of(block, path, task):
    """A shard as a source."""
    labels = (np.array(block.H), np.array(block.given))
    return Source(path, (block.ends,), *labels, task.names, task.every_root)


def reduce(study, sources, out, attributes):
    """Join files to one dataset, written whole.

    One band of rows is in memory at a time, as high as a chunk, so that each chunk is written once. What
    none holds is not computed.

    Parameters
    ----------
    study : Study
        Whose grid, states and outputs the dataset has.
    sources : list of Source
    out : Path
    attributes : dict
        Global attributes of the dataset.
    """
    grid = study.grid
    seconds, found = zip(*(source.seconds_and_states(grid) for source in sources), strict=True)
    asked = set(study.task.names)
    names = study.task.in_order(name for name in set().union(*found) if name.partition(":")[0] in asked)
    labels = coordinates(grid.ends, grid.H, grid.control, grid.given, names, study.outputs)
    with written_whole(out) as temporary:
        with opened(temporary, "w") as dataset:
            attributes = attributes | _timing([some for some in seconds if some is not None])
            define(dataset, labels, variables(labels, study.outputs), attributes)
            sizes = [len(grid.ends), len(grid.H), len(grid.given), len(names)]
            rows = chunks(per_state(labels, study.outputs)["energy"], sizes)[1]
            failures = set()
            for number in range(len(grid.ends)):
                for first in range(0, len(grid.H), rows):
                    band = slice(first, min(first + rows, len(grid.H)))
                    failures |= _reduce_band(study, sources, dataset, labels, number, band)
            write_failures(dataset, grid.control, sorted(failures))
        _seal(temporary)


def _seal(path):
    """Read a finished file back and store the hash of what it holds."""
    digest = content_hash(path)
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


def _reduce_band(study, sources, dataset, labels, number, band):
    """Copy rows of one end condition from the files that hold them; their failures."""
    grid = study.grid
    ends, control = grid.ends[number], grid.control
    names = [str(name) for name in labels["state"]]
    H = labels["H"]
    here = [source for source in sources if ends in source.ends and np.isin(source.H, H[band]).any()]
    verdict = {}
    for group in _groups(per_state(labels, study.outputs), labels, band):
        height = 1 if "s" in next(iter(group.values())).dims else band.stop - band.start
        for first in range(band.start, band.stop, height):
            rows = slice(first, first + height)
            values = {
                name: np.full(
                    (height, *(labels[dim].size for dim in variable.dims[2:])),
                    variable.missing,
                    variable.dtype,
                )
                for name, variable in group.items()
            }
            for source in here:
                _copy(source, group, ends, H[rows], labels[control], names, values)
            if "status" in values and study.task.every_root:
                status = values["status"]
                status[word_failed(status, names) & (status == Status.NO_EQUILIBRIUM)] = Status.NOT_COMPUTED
            for name, array in values.items():
                _write(dataset.variables[name], number, rows, array)
        verdict |= {
            name: values[name] for name in ("status", "stability", potential(control)) if name in values
        }
    stable, preferred = summarise(verdict["status"], verdict["stability"], verdict[potential(control)])
    dataset.variables["stable_count"][number, band] = stable
    dataset.variables["preferred_state"][number, band] = preferred
    return {
        failure
        for source in here
        for failure in _failures(source, ends, number, H, band, labels[control], names)
    }


def _groups(variables, labels, band):
    """Variables that are copied together: those along the strip alone, the others as memory allows."""
    group, room = {}, GROUP_BYTES
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


def _write(target, number, rows, values):
    """Write rows of a variable; chunks with nothing in them are left out."""
    for state in range(values.shape[2]):
        plane = values[:, :, state]
        if plane.dtype != "f8" or not np.isnan(plane).all():
            target[number, rows, :, state] = plane


def potential(control):
    """The energy that a stable state makes least: with fixed ends the load does no work."""
    return "energy" if control == "P" else "bending_energy"


def summarise(status, stability, energy):
    """Number of stable states, and position of the one of least energy (−1: none), at each point.

    Parameters
    ----------
    status, stability, energy : ndarray, shape (..., states)

    Returns
    -------
    stable_count, preferred_state : ndarray of int, shape (...)
    """
    stable = (status == Status.SOLVED) & (stability == Stability.STABLE)
    lowest = np.where(stable, energy, np.inf).argmin(axis=-1)
    return stable.sum(axis=-1), np.where(stable.any(axis=-1), lowest, -1)


def positions(labels, wanted):
    """Positions in `labels`, and in `wanted`, of the labels that are in both."""
    return np.intersect1d(labels, wanted, assume_unique=True, return_indices=True)[1:]


def _copy(source, group, ends, H, given, names, values):
    """Copy what a source holds of some rows into `values`, by variable, shape (rows, columns, state, …)."""
    from_rows, to_rows = positions(source.H, H)
    from_columns, to_columns = positions(source.given, given)
    if not (from_rows.size and from_columns.size):
        return
    first, last = from_rows.min(), from_rows.max() + 1
    number = source.ends.index(ends)
    with opened(source.path) as file:
        place = {str(state): i for i, state in enumerate(read_labels(file.variables["state"], source.path))}
        arrays = {
            name: file.variables[name][number, first:last][from_rows - first][:, from_columns]
            for name in group
            if name in file.variables
        }
    for name, variable in group.items():
        target = values[name]
        known = unknown(name, variable, (to_rows.size, to_columns.size, *target.shape[2:]), names, ends)
        for state, label in enumerate(names):
            if label in place and name in arrays:
                # A file has labels for the contacts of its own states only.
                array = arrays[name]
                extra = tuple(
                    slice(min(sizes)) for sizes in zip(array.shape[3:], target.shape[3:], strict=True)
                )
                known[(slice(None), slice(None), state, *extra)] = array[(..., place[label], *extra)]
            elif not _searched(source, label):
                continue
            target[(*np.ix_(to_rows, to_columns), state)] = known[:, :, state]


def _searched(source, label):
    """Whether a state was looked for in a file, so that its absence means that it exists nowhere there."""
    return (label.partition(":")[0] if source.every_root else label) in source.searched


def _failures(source, ends, number, H, band, given, names):
    """Rows of a file's failure table that lie in a band, with their positions in the dataset."""
    with opened(source.path) as file:
        if "failure" not in file.dimensions:
            return
        control = control_of(file.dimensions)
        columns = [file.variables[name][:] for name in failure_indices(control)]
        reasons = read_labels(file.variables["failure_reason"], source.path)
        states = read_labels(file.variables["state"], source.path)
    row_of, column_of = (
        dict(zip(*positions(*both), strict=True)) for both in ((source.H, H), (source.given, given))
    )
    for end, row, column, state, reason in zip(*columns, reasons, strict=True):
        known = row in row_of and column in column_of and source.ends[end] == ends
        if known and band.start <= row_of[row] < band.stop:
            yield number, int(row_of[row]), int(column_of[column]), names.index(states[state]), str(reason)
