"""The `elastica` command. Each subcommand imports what it needs, so that `elastica solve` answers at once."""

import json
import math
import os
import signal
import sys
import warnings
from contextlib import contextmanager
from pathlib import Path

import click

BAD_INPUT = 2
FAILED_POINTS = 3
INTERRUPTED = 130


class Group(click.Group):
    """Report bad input as one sentence with exit status 2."""

    def invoke(self, ctx):
        """Run a subcommand."""
        from studies.errors import FailedPoints, StudyError

        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise
        except FailedPoints as problem:
            raise _refused(problem, FAILED_POINTS) from None
        except StudyError as problem:
            raise _refused(problem) from None
        except OSError as problem:
            where = f"{problem.filename}: " if problem.filename else ""
            raise _refused(f"{where}{problem.strerror or problem}") from None


def _refused(problem, status=BAD_INPUT):
    error = click.ClickException(str(problem))
    error.exit_code = status
    return error


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="constrained-elastica", prog_name="elastica")
def main():
    """Equilibria and stability of an elastic strip pushed between two walls."""


STUDY = click.argument("study", type=click.Path(path_type=Path), metavar="STUDY.toml")
FILE = click.argument("file", type=click.Path(path_type=Path), metavar="FILE.nc")


OUTPUT = click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Default: <study name>.nc here."
)
FORCE = click.option(
    "--force-unlock", is_flag=True, help="Take over from a run on another host, which has ended."
)


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
@click.option("--workers", type=click.IntRange(min=0), help="Worker processes; 0 computes in this one.")
@click.option("--scheduler", metavar="ADDRESS", help="A running dask scheduler, such as tcp://host:8786.")
@click.option("--shard", type=Part(), help="Compute part i of n only; `reduce` joins the parts.")
@click.option(
    "--on-error",
    type=click.Choice(["record", "raise"]),
    default="record",
    show_default=True,
    help="Record a point that fails and go on, or stop there.",
)
@click.option("--max-failures", type=click.IntRange(min=0), help="Stop when more states fail.")
@click.option(
    "--reuse", type=click.Path(path_type=Path), metavar="OTHER.nc", help="Take the points that are there."
)
@click.option("--time-limit", type=click.FloatRange(min=0, min_open=True), help="Seconds for a block.")
@FORCE
@click.pass_context
def run(
    ctx,
    study,
    output,
    workers,
    scheduler,
    shard,
    on_error,
    max_failures,
    reuse,
    time_limit,
    force_unlock,
):
    """Compute a study and write its dataset."""
    from studies.cluster import running_cluster
    from studies.errors import StudyError
    from studies.merging import lend
    from studies.plan import Plan
    from studies.runner import Policy, compute, folder_of, is_done
    from studies.study import Study

    study = Study.from_toml(study)
    output = output or Path(f"{study.name}.nc")
    if is_done(study, output) and not folder_of(output).exists():
        click.echo(f"{output}: this study is done; nothing to compute")
        _summarise(ctx, output)
        return
    if scheduler and workers is not None:
        raise StudyError("--workers and --scheduler: a running scheduler has its own workers; give one")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(INTERRUPTED))
    try:
        client = ctx.with_resource(running_cluster(scheduler)) if scheduler else None
        policy = Policy(workers, client, shard, on_error == "raise", max_failures, time_limit, force_unlock)
        known = lend(reuse, study) if reuse else None
        failed = compute(Plan.of(study, known=known), output, policy)
    except (KeyboardInterrupt, SystemExit):
        click.echo(
            f"stopped; what is computed is kept in {folder_of(output)} and the same command "
            "goes on from there",
            err=True,
        )
        sys.exit(INTERRUPTED)
    for line in failed:
        click.echo(f"failed: {line}", err=True)
    if output.exists():
        _summarise(ctx, output)
    else:
        click.echo("part {} of {} is done; `elastica reduce` joins the parts".format(*shard))
        ctx.exit(FAILED_POINTS if failed else 0)


@main.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="A.nc B.nc …")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True)
@click.pass_context
def merge(ctx, files, output):
    """Join datasets of the same numerics along ends, H, what is prescribed, and states."""
    from studies.errors import StudyError
    from studies.merging import merge as merge_files

    if output.exists():
        raise StudyError(f"{output}: this exists; choose another output or move it away")
    if not output.parent.is_dir() or not os.access(output.parent, os.W_OK):
        raise StudyError(f"{output.parent}: this folder does not exist or cannot be written to")
    merge_files(files, output)
    _summarise(ctx, output)


@main.command()
@STUDY
@OUTPUT
@FORCE
@click.pass_context
def reduce(ctx, study, output, force_unlock):
    """Join the parts that jobs with --shard have computed."""
    from studies.plan import Plan
    from studies.runner import is_done, join
    from studies.study import Study

    study = Study.from_toml(study)
    output = output or Path(f"{study.name}.nc")
    if not is_done(study, output):
        join(Plan.of(study), output, force_unlock)
    _summarise(ctx, output)


