"""Compute one block wherever there is a processor: solve it, write its shard, outlive what it does.

A block is solved in a process of its own with a time limit. If that process is lost, the block is solved
again in parts, each in a fresh process: the part that is lost is halved until one state at one point stands
alone, which is tried once more, with twice the time, and then recorded as failed.

Not here: which processor (`session`).
"""

import time
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.design.block import Gaps, Task
from studies.errors import FailedPoints, StudyError
from studies.running.evaluate import evaluate, find_events, here
from studies.sandbox import Lost, call
from studies.store.provenance import decisive_versions
from studies.store.shards import write_events_shard, write_shard

LEAST_SHARE, LEAST_SECONDS = 1 / 20, 10.0
"""Of the time limit of a block, for its smallest part: some work is the same for one point as for many."""
NAMED = 10
"""Failures that a block names to the summary of the run; the dataset has them all."""
CARRIERS = ("netCDF4", "distributed")
"""Libraries that bring blocks to workers and shards back."""


class Job(NamedTuple):
    """What a block needs to know of its run.

    `limit` is the seconds of a block, None where it is to be solved in this very process; `probe` is a file
    in the folder, by which workers show that they see it; `tile` is that of the plan.
    """

    task: Task
    identity: dict
    folder: Path
    versions: tuple
    limit: float | None
    raises: bool
    probe: str = ""
    tile: tuple[int, int] | None = None


class Done(NamedTuple):
    """A finished block: its shard, and those of its failures that a summary names."""

    points: int
    shard: str
    failures: int
    named: tuple[str, ...]


@cache
def versions():
    """What must be the same wherever blocks of one study are solved."""
    return (*decisive_versions().items(), *((name, version(name)) for name in CARRIERS))


def check_worker(folder, probe, versions_here):
    """Check that this process sees the folder of a run and solves as its client would.

    Arguments are of built-in types, which a worker with another version of this package understands.

    Parameters
    ----------
    folder : Path
    probe : str
        Name of a file that is there.
    versions_here : tuple of (str, str)
        `versions` of the client.

    Raises
    ------
    StudyError
        If it does not.
    """
    try:
        seen = (folder / probe).exists()
    except OSError:
        seen = False
    if not seen:
        raise StudyError(
            f"{folder}: a worker does not see this folder; put the output where all machines see it, "
            "by the same path"
        )
    if versions() != versions_here:
        here, there = dict(versions_here), dict(versions())
        unlike = [
            f"{name} {here.get(name)} here, {there.get(name)} there"
            for name in here | there
            if here.get(name) != there.get(name)
        ]
        raise StudyError(f"a worker has other versions: {', '.join(unlike)}; install the same")


def compute_block(block, job):
    """Solve a block and write its shard.

    Returns
    -------
    Done
    """
    if job.limit is None:
        return _solve(block, job)
    try:
        return call(_solve, block, job, limit=job.limit)
    except Lost:
        return _solve(block, job, partial(_alone, job.limit, block.points))


def _solve(block, job, within=here):
    start = time.perf_counter()
    if isinstance(block, Gaps):
        rows, failed = find_events(block, job.task.names, within)
        write = partial(write_events_shard, job.folder, job.identity, block, rows, failed)
    else:
        names, arrays, failures = evaluate(block, job.task, within)
        failed = [_name(block, names, failure) for failure in failures]
        write = partial(
            write_shard, job.folder, job.identity, block, job.task.outputs, job.tile, names, arrays, failures
        )
    seconds = time.perf_counter() - start
    if failed and job.raises:
        raise FailedPoints(f"{failed[0]}; what is computed is kept in {job.folder}")
    return Done(block.points, write(seconds), len(failed), tuple(failed[:NAMED]))


def _alone(limit, points, solver, *arguments):
    """Let a solver work in a process of its own, for its share of the time."""
    *_, names, selected = arguments
    seconds = min(limit, max(LEAST_SECONDS, limit * max(LEAST_SHARE, selected.size / points)))
    try:
        return call(here, solver, *arguments, limit=seconds)
    except Lost:
        if len(names) > 1 or selected.size > 1:
            raise
        # A limit is meant for what hangs: a machine that is only slow must not cost the point.
        return call(here, solver, *arguments, limit=2 * seconds)


def _name(block, names, failure):
    """Where a point failed, and why, in words."""
    point = np.ravel_multi_index(failure[:3], block.shape)
    H, prescribed = (labels[point] for labels in block.labels())
    return f"{block.ends} H={H:g} {block.control}={prescribed:g} {names[failure.state]}: {failure.reason}"
