"""Run a study: compute the blocks of its plan wherever there are processors, then join the shards.

Executors only dispatch. A block is solved the same way in this process, in a local worker or on a cluster,
and written by whoever computed it; what comes back is its name.
"""

import shutil
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from studies.design.plan import Plan
from studies.design.request import NUMERICS_VERSION
from studies.design.study import Study
from studies.errors import FailedPoints, StudyError
from studies.messages import note, readable_bytes, readable_time
from studies.progress import progress
from studies.running.dispatch import dispatch
from studies.running.lock import sole_writer
from studies.running.output import is_done, is_settled, refuse_unwritable, settle
from studies.running.threads import local_workers, processors
from studies.running.worker import NAMED, Job, compute_block, versions
from studies.store.datasets import open
from studies.store.joining import joined_labels, reduce, survey
from studies.store.provenance import describe
from studies.store.reuse import borrow, missing
from studies.store.shards import (
    PROBE,
    discard_parts,
    find_shards,
    make_folder,
    remove_folder,
    remove_shards,
    tell_of_others,
)
from studies.store.sources import StableStates, source_of
from studies.whole_files import discard_temporaries

if TYPE_CHECKING:
    from distributed import Client
    from xarray import Dataset

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


@dataclass
class Tally:
    """Failures of a run: how many, and some of them by name."""

    count: int = 0
    named: tuple[str, ...] = ()


def run(
    study: Study,
    out: str | Path | None = None,
    workers: int | None = None,
    client: "Client | None" = None,
    block_points: int | None = None,
    reuse: str | Path | None = None,
    **policy: Any,
) -> "Dataset":
    """Compute a study and return its dataset.

    Parameters
    ----------
    study : Study
    out : str or Path, optional
        The file to write, by default `<study name>.nc` in the current folder.
    workers, **policy
        See `Policy`.
    client : distributed.Client, optional
        A running cluster to use instead of workers.
    block_points : int, optional
        Grid points of a block. Neither this nor the workers ever change a value.
    reuse : str or Path, optional
        A dataset of the same numerics; points that it has are not computed again.

    Returns
    -------
    xarray.Dataset
        Opened lazily from the file. A finished file of the same study is opened as it is; if only the name
        or the texts of the study are others, it gets these.

    Raises
    ------
    StudyError
        If the file cannot be written or holds another study.
    """
    out = Path(out or f"{study.name}.nc")
    if not is_settled(study, out):
        borrowed = borrow(Path(reuse), study) if reuse else None
        cluster = None if client is None else partial(nullcontext, client)
        compute(Plan.of(study, block_points, borrowed), out, Policy(workers, cluster, **policy))
    return open(out)


def compute(plan, out, policy=Policy()):  # noqa: B008 (it is immutable)
    """Compute the blocks that are missing; unless they are but a part, write the dataset.

    Parameters
    ----------
    plan : Plan
    out : Path
    policy : Policy

    Returns
    -------
    tuple of str
        Some of the points that failed in this run, with the reasons.
    """
    if policy.part is not None and plan.study.grid.refine is not None:
        raise StudyError(
            f"--shard {'/'.join(map(str, policy.part))}: which points a refined study needs is known only as "
            "it goes; run it without --shard, on a cluster if it is large"
        )
    with _working_folder(plan, out, policy.part, policy.force_unlock) as (folder, plan):
        if is_done(plan.study, out):
            # Perhaps by a run that was killed before it could clear away.
            remove_shards(folder, plan.identity)
            if policy.part is None:
                settle(plan.study, out)
            return ()
        with _filling(folder, policy) as (fill, tally):
            shards = _rounds(plan, fill)
            if policy.part is None:
                _finish(plan, shards, folder, out, fill)
        return tally.named


def join(plan, out, force_unlock=False):
    """Write the dataset from the shards that jobs with `Policy.part` have computed.

    Raises
    ------
    StudyError
        If shards are missing.
    """
    with _working_folder(plan, out, None, force_unlock) as (folder, plan):
        shards = _rounds(plan, partial(_present, folder=folder))
        with _filling(folder, Policy()) as (fill, _):
            _finish(plan, shards, folder, out, fill)


def _present(plan, folder):
    """The shards of a plan, all of which must be there."""
    shards = find_shards(folder, plan.blocks, plan.identity)
    if missing := len(plan.blocks) - len(shards):
        raise StudyError(
            f"{folder}: {missing} of {len(plan.blocks)} shards are missing; run the jobs that have not "
            "finished again, or `elastica run` for all that is missing"
        )
    return shards


@contextmanager
def _working_folder(plan, out, part, force_unlock):
    """The folder of the shards, ours alone, and the plan of what is to be computed there."""
    refuse_unwritable(out)
    folder = make_folder(out)
    own = None
    if part is not None:
        # Others may be writing the shards of theirs.
        own = plan.blocks[part[0] - 1 :: part[1]]
        plan = replace(plan, blocks=own)
    try:
        with sole_writer(folder, part, force_unlock):
            if part is None:
                discard_temporaries(out)
            discard_parts(folder, own)
            tell_of_others(folder, plan.identity)
            try:
                yield folder, plan
            finally:
                discard_parts(folder, own)
    finally:
        remove_folder(folder)