def _summarise(ctx, output):
    """Say what a dataset holds; exit status 3 if states failed."""
    import numpy as np

    from elastica.codes import Stability, Status
    from studies.files import opened

    with opened(output) as dataset:
        status, stability = (dataset.variables[name][:] for name in ("status", "stability"))
    counts = {code: int((status == code).sum()) for code in Status}
    stable = int((stability == Stability.STABLE).sum())
    click.echo(
        f"{output}: {int(np.prod(status.shape[:3])):,} grid points, "
        f"{counts[Status.SOLVED]:,} states solved ({stable:,} stable), "
        f"{counts[Status.INADMISSIBLE]:,} inadmissible, {counts[Status.FAILED]:,} failed"
    )
    if counts[Status.FAILED]:
        click.echo("the points that failed, with reasons, are in the failure table", err=True)
        ctx.exit(FAILED_POINTS)


@main.command()
@STUDY
@click.option("--workers", type=click.IntRange(min=1), help="Default: all processors.")
def plan(study, workers):
    """Say what a run would compute, how large and how long; solve nothing."""
    from studies.plan import Plan
    from studies.runner import processors
    from studies.study import Study

    for line in Plan.of(Study.from_toml(study)).report(workers or processors()):
        click.echo(line)


ENDS = click.option(
    "--ends",
    default="clamped-clamped",
    show_default=True,
    metavar="A-B|A/B",
    help="Each end clamped, pinned or a spring constant k*L/(4π²EI).",
)
LOAD = click.option("--P", "P", type=float, help="Thrust P*L²/(4π²EI).")
SHORTENING = click.option("--shortening", type=float, help="Approach of the ends ΔL*/L, instead of --P.")
JSON = click.option("--json", "as_json", is_flag=True, help="Machine-readable output.")


def _point(P, shortening, H):
    """What is prescribed at a point, by name."""
    from studies.errors import StudyError

    if (P is None) == (shortening is None):
        raise StudyError("give either --P or --shortening: one is prescribed, the other follows")
    if H is None:
        raise StudyError("--H is missing; give a half gap, such as --H 0.1")
    return {"P": P, "shortening": shortening, "H": H}


@contextmanager
def _mechanics():
    """What the user asked of `elastica` is input: its refusal is one sentence."""
    from studies.errors import StudyError

    try:
        yield
    except ValueError as problem:
        raise StudyError(str(problem)) from None


@main.command()
@click.option("--state", required=True, help="Name such as 0, B1, U, Ua, U-, UD:2.")
@ENDS
@LOAD
@SHORTENING
@click.option("--H", "H", type=float, required=True, help="Half gap H*/L.")
@click.option("--eigenvalues", type=click.IntRange(min=0, max=100), default=4, show_default=True)
@JSON
@click.option("--method", type=click.Choice(["exact", "chain"]), default="exact", show_default=True)
@click.option("--links", type=int, help="Links of the chain.  [default: 400]")
@click.option("--clamp", type=click.Choice(["consistent", "published"]), help="Setting of the chain.")
@click.option(
    "--stiffness", metavar="EI,EI,…", help="Stiffness of the chain, equidistant along it, such as 1,0.5,1."
)
def solve(state, ends, P, shortening, H, eigenvalues, as_json, method, links, clamp, stiffness):
    """Solve one state at one point."""
    from elastica.codes import Stability, Status
    from elastica.solution import solve as solve_state
    from studies.errors import StudyError

    point = _point(P, shortening, H)
    chain = {"links": links, "clamp": clamp, "stiffness": stiffness and stiffness.split(",")}
    chain = {name: value for name, value in chain.items() if value is not None}
    with _mechanics(), warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always", UserWarning)
        solution = solve_state(state, ends=ends, method=method, **chain, **point)
    for doubt in doubts:
        click.echo(f"Warning: {doubt.message}", err=True)
    if solution.reasons:
        raise StudyError(solution.reasons[0])
    fields = (
        "curvature energy bending_energy shortening flat_length max_slope clearance reaction "
        "contact_position lam lengths error"
    )
    answer = {
        "state": solution.state.name,
        "ends": str(solution.ends),
        "control": solution.control,
        "P": float(solution.P),
        "H": H,
        "status": Status(int(solution.status)).name.lower(),
        "stability": Stability(int(solution.stability)).name.lower(),
        "index": int(solution.index),
        "nullity": int(solution.nullity),
        **{name: getattr(solution, name).tolist() for name in fields.split()},
    }
    if solution.periods.any():
        answer["periods"] = solution.periods.tolist()
    if eigenvalues:
        answer["eigenvalues"] = solution.eigenvalues(eigenvalues).tolist()
    if as_json:
        click.echo(json.dumps(_without_nan(answer)))
        return
    for name, value in answer.items():
        values = value if isinstance(value, list) else [value]
        if values and all(v != v for v in values):
            continue
        text = " ".join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
        if text:
            click.echo(f"{name:<17} {text}")


