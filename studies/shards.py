"""Shards: one file a block, written by whoever computed it, reduced to the final dataset in bands.

Left out: which blocks there are (`plan`) and when they are computed (`run`).
"""

from contextlib import suppress
from pathlib import Path

import numpy as np

from elastica.codes import Stability, Status
from studies.errors import StudyError
from studies.evaluate import evaluate
from studies.files import (
    FAILURE_INDICES,
    chunks,
    content_hash,
    define,
    opened,
    write_failures,
    written_whole,
)
from studies.provenance import describe
from studies.schema import FORMAT_VERSION, GRID, STATES, VARIABLES, coordinates, per_state, variables


def folder_of(out):
    """Folder of the shards of an output file."""
    return Path(f"{out}.shards")


def shard_path(folder, block):
    """File of a block: its place and extent in the grid."""
    place = "-".join(f"{number:06d}" for number in (*block.place, len(block.H), len(block.P)))
    return Path(folder) / f"{place}.nc"


def compute_shard(block, names, outputs, identity, folder):
    """Solve a block and write its shard.

    Returns
    -------
    points, failures : int
        Grid points done, states that failed.
    """
    arrays, failures = evaluate(block, names, outputs)
    labels = coordinates((block.ends,), block.H, block.P, names, outputs)
    path = shard_path(folder, block)
    with written_whole(path) as temporary:
        with opened(temporary, "w") as dataset:
            define(dataset, labels, per_state(labels), {**identity, "format_version": FORMAT_VERSION})
            for name, values in arrays.items():
                dataset.variables[name][:] = values
            write_failures(dataset, failures)
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
    study = plan.study
    missing = [block for block in plan.blocks if not shard_path(folder, block).exists()]
    if missing:
        raise StudyError(f"{folder}: {len(missing)} of {len(plan.blocks)} shards are missing")
    kept = _names_to_keep(plan, folder)
    grid = study.grid
    labels = coordinates(grid.ends, grid.H, grid.P, [plan.names[i] for i in kept], study.outputs)
    with written_whole(out) as temporary:
        with opened(temporary, "w") as dataset:
            define(dataset, labels, variables(labels), describe(plan))
            sizes = [labels[dim].size for dim in STATES]
            rows = chunks(VARIABLES["energy"], sizes)[1]
            failures = []
            for number in range(len(grid.ends)):
                for first in range(0, len(grid.H), rows):
                    band = slice(first, min(first + rows, len(grid.H)))
                    failures += _reduce_band(plan, folder, dataset, labels, number, band, kept)
            write_failures(dataset, sorted(failures))
        _seal(temporary)


def _reduce_band(plan, folder, dataset, labels, number, band, kept):
    """Copy rows of one end condition from the shards that hold them; their failures."""
    shards = [
        block
        for block in plan.blocks
        if block.place[0] == number
        and block.place[1] < band.stop
        and block.place[1] + len(block.H) > band.start
    ]
    verdict = {}
    for name, variable in per_state(labels).items():
        height = band.stop - band.start if "s" not in variable.dims else 1
        for first in range(band.start, band.stop, height):
            rows = slice(first, first + height)
            shape = [height, *(labels[dim].size for dim in variable.dims[2:])]
            values = np.full(shape, variable.missing, variable.dtype)
            for block in shards:
                _copy(shard_path(folder, block), block, name, rows, kept, values)
            target = dataset.variables[name]
            for state in range(len(kept)):
                plane = values[:, :, state]
                if variable.dtype != "f8" or not np.isnan(plane).all():
                    target[number, rows, :, state] = plane
        if name in ("status", "stability", "energy"):
            verdict[name] = values
    stable, preferred = summarise(**verdict)
    dataset.variables["stable_count"][number, band] = stable
    dataset.variables["preferred_state"][number, band] = preferred
    first_of_block = [block for block in shards if block.place[1] >= band.start]
    return [failure for block in first_of_block for failure in _failures(folder, block, kept)]


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


def _copy(path, block, name, band, kept, values):
    """Copy the rows of `band` that a shard holds into `values` (rows, P, state, …)."""
    first = max(band.start, block.place[1])
    last = min(band.stop, block.place[1] + len(block.H))
    if first >= last:
        return
    with opened(path) as shard:
        if name not in shard.variables:
            return
        source = shard.variables[name][0, first - block.place[1] : last - block.place[1]]
    source = source[:, :, kept]
    if source.ndim == 4:
        source = source[..., : values.shape[3]]
    columns = slice(block.place[2], block.place[2] + len(block.P))
    values[first - band.start : last - band.start, columns] = source


def _failures(folder, block, kept):
    """Rows of a shard's failure table, with the positions of the states that are kept."""
    with opened(shard_path(folder, block)) as shard:
        if "failure" not in shard.dimensions:
            return []
        indices = np.stack([shard.variables[name][:] for name in FAILURE_INDICES], axis=1)
        text = shard.variables["failure_reason"][:]
        reasons = [row.tobytes().rstrip(b"\0").decode() for row in text]
    return [
        (*map(int, row[:3]), kept.index(int(row[3])), reason)
        for row, reason in zip(indices, reasons, strict=True)
    ]


def _names_to_keep(plan, folder):
    """Positions of the states that stay: all that were named, else those found anywhere."""
    if plan.study.states.names is not None:
        return list(range(len(plan.names)))
    found = np.zeros(len(plan.names), bool)
    worth_keeping = (Status.SOLVED, Status.FAILED)
    for block in plan.blocks:
        with opened(shard_path(folder, block)) as shard:
            status = shard.variables["status"][:]
        found |= np.isin(status, worth_keeping).any(axis=tuple(range(len(GRID))))
    return [int(i) for i in np.flatnonzero(found)]
