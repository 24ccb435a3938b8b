"""Subcommands that answer about one point or one state: solve, states, transitions."""

import json
import math
import warnings
from contextlib import contextmanager

import click

from studies.command_line.group import main
from studies.command_line.options import JSON

ENDS = click.option(
    "--ends",
    default="clamped-clamped",
    show_default=True,
    metavar="A-B|A/B",
    help="Each end clamped, pinned or a spring constant k*L/(4π²EI).",
)
LOAD = click.option("--P", "P", type=float, help="Thrust P*L²/(4π²EI).")
SHORTENING = click.option("--shortening", type=float, help="Approach of the ends ΔL*/L, instead of --P.")


def _point(P, shortening, H):
    """What is prescribed at a point, by name."""
    from studies.errors import StudyError

    if (P is None) == (shortening is None):
        raise StudyError("give either --P or --shortening: one is prescribed, the other follows")
    if H is None:
        raise StudyError("--H is missing; give a half gap, such as --H 0.1")
    return {"P": P, "shortening": shortening, "H": H}


def _profile(text):
    """The numbers of a stiffness profile."""
    from studies.errors import StudyError

    try:
        return [float(number) for number in text.split(",")]
    except ValueError:
        raise StudyError(f"--stiffness {text}: give numbers with commas between, such as 1,0.5,1") from None


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
    chain = {"links": links, "clamp": clamp, "stiffness": stiffness and _profile(stiffness)}
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
    from elastica.codes import Event
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
