"""Run a study: compute the blocks of its plan wherever there are processors, then join the shards.

Executors only dispatch. A block is solved the same way in this process, in a local worker or on a cluster,
and written by whoever computed it; what comes back is two numbers.
"""

import os
import signal
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path

from studies.errors import StudyError
from studies.files import identify, open
from studies.plan import Plan
from studies.progress import progress
from studies.shards import compute_shard, folder_of, reduce, remove_shards, shard_is_valid, shard_path

IN_FLIGHT = 2
"""Blocks waiting at each worker, so that none idles while a result travels."""


def run(study, out=None, workers=None, client=None, block_points=None):
    """Compute a study and return its dataset.

    Parameters
    ----------
    study : Study
    out : str or Path, optional
        The file to write, by default `<study name>.nc` in the current folder.
    workers : int, optional
        Worker processes on this machine; 0 computes in this process. By default as many as there are
        processors, none when the whole study takes but seconds.
    client : distributed.Client, optional
        A running cluster to use instead.
    block_points : int, optional
        Grid points of a block. Neither this nor the workers ever change a value.

    Returns
    -------
    xarray.Dataset
        Opened lazily from the file. A finished file of the same study is opened as it is.

    Raises
    ------
    StudyError
        If the file cannot be written or holds another study.
    """
    out = Path(out or f"{study.name}.nc")
    if not is_done(study, out):
        compute(Plan.of(study, block_points), out, workers, client)
    return open(out)


def is_done(study, out):
    """Whether `out` already holds this study.

    Raises
    ------
    StudyError
        If something else is there, or nothing can be written there.
    """
    out = Path(out)
    folder = out.parent
    if not folder.is_dir():
        raise StudyError(f"{folder}: there is no such folder; create it or choose another output")
    if out.is_dir():
        raise StudyError(f"{out}: this is a folder; name a file")
    if out.exists():
        found = identify(out)
        if found["study_id"] == study.study_id:
            if found.get("numerics_id") == study.numerics_id:
                return True
            raise StudyError(
                f"{out}: this holds the same study by another version of the numerics; choose another "
                "output or move it away"
            )
        raise StudyError(f"{out}: this holds another study; choose another output or move it away")
    if not os.access(folder, os.W_OK):
        raise StudyError(f"{folder}: this folder cannot be written to; choose another output")
    return False


def compute(plan, out, workers=None, client=None):
    """Compute the blocks that are missing, write the dataset, remove the shards."""
    folder = folder_of(out)
    folder.mkdir(exist_ok=True)
    identity = plan.study.identity
    todo = [b for b in plan.blocks if not shard_is_valid(shard_path(folder, b), identity)]
    finished = plan.points - sum(block.points for block in todo)
    common = (plan.task, identity, folder.resolve())
    with ExitStack() as stack:
        if client is None and workers is None and (plan.small or len(todo) == 1):
            workers = 0
        if client is None and workers != 0 and todo:
            count = min(workers or processors(), len(todo))
            client = stack.enter_context(local_cluster(count))
        results = _dispatch(client, todo, common) if client and todo else _here(todo, common)
        advance = stack.enter_context(progress(plan.points, finished))
        for points, _ in results:
            advance(points)
    reduce(plan, folder, out)
    remove_shards(plan, folder)


def processors():
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


@contextmanager
def local_cluster(workers):
    """A dask cluster of single-threaded processes on this machine, since netCDF is not thread-safe."""
    import dask
    from distributed import Client, LocalCluster

    settings = {
        # dask returns freed memory at 64 kB, which costs a third of the time in page faults.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 28,
        "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 1 << 28,
        "distributed.comm.timeouts.connect": "60s",
    }
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(settings))
        # Ctrl-C reaches every process of the terminal; the workers inherit that they ignore it.
        interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    host="127.0.0.1",
                    silence_logs=40,
                )
            )
        finally:
            signal.signal(signal.SIGINT, interrupt)
        yield stack.enter_context(Client(cluster))


def _here(blocks, common):
    return (compute_shard(block, *common) for block in blocks)


def _dispatch(client, blocks, common):
    """Results of blocks as they finish, a few in flight for each worker."""
    from distributed import as_completed

    waiting = iter(blocks)
    workers = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))

    def submit(block):
        return client.submit(compute_shard, block, *common, pure=False)

    first = [submit(block) for block in islice(waiting, IN_FLIGHT * workers)]
    running = as_completed(first)
    for future in running:
        yield future.result()
        future.release()
        block = next(waiting, None)
        if block is not None:
            running.add(submit(block))
