"""Subcommands that compute a study: run, plan, reduce, merge."""

import signal
import sys
from functools import partial
from pathlib import Path

import click

from studies.command_line.group import FAILED_POINTS, INTERRUPTED, main, say
from studies.command_line.options import FORCE, OUTPUT, REUSE, STUDY, Address, Choice, Output, Whole
from studies.running.cluster import QUEUES


class Part(click.ParamType):
    """Part i of n, written i/n."""

    name = "i/n"

    def convert(self, value, param, ctx):
        """Two numbers from a text."""
        i, slash, n = value.partition("/")
        if not (slash and i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
            self.fail(f"{value!r} is no part; write i/n with 1 <= i <= n, such as 1/4", param, ctx)
        return int(i), int(n)


@main.command()
@STUDY
@OUTPUT
@click.option("--workers", type=Whole(min=0), help="Worker processes; 0 computes in this one.")
@click.option(
    "--scheduler",
    type=Address(),
    metavar="ADDRESS",
    help="A running dask scheduler, such as tcp://host:8786.",
)
@click.option(
    "--cluster",
    type=Choice(list(QUEUES)),
    help="Submit --workers N as jobs, described in dask's jobqueue.yaml.",
)
@click.option("--shard", type=Part(), help="Compute part i of n only; `reduce` joins the parts.")
@click.option(
    "--on-error",
    type=Choice(["record", "raise"]),
    default="record",
    show_default=True,
    help="Record a point that fails and go on, or stop there.",
)
@click.option("--max-failures", type=Whole(min=0), help="Stop when more states fail.")
@REUSE
@click.option("--time-limit", type=click.FloatRange(min=0, min_open=True), help="Seconds for a block.")
@FORCE
@click.pass_context
def run(
    ctx,
    study,
    output,
    workers,
    scheduler,
    cluster,
    shard,
    on_error,
    max_failures,
    reuse,
    time_limit,
    force_unlock,
):
    """Compute a study and write its dataset."""
    from studies.design.plan import Plan
    from studies.design.study import Study
    from studies.errors import StudyError
    from studies.messages import note
    from studies.running.cluster import queued_cluster, running_cluster
    from studies.running.output import is_settled
    from studies.running.runner import compute
    from studies.running.session import Policy
    from studies.store.reuse import borrow
    from studies.store.shards import folder_of

    study = Study.from_toml(study)
    output = output or Path(f"{study.name}.nc")
    if is_settled(study, output):
        click.echo(f"{output}: this study is done; nothing to compute")
        _summarise(ctx, output)
        return
    if scheduler and (cluster or workers is not None):
        raise StudyError("--scheduler: it has its own workers; leave --workers and --cluster out")
    if cluster and not workers:
        raise StudyError(f"--cluster {cluster}: say how many workers to ask for, such as --workers 40")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(INTERRUPTED))
    # A run goes on when its terminal is closed.
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        connect = None
        if scheduler:
            connect = partial(running_cluster, scheduler)
        if cluster:
            connect = partial(queued_cluster, cluster, workers, folder_of(output))
        policy = Policy(workers, connect, shard, on_error == "raise", max_failures, time_limit, force_unlock)
        failed = compute(Plan.of(study, reuse=borrow(reuse, study)), output, policy)
    except (KeyboardInterrupt, SystemExit):
        note(
            f"stopped; what is computed is kept in {folder_of(output)} and the same command "
            "goes on from there"
        )
        sys.exit(INTERRUPTED)
    for line in failed:
        note(f"failed: {line}")
    if output.exists():
        _summarise(ctx, output)
    else:
        click.echo("part {} of {} is done; `elastica reduce` joins the parts".format(*shard))
        ctx.exit(FAILED_POINTS if failed else 0)


@main.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="A.nc B.nc …")
@click.option("-o", "--output", type=Output(), required=True)
@click.option("--fill", is_flag=True, help="Compute states and transitions that some of the files lack.")
@click.pass_context
def merge(ctx, files, output, fill):
    """Join datasets of the same numerics along ends, H, what is prescribed, and states.

    Nothing is computed unless --fill says so: what the files lack is told, with the time it would take.
    """
    from studies.running.merging import merge as merge_files

    merge_files(files, output, fill)
    _summarise(ctx, output)


@main.command()
@STUDY
@OUTPUT
@REUSE
@FORCE
@click.pass_context
def reduce(ctx, study, output, reuse, force_unlock):
    """Join the parts that jobs with --shard have computed; with the --reuse that they had."""
    from studies.design.plan import Plan
    from studies.design.study import Study
    from studies.running.runner import is_done, join
    from studies.store.reuse import borrow

    study = Study.from_toml(study)
    output = output or Path(f"{study.name}.nc")
    if not is_done(study, output):
        join(Plan.of(study, reuse=borrow(reuse, study)), output, force_unlock)
    _summarise(ctx, output)


def _summarise(ctx, output):
    """Say what a dataset holds; exit status 3 if states failed."""
    from elastica.codes import Stability, Status
    from studies.messages import note
    from studies.schema import TRANSITIONS_FAILED
    from studies.store.files import opened

    with opened(output) as dataset:
        status, stability = (dataset.variables[name][:] for name in ("status", "stability"))
        without_events = getattr(dataset, TRANSITIONS_FAILED, "")
    points = int((status != Status.NOT_COMPUTED).any(axis=-1).sum())
    of = "" if points == status[..., 0].size else f" of {status[..., 0].size:,}"
    counts = {code: int((status == code).sum()) for code in Status}
    stable = int((stability == Stability.STABLE).sum())
    click.echo(
        f"{output}: {points:,}{of} grid points, "
        f"{counts[Status.SOLVED]:,} states solved ({stable:,} stable), "
        f"{counts[Status.INADMISSIBLE]:,} inadmissible, {counts[Status.NOT_FOLLOWED]:,} not followed, "
        f"{counts[Status.FAILED]:,} failed"
    )
    if counts[Status.FAILED]:
        note("the points that failed, with reasons, are in the failure table")
    if without_events:
        note(f"transitions that could not be found: {without_events}")
    if counts[Status.FAILED] or without_events:
        ctx.exit(FAILED_POINTS)


@main.command()
@STUDY
@click.option("--workers", type=Whole(min=1), help="Default: all processors.")
def plan(study, workers):
    """Say what a run would compute, how large and how long; solve nothing."""
    from studies.design.plan import Plan
    from studies.design.study import Study
    from studies.running.processors import processors

    for line in Plan.of(Study.from_toml(study)).report(workers or processors()):
        say(line)
