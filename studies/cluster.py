"""Dispatch blocks to dask workers: of this machine, or of a scheduler that somebody else started.

A few blocks are in flight for each worker and their results are let go at once, so that neither client nor
scheduler grows with the study; workers may leave and join.
"""

import signal
import time
from contextlib import ExitStack, contextmanager

from studies.blocks import compute_block, prove
from studies.errors import StudyError
from studies.sandbox import MALLOC

IN_FLIGHT = 2
"""Blocks waiting at each worker, so that none idles while a result travels."""
WAIT = 60.0
"""Seconds that a run waits for the first worker."""
COUNT_EVERY = 2.0
"""Seconds between looks at how many workers there are."""
SHORT_LOGS = {"distributed.admin.low-level-log-length": 20}
"""Clients and schedulers log the last messages; with the labels of 10,000 points each they take 0.5 GB."""
TRIES = 10
"""How often a block is given to another worker, for no fault of its own, when one leaves."""


@contextmanager
def local_cluster(workers):
    """A dask cluster of single-threaded processes on this machine, since netCDF is not thread-safe."""
    import dask
    from distributed import Client, LocalCluster

    malloc = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in MALLOC.items()}
    patience = {"distributed.comm.timeouts.connect": "60s"}
    with ExitStack() as stack:
        # Ctrl-C reaches every process of the terminal; the workers inherit that they ignore it.
        interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            # Patience for a busy machine at the start only: later it would be with workers that are gone.
            with dask.config.set({**malloc, **SHORT_LOGS, **patience}):
                cluster = stack.enter_context(
                    LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        processes=True,
                        dashboard_address="127.0.0.1:0",
                        host="127.0.0.1",
                        silence_logs=50,
                    )
                )
                client = stack.enter_context(Client(cluster))
        finally:
            signal.signal(signal.SIGINT, interrupt)
        with dask.config.set({"distributed.comm.timeouts.connect": "5s"}):
            yield client


@contextmanager
def running_cluster(address):
    """A client of a scheduler that is already there.

    Raises
    ------
    StudyError
        If no scheduler answers.
    """
    import dask
    from distributed import Client

    try:
        with dask.config.set(SHORT_LOGS):
            client = Client(address, timeout=10)
    except (OSError, ValueError) as problem:
        raise StudyError(f"--scheduler {address}: no dask scheduler answers there ({problem})") from None
    with client:
        yield client


def dispatch(client, blocks, job):
    """Results of blocks as they finish.

    Parameters
    ----------
    client : distributed.Client
    blocks : sequence of Block
    job : Job

    Yields
    ------
    Done

    Raises
    ------
    StudyError
        If the workers cannot do the job, or the scheduler is lost.
    """
    from distributed import CancelledError, as_completed
    from distributed.comm import CommClosedError
    from distributed.scheduler import KilledWorker

    _prove_workers(client, job)
    waiting = [(block, 0) for block in reversed(blocks)]
    owner, flight = {}, as_completed()
    count, counted = _count(client), time.monotonic()
    try:
        while waiting or owner:
            if time.monotonic() - counted > COUNT_EVERY:
                count, counted = _count(client), time.monotonic()
            while waiting and len(owner) < IN_FLIGHT * max(1, count):
                block, tries = waiting.pop()
                future = client.submit(compute_block, block, job, pure=False)
                owner[future] = block, tries
                flight.add(future)
            future = next(flight)
            block, tries = owner.pop(future)
            try:
                done = future.result()
            except KilledWorker:
                if tries == TRIES:
                    raise StudyError(
                        f"{TRIES} workers were lost one after the other; what is computed is kept in "
                        f"{job.folder} and the same command goes on from there"
                    ) from None
                waiting.append((block, tries + 1))
                continue
            yield done
            del future
    except (CancelledError, CommClosedError, TimeoutError) as problem:
        raise StudyError(
            f"the scheduler was lost ({type(problem).__name__}); what is computed is kept in {job.folder} "
            "and the same command goes on from there"
        ) from None


def _prove_workers(client, job):
    """Refuse to begin unless there are workers and each can do the job."""
    try:
        client.wait_for_workers(1, timeout=WAIT)
    except TimeoutError:
        raise StudyError(f"the scheduler has had no worker for {WAIT:g} s; start some") from None
    for address, answer in client.run(prove, job, on_error="return").items():
        if isinstance(answer, Exception):
            raise StudyError(f"worker {address}: {answer}")


def _count(client):
    """Workers there are now."""
    return len(client.scheduler_info(n_workers=-1)["workers"])