@main.command()
@ENDS
@click.option("--max-contacts", type=int, default=3, show_default=True, help="From 0 to 10.")
@LOAD
@SHORTENING
@click.option("--H", "H", type=float, help="Half gap H*/L.")
@JSON
def states(ends, max_contacts, P, shortening, H, as_json):
    """List the names of states; with --H and --P or --shortening, the equilibria there."""
    from elastica.catalogue import COLUMNS, find_states
    from elastica.codes import Stability, Status
    from elastica.states import states as names_of_states
    from studies.errors import StudyError

    if P is None and shortening is None and H is None:
        with _mechanics():
            names = names_of_states(ends, max_contacts)
        click.echo(json.dumps(names) if as_json else "\n".join(names))
        return
    point = _point(P, shortening, H)
    with _mechanics():
        found = find_states(ends=ends, max_contacts=max_contacts, **point)
    if found.reasons:
        raise StudyError(found.reasons[0])
    if not as_json:
        click.echo(str(found))
        return
    rows = [
        {"state": str(found.state[row]), **{name: getattr(found, name)[row].tolist() for name in COLUMNS}}
        for row in range(len(found))
    ]
    for row in rows:
        row["stability"] = Stability(row["stability"]).name.lower()
        row["status"] = Status(row["status"]).name.lower()
    click.echo(json.dumps(_without_nan(rows)))


@main.command()
@click.option("--state", required=True, help="Name such as U, Ua, U-, UD.")
@ENDS
@click.option("--H", "H", type=float, multiple=True, required=True, help="Half gap H*/L; may be repeated.")
@click.option("--control", type=click.Choice(["P", "shortening"]), default="P", show_default=True)
@click.option("--P-max", "P_max", type=float, default=12.0, show_default=True, help="Events up to this load.")
@JSON
def transitions(state, ends, H, control, P_max, as_json):
    """List where a state begins and ends, and where its stability changes."""
    from elastica.transitions import Event
    from elastica.transitions import transitions as events_of

    with _mechanics():
        events = events_of(state, H, ends, control, P_max)
    if not as_json:
        click.echo(str(events) if len(events) else f"{state}: no event up to P = {P_max:g}")
        return
    columns = ["H", "P", "shortening", "state", "other_state", "event", "index_before", "index_after"]
    rows = [{name: getattr(events, name)[row].tolist() for name in columns} for row in range(len(events))]
    click.echo(json.dumps([row | {"event": Event(row["event"]).name.lower()} for row in rows]))


def _without_nan(value):
    """JSON has neither NaN nor infinity: what does not exist or is not known is null."""
    if isinstance(value, dict):
        return {name: _without_nan(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@main.command()
@FILE
@click.option(
    "--sample",
    type=click.IntRange(min=0),
    default=200,
    show_default=True,
    help="Grid points to solve again.",
)
def check(file, sample):
    """Verify a dataset and say what is in it."""
    from studies.checking import check as check_file

    report, problems = check_file(file, sample)
    for line in report:
        click.echo(line)
    for problem in problems:
        click.echo(f"problem: {problem}", err=True)
    if problems:
        sys.exit(BAD_INPUT)
    click.echo("  good")


@main.command()
@FILE
@click.option("--kind", type=click.Choice(["chart"]), default="chart", show_default=True)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="PNG, PDF or SVG; default: beside the file.",
)
def plot(file, kind, output):
    """Draw a dataset."""
    from studies.charts import save_chart
    from studies.errors import StudyError
    from studies.files import identify
    from studies.files import open as open_dataset

    output = output or file.with_suffix(".png")
    if output.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise StudyError(f"{output}: the ending decides the format; use .png, .pdf or .svg")
    if not output.parent.is_dir() or not os.access(output.parent, os.W_OK):
        raise StudyError(f"{output.parent}: this folder does not exist or cannot be written to")
    identify(file, read=("status", "stability"))
    with open_dataset(file) as dataset:
        save_chart(dataset, output)
    click.echo(f"{output}")


@main.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=".", help="Folder of the report.")
@click.option("--quick", is_flag=True, help="Fewer settings and repeats: less than a minute.")
@click.option("--method", "names", multiple=True, help="Only this method; may be repeated. Default: all.")
def accuracy(output, quick, names):
    """Measure speed against error of every method here, beside SciPy, IPOPT and dense algebra."""
    from studies.accuracy.files import Folder
    from studies.accuracy.measure import QUICK_ROUNDS, ROUNDS, methods, rounds

    folder = Folder.checked(output)
    chosen, skipped = methods(names, quick)
    for line in skipped:
        click.echo(line, err=True)
    count, done = QUICK_ROUNDS if quick else ROUNDS, 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(INTERRUPTED))
    try:
        for seconds, error in rounds(chosen, count):
            folder.keep(chosen, seconds, error)
            done += 1
            click.echo(f"round {done} of {count}", err=True)
        if not names:
            folder.add_floor(quick)
    except (KeyboardInterrupt, SystemExit):
        if done:
            folder.finish()
        click.echo(f"stopped; {done} of {count} rounds are kept in {output}", err=True)
        sys.exit(INTERRUPTED)
    click.echo(folder.finish(), nl=False)
