"""Run a study: let the blocks of its plan be computed, and of plans that follow from it, and join the shards.

Not here: who computes them (`session`), what the dataset is (`joining`).
"""

import shutil
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.design.plan import Plan
from studies.design.request import NUMERICS_VERSION
from studies.design.study import Study
from studies.errors import StudyError
from studies.messages import note, readable_bytes, readable_time
from studies.running.lock import sole_writer
from studies.running.output import is_done, is_settled, refuse_unwritable, settle
from studies.running.session import Policy, Session
from studies.store.datasets import open
from studies.store.joining import joined_labels, reduce, survey
from studies.store.provenance import describe
from studies.store.reuse import borrow, missing
from studies.store.shards import (
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
        plan = Plan.of(study, block_points, borrow(Path(reuse) if reuse else None, study))
        cluster = None if client is None else partial(nullcontext, client)
        compute(plan, out, Policy(workers, cluster, **policy))
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
        with Session(folder, policy) as session:
            shards = _rounds(plan, session.shards)
            if policy.part is None:
                _finish(plan, shards, out, session)
        return session.named


def join(plan, out, force_unlock=False):
    """Write the dataset from the shards that jobs with `Policy.part` have computed.

    Raises
    ------
    StudyError
        If shards are missing.
    """
    with _working_folder(plan, out, None, force_unlock) as (folder, plan):
        shards = _rounds(plan, partial(_present, folder=folder))
        with Session(folder, Policy()) as session:
            _finish(plan, shards, out, session)


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


def _finish(plan, shards, out, session):
    """Write the dataset, and only then remove the shards."""
    study = plan.study
    try:
        sources = [*plan.reuse.sources, *_sources(plan, shards)]
        surveyed = survey(sources, study.grid)
        if plan.reuse.sources:
            rest = _compute_missing(plan, surveyed.names, session)
            sources += rest
            surveyed |= survey(rest, study.grid)
        events = _find_events(plan, joined_labels(study, surveyed), session)
        reduce(study, sources, surveyed, out, describe(study) | plan.reuse.about, events, plan.tile)
    except (OSError, RuntimeError) as problem:
        free = readable_bytes(shutil.disk_usage(out.parent).free)
        raise StudyError(
            f"{out}: this cannot be written ({problem}), with {free} free there; every block is kept in "
            f"{session.folder} and the same command writes the dataset"
        ) from None
    remove_shards(session.folder, plan.identity)


def _sources(plan, shards):
    return [source_of(block, path, plan.task) for block, path in shards.items()]


def _compute_missing(plan, found, session):
    """Compute what finished datasets lack of the states found: shards."""
    names, points = missing(plan.reuse, plan.study, found)
    if not names:
        return []
    _refuse_older(plan, f"{' '.join(names)} at {points.sum():,} points")
    note(f"{' '.join(names)}: left out of the datasets used again; computed at {points.sum():,} points there")
    rest = Plan.of_rest(plan.study, names, points)
    return _sources(rest, session.shards(rest))


def _refuse_older(plan, what):
    """Nothing is computed for datasets of numerics that are not ours."""
    then = plan.reuse.about.get("numerics_version", NUMERICS_VERSION)
    if then != NUMERICS_VERSION:
        raise StudyError(
            f"these datasets are by version {then} of the numerics, which version {NUMERICS_VERSION} cannot "
            f"repeat, and to join them {what} would have to be computed; join them without --fill "
            "or compute the study anew"
        )


def _find_events(plan, names, session):
    """Shards of the transition table, if the study asks for it."""
    if not plan.study.outputs.transitions:
        return ()
    _refuse_older(plan, "their transitions")
    events = Plan.of_events(plan.study, names, plan.block_points)
    note(f"transitions of {' '.join(names)}: {readable_time(events.seconds)} of work")
    return session.shards(events).values()


def _rounds(plan, shards_of):
    """Shards of a plan and, if the study is refined, of all the plans that follow from what they hold.

    Which points follow is found again from the shards by a run that goes on.
    """
    shards = new = shards_of(plan)
    if plan.study.grid.refine is None:
        return shards
    stable = StableStates(plan.study.grid)
    for source in plan.reuse.sources:
        stable.learn(source)
    while True:
        for source in _sources(plan, new):
            stable.learn(source)
        plan = plan.next(stable.codes)
        if not plan.blocks:
            return shards
        new = shards_of(plan)
        shards = shards | new