def _finish(plan, shards, folder, out, fill):
    """Write the dataset, and only then remove the shards; `fill` gives those of a plan."""
    study = plan.study
    try:
        sources = [*(plan.reuse.sources if plan.reuse else ()), *_sources(plan, shards)]
        surveyed = survey(sources, study.grid)
        if plan.reuse:
            rest = _compute_missing(plan, surveyed.names, fill)
            sources += rest
            surveyed |= survey(rest, study.grid)
        about = plan.reuse.about if plan.reuse else {}
        events = _find_events(plan, joined_labels(study, surveyed), fill)
        reduce(study, sources, surveyed, out, describe(study) | about, events)
    except (OSError, RuntimeError) as problem:
        free = readable_bytes(shutil.disk_usage(out.parent).free)
        raise StudyError(
            f"{out}: this cannot be written ({problem}), with {free} free there; every block is kept in "
            f"{folder} and the same command writes the dataset"
        ) from None
    remove_shards(folder, plan.identity)


def _sources(plan, shards):
    return [source_of(block, path, plan.task) for block, path in shards.items()]


def _compute_missing(plan, found, fill):
    """Compute what finished datasets lack of the states found: shards."""
    names, points = missing(plan.reuse, plan.study, found)
    if not names:
        return []
    _refuse_older(plan, f"{' '.join(names)} at {points.sum():,} points")
    note(f"{' '.join(names)}: left out of the datasets used again; computed at {points.sum():,} points there")
    rest = Plan.of_rest(plan.study, names, points)
    return _sources(rest, fill(rest))


def _refuse_older(plan, what):
    """Nothing is computed for datasets of numerics that are not ours."""
    then = plan.reuse.about.get("numerics_version", NUMERICS_VERSION) if plan.reuse else NUMERICS_VERSION
    if then != NUMERICS_VERSION:
        raise StudyError(
            f"these datasets are by version {then} of the numerics, which version {NUMERICS_VERSION} cannot "
            f"repeat, and to join them {what} would have to be computed; join them without --fill "
            "or compute the study anew"
        )


def _find_events(plan, names, fill):
    """Shards of the transition table, if the study asks for it."""
    if not plan.study.outputs.transitions:
        return ()
    _refuse_older(plan, "their transitions")
    events = Plan.of_events(plan.study, names, plan.block_points)
    note(f"transitions of {' '.join(names)}: {readable_time(events.seconds)} of work")
    return fill(events).values()


def _rounds(plan, fill):
    """Shards of a plan and, if the study is refined, of all the plans that follow from what they hold.

    `fill` gives those of one plan. Which points follow is found again from the shards by a run that goes on.
    """
    shards = new = fill(plan)
    if plan.study.grid.refine is None:
        return shards
    stable = StableStates(plan.study.grid)
    for source in plan.reuse.sources if plan.reuse else ():
        stable.learn(source)
    while True:
        for source in _sources(plan, new):
            stable.learn(source)
        plan = plan.next(stable.codes)
        if not plan.blocks:
            return shards
        new = fill(plan)
        shards = shards | new


@contextmanager
def _filling(folder, policy):
    """A function that gives the shards of a plan, whose workers are started once; and its failures."""
    with ExitStack() as stack:
        started, tally = [], Tally()

        def workers(count):
            if not started:
                if policy.cluster:
                    client = stack.enter_context(policy.cluster())
                    probe = stack.enter_context(_probe(folder))
                    started.append(lambda blocks, job: dispatch(client, blocks, job._replace(probe=probe)))
                else:
                    started.append(stack.enter_context(local_workers(count)))
            return started[0]

        yield partial(_fill, folder=folder, policy=policy, tally=tally, workers=workers), tally


def _fill(plan, folder, policy, tally, workers):
    """Compute until every block has an intact shard: the shards."""
    for _ in range(ROUNDS):
        shards = find_shards(folder, plan.blocks, plan.identity)
        todo = [block for block in plan.blocks if block not in shards]
        if not todo:
            return shards
        _compute(plan, todo, folder, policy, tally, workers)
    raise StudyError(f"{folder}: shards are damaged as soon as they are written; look after the disk")


def _compute(plan, todo, folder, policy, tally, workers):
    """Compute blocks."""
    results = _results(plan, todo, folder, policy, workers)
    points, left = (sum(block.points for block in some) for some in (plan.blocks, todo))
    with progress(points, points - left) as advance:
        for done in _kept(results, folder):
            advance(done.points)
            tally.count += done.failures
            tally.named = (*tally.named, *done.named)[:NAMED]
            if policy.max_failures is not None and tally.count > policy.max_failures:
                raise FailedPoints(
                    f"{tally.count} states failed, more than --max-failures {policy.max_failures}: "
                    f"{'; '.join(tally.named)}; what is computed is kept in {folder}"
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


def _results(plan, todo, folder, policy, workers):
    """What the blocks gave, as they finish; `workers` starts so many of them."""
    limit = policy.time_limit or max(LEAST_LIMIT, PATIENCE * plan.longest)
    job = Job(plan.task, plan.identity, folder, versions(), "", limit, policy.raises)
    count = min(processors() if policy.workers is None else policy.workers, len(todo))
    if policy.cluster is None:
        if policy.workers == 0:
            job = job._replace(limit=None)
        # One helper needs no thread to wait for it.
        if count <= 1 or (policy.workers is None and plan.small):
            return (compute_block(block, job) for block in todo)
    if plan.study.grid.refine is not None:
        # Of a refined study nobody knows how many blocks are to come.
        count = policy.workers or processors()
    return workers(count)(todo, job)


@contextmanager
def _probe(folder):
    """Name of a file by which workers prove that they see the folder."""
    path = folder / f"{PROBE}{uuid.uuid4().hex}"
    path.touch()
    try:
        yield path.name
    finally:
        path.unlink(missing_ok=True)
