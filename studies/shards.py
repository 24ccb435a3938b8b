"""Shards: one file a block, written by whoever computed it, reduced to the final dataset in bands.

Left out: which blocks there are (`plan`) and when they are computed (`run`).
"""

from contextlib import suppress
from pathlib import Path

import numpy as np

from elastica.codes import Stability, Status
from studies.errors import StudyError
from studies.evaluate import evaluate, unknown, word_failed
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
from studies.provenance import describe
from studies.schema import FORMAT_VERSION, coordinates, per_state, variables


def folder_of(out):
    """Folder of the shards of an output file."""
    return Path(f"{out}.shards")


def shard_path(folder, block):
    """File of a block: its place and extent in the grid."""
    place = "-".join(f"{number:06d}" for number in (*block.place, len(block.H), len(block.given)))
    return Path(folder) / f"{place}.nc"


def compute_shard(block, task, identity, folder):
    """Solve a block and write its shard.

    Returns
    -------
    points, failures : int
        Grid points done, states that failed.
    """
    names, arrays, failures = evaluate(block, task)
    outputs = task.outputs
    labels = coordinates((block.ends,), block.H, block.control, block.given, names, outputs)
    path = shard_path(folder, block)
    with written_whole(path) as temporary:
        with opened(temporary, "w") as dataset:
            attributes = {**identity, "format_version": FORMAT_VERSION}
            define(dataset, labels, per_state(labels, outputs), attributes)
            for name, values in arrays.items():
                dataset.variables[name][:] = values
            write_failures(dataset, block.control, failures)
        _seal(temporary)
    return block.points, len(failures)


def _seal(path):
    """Read a finished file back and store the hash of what it holds."""
    digest = content_hash(path)
    with opened(path, "a") as dataset:
        dataset.setncattr("content_hash", digest)


def remove_shards(plan, folder):
    """Remove the shards of a plan, and their folder unless it holds something else."""
    for block in plan.blocks:
        shard_path(folder, block).unlink(missing_ok=True)
    for leftover in folder.glob(".*.part"):
        leftover.unlink(missing_ok=True)
    with suppress(OSError):
        folder.rmdir()


def shard_is_valid(path, identity):
    """Whether a shard is there, belongs to the study and its numerics, and holds what was written."""
    try:
        with opened(path) as dataset:
            sealed = dataset.getncattr("content_hash")
            if any(dataset.getncattr(name) != value for name, value in identity.items()):
                return False
        return content_hash(path) == sealed
    except (OSError, RuntimeError, AttributeError):
        return False


def reduce(plan, folder, out):
    """Join the shards of a plan to one dataset, written whole.

    One band of rows is in memory at a time, as high as a chunk, so that each chunk is written once.

    Parameters
    ----------
    plan : Plan
    folder, out : Path

    Raises
    ------
    StudyError
        If a shard is missing.
    """
    study, grid = plan.study, plan.study.grid
    missing = [block for block in plan.blocks if not shard_path(folder, block).exists()]
    if missing:
        raise StudyError(f"{folder}: {len(missing)} of {len(plan.blocks)} shards are missing")
    names = plan.task.in_order(_found(plan, folder))
    labels = coordinates(grid.ends, grid.H, grid.control, grid.given, names, study.outputs)
    with written_whole(out) as temporary:
        with opened(temporary, "w") as dataset:
            define(dataset, labels, variables(labels, study.outputs), describe(plan))
            sizes = [len(grid.ends), len(grid.H), len(grid.given), len(names)]
            rows = chunks(per_state(labels, study.outputs)["energy"], sizes)[1]
            failures = []
            for number in range(len(grid.ends)):
                for first in range(0, len(grid.H), rows):
                    band = slice(first, min(first + rows, len(grid.H)))
                    failures += _reduce_band(plan, folder, dataset, labels, number, band)
            write_failures(dataset, grid.control, sorted(failures))
        _seal(temporary)


def _reduce_band(plan, folder, dataset, labels, number, band):
    """Copy rows of one end condition from the shards that hold them; their failures."""
    shards = [
        block
        for block in plan.blocks
        if block.place[0] == number
        and block.place[1] < band.stop
        and block.place[1] + len(block.H) > band.start
    ]
    control, ends = plan.study.grid.control, plan.study.grid.ends[number]
    names = [str(name) for name in labels["state"]]
    verdict = {}
    for name, variable in per_state(labels, plan.study.outputs).items():
        height = band.stop - band.start if "s" not in variable.dims else 1
        for first in range(band.start, band.stop, height):
            rows = slice(first, first + height)
            shape = (height, *(labels[dim].size for dim in variable.dims[2:]))
            values = unknown(name, variable, shape, names, ends)
            for block in shards:
                _copy(shard_path(folder, block), block, name, rows, names, values)
            if name == "status" and plan.task.every_root:
                lost = word_failed(values, names) & (values == Status.NO_EQUILIBRIUM)
                values[lost] = Status.NOT_COMPUTED
            target = dataset.variables[name]
            for state in range(len(names)):
                plane = values[:, :, state]
                if variable.dtype != "f8" or not np.isnan(plane).all():
                    target[number, rows, :, state] = plane
        if name in ("status", "stability", potential(control)):
            verdict[name] = values
    stable, preferred = summarise(verdict["status"], verdict["stability"], verdict[potential(control)])
    dataset.variables["stable_count"][number, band] = stable
    dataset.variables["preferred_state"][number, band] = preferred
    first_of_block = [block for block in shards if block.place[1] >= band.start]
    return [failure for block in first_of_block for failure in _failures(folder, block, names)]


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


def _copy(path, block, name, band, names, values):
    """Copy the rows of `band` that a shard holds into `values` (rows, columns, state, …)."""
    first = max(band.start, block.place[1])
    last = min(band.stop, block.place[1] + len(block.H))
    if first >= last:
        return
    with opened(path) as shard:
        if name not in shard.variables:
            return
        source = shard.variables[name][0, first - block.place[1] : last - block.place[1]]
        here = [str(state) for state in read_labels(shard.variables["state"], path)]
    rows = slice(first - band.start, last - band.start)
    columns = slice(block.place[2], block.place[2] + len(block.given))
    # A shard has labels for the contacts of its own states only.
    extra = tuple(slice(min(sizes)) for sizes in zip(source.shape[3:], values.shape[3:], strict=True))
    place = {state: number for number, state in enumerate(here)}
    for state, label in enumerate(names):
        if label in place:
            values[(rows, columns, state, *extra)] = source[(..., place[label], *extra)]


def _failures(folder, block, names):
    """Rows of a shard's failure table, with the positions of the states in the dataset."""
    path = shard_path(folder, block)
    with opened(path) as shard:
        if "failure" not in shard.dimensions:
            return []
        columns = [shard.variables[name][:] for name in failure_indices(block.control)]
        reasons = read_labels(shard.variables["failure_reason"], path)
        here = read_labels(shard.variables["state"], path)
    return [
        (*map(int, place), names.index(here[state]), str(reason))
        for *place, state, reason in zip(*columns, reasons, strict=True)
    ]


def _found(plan, folder):
    """Names of the states that are solved, or failed, anywhere."""
    found = set()
    for block in plan.blocks:
        path = shard_path(folder, block)
        with opened(path) as shard:
            status = shard.variables["status"][:]
            names = read_labels(shard.variables["state"], path)
        there = np.isin(status, (Status.SOLVED, Status.FAILED)).any(axis=(0, 1, 2))
        found |= {str(name) for name in names[there]}
    return found
