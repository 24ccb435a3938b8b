"""Join the shards of a study to one dataset, in bands of rows.

Left out: whether the shards are there and intact (`shards`).
"""

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
from studies.provenance import describe
from studies.schema import coordinates, per_state, variables


def reduce(plan, shards, out):
    """Join the shards of a plan to one dataset, written whole.

    One band of rows is in memory at a time, as high as a chunk, so that each chunk is written once.

    Parameters
    ----------
    plan : Plan
    shards : dict of Block to Path
        Intact shards of all its blocks.
    out : Path
    """
    study, grid = plan.study, plan.study.grid
    found, seconds = _survey(shards)
    names = plan.task.in_order(found)
    labels = coordinates(grid.ends, grid.H, grid.control, grid.given, names, study.outputs)
    with written_whole(out) as temporary:
        with opened(temporary, "w") as dataset:
            attributes = {**describe(plan), **_timing(seconds)}
            define(dataset, labels, variables(labels, study.outputs), attributes)
            sizes = [len(grid.ends), len(grid.H), len(grid.given), len(names)]
            rows = chunks(per_state(labels, study.outputs)["energy"], sizes)[1]
            failures = []
            for number in range(len(grid.ends)):
                for first in range(0, len(grid.H), rows):
                    band = slice(first, min(first + rows, len(grid.H)))
                    failures += _reduce_band(plan, shards, dataset, labels, number, band)
            write_failures(dataset, grid.control, sorted(failures))
        _seal(temporary)


def _seal(path):
    """Read a finished file back and store the hash of what it holds."""
    digest = content_hash(path)
    with opened(path, "a") as dataset:
        dataset.setncattr("content_hash", digest)


def _timing(seconds):
    """What the blocks took, for those who plan the next study."""
    return {
        "block_seconds": f"{len(seconds)} blocks, median {np.median(seconds):.3g} s, "
        f"longest {max(seconds):.3g} s, sum {sum(seconds):.4g} s"
    }


def _reduce_band(plan, shards, dataset, labels, number, band):
    """Copy rows of one end condition from the shards that hold them; their failures."""
    here = [
        block
        for block in shards
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
            for block in here:
                _copy(shards[block], block, name, rows, names, values)
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
    begun = [block for block in here if block.place[1] >= band.start]
    return [failure for block in begun for failure in _failures(shards[block], control, names)]


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


def _failures(path, control, names):
    """Rows of a shard's failure table, with the positions of the states in the dataset."""
    with opened(path) as shard:
        if "failure" not in shard.dimensions:
            return []
        columns = [shard.variables[name][:] for name in failure_indices(control)]
        reasons = read_labels(shard.variables["failure_reason"], path)
        here = read_labels(shard.variables["state"], path)
    return [
        (*map(int, place), names.index(here[state]), str(reason))
        for *place, state, reason in zip(*columns, reasons, strict=True)
    ]


def _survey(shards):
    """Names of the states that are solved, or failed, anywhere; seconds of each block."""
    found, seconds = set(), []
    for path in shards.values():
        with opened(path) as shard:
            status = shard.variables["status"][:]
            names = read_labels(shard.variables["state"], path)
            seconds.append(float(shard.getncattr("seconds")))
        there = np.isin(status, (Status.SOLVED, Status.FAILED)).any(axis=(0, 1, 2))
        found |= {str(name) for name in names[there]}
    return found, seconds
