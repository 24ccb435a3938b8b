"""Dispatch blocks to the workers of a dask client, wherever they are and whoever started them.

A few blocks are in flight for each thread and their results are let go at once, so that neither client nor
scheduler grows with the study. Workers may leave and join; who cannot do the job is not given any.

Not here: the workers (`local`, `cluster`), what they do with a block (`worker`).
"""

import time

from studies.errors import StudyError, UnfitWorker
from studies.messages import note
from studies.running.worker import check_worker, compute_block

IN_FLIGHT = 2
"""Blocks waiting for each thread of a worker, so that none idles while a result travels."""
WAIT = 60.0
"""Seconds without any worker after which the user is told."""
COUNT_EVERY = 2.0
"""Seconds between looks at how many threads there are."""
TRIES = 10
"""How often a block is given to another worker, for no fault of its own, when one leaves."""


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
    from distributed import CancelledError, Future, as_completed
    from distributed.comm import CommClosedError
    from distributed.scheduler import KilledWorker

    waiting = [(block, 0) for block in reversed(blocks)]
    owner: dict[Future, tuple] = {}
    flight = as_completed(loop=client.loop)
    try:
        _check_workers(client, job)
        threads, counted = _threads(client), time.monotonic()
        while waiting or owner:
            if time.monotonic() - counted > COUNT_EVERY:
                threads, counted = _threads(client), time.monotonic()
            while waiting and len(owner) < IN_FLIGHT * max(1, threads):
                block, tries = waiting.pop()
                future = client.submit(_compute, block, job, pure=False)
                owner[future] = block, tries
                flight.add(future)
            future = next(flight)
            block, tries = owner.pop(future)
            try:
                answer = future.result()
            except KilledWorker as problem:
                answer = problem
            del future
            if isinstance(answer, KilledWorker | UnfitWorker):
                if tries == TRIES:
                    raise StudyError(
                        f"{TRIES} workers were lost one after the other; what is computed is kept in "
                        f"{job.folder} and the same command goes on from there"
                    ) from None
                waiting.append((block, tries + 1))
                if isinstance(answer, UnfitWorker):
                    _send_away(client, answer)
            elif isinstance(answer, Exception):
                raise answer
            else:
                yield answer
    except (CancelledError, CommClosedError, TimeoutError) as problem:
        raise StudyError(
            f"the scheduler was lost ({type(problem).__name__}); what is computed is kept in {job.folder} "
            "and the same command goes on from there"
        ) from None


def _compute(block, job):
    """Solve a block at a worker, which may have joined after the others were checked.

    Exceptions are returned: those that are raised, dask also logs there.
    """
    from distributed import get_worker

    try:
        check_worker(job.folder, job.probe, job.versions)
    except StudyError as problem:
        return UnfitWorker(get_worker().address, str(problem))
    try:
        return compute_block(block, job)
    except Exception as problem:  # Whatever it is, it belongs to the client.
        return problem


def _send_away(client, unfit):
    """Part with a worker that joined in the run and cannot do the job; tell the user once."""
    address, problem = unfit.args
    if address in client.scheduler_info(n_workers=-1)["workers"]:
        client.retire_workers([address])
        note(f"worker {address} was sent away, the run goes on without it: {problem}")


def _check_workers(client, job):
    """Wait for a worker; refuse to begin unless each that is there can do the job."""
    try:
        client.wait_for_workers(1, timeout=WAIT)
    except TimeoutError:
        note(f"the scheduler has had no worker for {WAIT:g} s; start some, or wait for those in a queue")
        client.wait_for_workers(1)
    answers = client.run(check_worker, job.folder, job.probe, job.versions, on_error="return")
    for address, answer in answers.items():
        if isinstance(answer, ImportError):
            answer = f"{answer}; install the same version of constrained-elastica there"
        if answer is not None:
            raise StudyError(f"worker {address}: {answer}")


def _threads(client):
    """Blocks that can be solved at the same time now."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    return sum(worker["nthreads"] for worker in workers.values())
