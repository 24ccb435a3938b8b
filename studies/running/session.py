"""Who computes the blocks of a run: this process, workers on this machine or a cluster, started when needed.

A block is solved the same way everywhere and written by whoever computed it; what comes back is its name.

Not here: which blocks there are and what becomes of them (`runner`), how they are dealt out (`dispatch`) and
solved (`worker`).
"""

import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from typing import NamedTuple

from studies.errors import FailedPoints, StudyError
from studies.progress import progress
from studies.running.dispatch import dispatch
from studies.running.processors import processors
from studies.running.worker import NAMED, Job, compute_block, versions
from studies.store.shards import PROBE, find_shards

LEAST_LIMIT, PATIENCE = 600.0, 30.0
"""Seconds that a block has at the least, and how often the time that is expected of it."""
ROUNDS = 3
"""How often shards that turn out to be damaged are computed again before the disk is blamed."""


class Policy(NamedTuple):
    """What a user may decide about a run; it never changes a value.

    Attributes
    ----------
    workers : int, optional
        Worker processes on this machine; 0 computes in this process, where a crash ends the run and
        nothing limits the time. By default as many as there are processors, and one when the whole
        study takes but seconds.
    cluster : callable, optional
        Gives a context manager of a dask client, to be used instead; called when the folder of the shards
        is there and locked, and only if there is something to compute.
    part : (int, int), optional
        Compute part i of n only, to be joined by `join`.
    raises : bool
        Stop at the first point that fails, instead of recording it.
    max_failures : int, optional
        Stop when more states have failed than this.
    time_limit : float, optional
        Seconds that a block may take; by default far more than it is expected to.
    force_unlock : bool
        Take the lock of a run on another host, which is known to have ended.
    """

    workers: int | None = None
    cluster: "Callable[[], AbstractContextManager] | None" = None
    part: tuple[int, int] | None = None
    raises: bool = False
    max_failures: int | None = None
    time_limit: float | None = None
    force_unlock: bool = False


class Session(ExitStack):
    """Computes plans for one run, by workers that are started at most once and end with it.

    Parameters
    ----------
    folder : Path
        Where the shards are.
    policy : Policy

    Attributes
    ----------
    failures : int
        How many states have failed.
    named : tuple of str
        Some of them, with the reasons.
    """

    def __init__(self, folder, policy):
        super().__init__()
        self.folder, self.policy = folder, policy
        self.failures, self.named = 0, ()
        self._client, self._probe = None, ""

    def shards(self, plan):
        """Compute until every block of a plan has an intact shard.

        Returns
        -------
        dict of Block to Path

        Raises
        ------
        FailedPoints
            If more fails than the policy allows.
        StudyError
            If shards cannot be written, or nobody can solve.
        """
        for _ in range(ROUNDS):
            shards = find_shards(self.folder, plan.blocks, plan.identity)
            todo = [block for block in plan.blocks if block not in shards]
            if not todo:
                return shards
            self._compute(plan, todo)
        raise StudyError(
            f"{self.folder}: shards are damaged as soon as they are written; look after the disk"
        )

    def _compute(self, plan, todo):
        results = self._results(plan, todo)
        points, left = (sum(block.points for block in some) for some in (plan.blocks, todo))
        with progress(points, points - left) as advance:
            for done in _kept(results, self.folder):
                advance(done.points)
                self._count(done)

    def _results(self, plan, todo):
        """What the blocks gave, as they finish."""
        policy = self.policy
        limit = policy.time_limit or max(LEAST_LIMIT, PATIENCE * plan.longest)
        job = Job(plan.task, plan.identity, self.folder, versions(), limit, policy.raises, tile=plan.tile)
        count = processors() if policy.workers is None else policy.workers
        small = len(todo) == 1 or (policy.workers is None and plan.small)
        if policy.cluster is None and (count <= 1 or small):
            # One helper needs no thread to wait for it.
            job = job._replace(limit=None) if policy.workers == 0 else job
            return (compute_block(block, job) for block in todo)
        # Of a refined study nobody knows how many blocks are to come.
        most = count if plan.study.grid.refine is not None else len(todo)
        client = self._workers(min(count, most))
        return dispatch(client, todo, job._replace(probe=self._probe))

    def _workers(self, count):
        """A client of the workers; on this machine of so many."""
        if self._client is None:
            start = self.policy.cluster
            if start is None:
                # To import dask takes longer than many a study.
                from studies.running.local import local_workers

                start = partial(local_workers, count)
            self._client = self.enter_context(start())
            self._probe = self.enter_context(_probe(self.folder))
        return self._client

    def _count(self, done):
        """Count the failures of a block; stop where they are too many."""
        most = self.policy.max_failures
        self.failures += done.failures
        self.named = (*self.named, *done.named)[:NAMED]
        if most is not None and self.failures > most:
            raise FailedPoints(
                f"{self.failures} states failed, more than --max-failures {most}: "
                f"{'; '.join(self.named)}; what is computed is kept in {self.folder}"
            )


def _kept(results, folder):
    """Results; a disk that takes no more shards is one sentence that says how to go on."""
    try:
        yield from results
    except OSError as problem:
        raise StudyError(
            f"{folder}: a shard cannot be written ({problem.strerror or problem}); what is computed is kept "
            "there and the same command goes on when the disk takes more"
        ) from None


@contextmanager
def _probe(folder):
    """Name of a file by which workers show that they see the folder."""
    path = folder / f"{PROBE}{uuid.uuid4().hex}"
    path.touch()
    try:
        yield path.name
    finally:
        path.unlink(missing_ok=True)
