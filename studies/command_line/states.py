"""Subcommands that answer about one point or one state: solve, states, transitions."""

import json
import math
import warnings
from contextlib import contextmanager
from itertools import product

import click

from studies.command_line.group import main
from studies.command_line.options import END_CONDITIONS, JSON, NUMBER, NUMBERS, STATES, Choice, Whole, several

ENDS = several(
    "--ends",
    kind=END_CONDITIONS,
    default="clamped-clamped",
    show_default=True,
    help="Each end clamped, pinned or a spring constant k*L/(4π²EI).",
)
LOAD = several("--P", "loads", kind=NUMBERS, help="Thrust P*L²/(4π²EI).")
SHORTENING = several(
    "--shortening", "shortenings", kind=NUMBERS, help="Approach of the ends ΔL*/L, instead of --P."
)
REACH = 0.5
"""A strip of length one never comes so far from the line of its ends."""


def _points(loads, shortenings, gaps):
    """What is prescribed at every point, by name."""
    from studies.errors import StudyError

    if bool(loads) == bool(shortenings):
        raise StudyError("give either --P or --shortening: one is prescribed, the other follows")
    if not gaps:
        raise StudyError("--H is missing; give a half gap, such as --H 0.1")
    for H in gaps:
        if REACH <= H < math.inf:
            _warn(
                f"H = {H:g}: such a wall is never touched; H is half the gap over the length, below {REACH:g}"
            )
    control, values = ("P", loads) if loads else ("shortening", shortenings)
    return [{control: value, "H": H} for H in gaps for value in values]


def _warn(text):
    click.echo(f"Warning: {text}", err=True)


@contextmanager
def _mechanics():
    """What the user asked of `elastica` is input: its refusal is one sentence."""
    from studies.errors import StudyError

    try:
        yield
    except ValueError as problem:
        raise StudyError(str(problem)) from None


@main.command()
@several("--state", "names", kind=STATES, required=True, help="Name such as 0, B1, U, Ua, U-, UD:2.")
@ENDS
@LOAD
@SHORTENING
@several("--H", "gaps", kind=NUMBERS, required=True, help="Half gap H*/L.")
@click.option("--eigenvalues", type=Whole(min=0, max=100), default=4, show_default=True)
@JSON
@click.option("--method", type=Choice(["exact", "chain"]), default="exact", show_default=True)
@click.option("--links", type=Whole(), help="Links of the chain.  [default: 400]")
@click.option("--clamp", type=Choice(["consistent", "published"]), help="Setting of the chain.")
@several("--stiffness", kind=NUMBERS, help="Stiffness of the chain, equidistant along it, such as 1,0.5,1.")
def solve(names, ends, loads, shortenings, gaps, eigenvalues, as_json, **method):
    """Solve states at points: each of the states, ends and points that are named.

    Prints one block a state and point, or with --json an object, a list of them if there are several.
    """
    method = {name: value for name, value in method.items() if value not in (None, ())}
    answers = [
        _answer(name, held, point, eigenvalues, method)
        for name, held, point in product(names, ends, _points(loads, shortenings, gaps))
    ]
    if as_json:
        _print_json(answers if len(answers) > 1 else answers[0])
        return
    click.echo("\n\n".join(map(_in_words, answers)))


def _answer(name, ends, point, eigenvalues, method):
    """What is known of a state at a point, by name."""
    from elastica.codes import Stability, Status
    from elastica.properties import QUANTITIES
    from elastica.solving import solve as solve_state
    from studies.errors import StudyError

    with _mechanics(), warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always", UserWarning)
        solution = solve_state(name, ends=ends, **method, **point)
    for doubt in doubts:
        _warn(doubt.message)
    if solution.reasons:
        raise StudyError(solution.reasons[0])
    if solution.status == Status.NOT_FOLLOWED:
        _warn(f"{solution.state.name} is not followed to here, mostly beyond 90 degrees; it may exist")
    answer = {
        "state": solution.state.name,
        "ends": str(solution.ends),
        "control": solution.control,
        "P": float(solution.P),
        "H": point["H"],
        "status": Status(int(solution.status)),
        "stability": Stability(int(solution.stability)),
        "index": int(solution.index),
        "nullity": int(solution.nullity),
    }
    numbers = [name for name, each in QUANTITIES.items() if each.dtype == "f8" and name not in answer]
    numbers.remove("error")
    answer |= {name: getattr(solution, name).tolist() for name in (*numbers, "lam", "lengths", "error")}
    if solution.periods.any():
        answer["periods"] = solution.periods.tolist()
    if eigenvalues:
        answer["eigenvalues"] = solution.eigenvalues(eigenvalues).tolist()
    return answer


def _in_words(answer):
    """An answer as lines, without what does not exist."""
    lines = []
    for name, value in answer.items():
        values = value if isinstance(value, list) else [value]
        if values and not all(v != v for v in values):
            text = " ".join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
            lines.append(f"{name:<17} {text}")
    return "\n".join(lines)


@main.command()
@ENDS
@click.option("--max-contacts", type=Whole(), default=3, show_default=True, help="From 0 to 10.")
@LOAD
@SHORTENING
@several("--H", "gaps", kind=NUMBERS, help="Half gap H*/L.")
@JSON
def states(ends, max_contacts, loads, shortenings, gaps, as_json):
    """List the names of states; with --H and --P or --shortening, the equilibria there."""
    from elastica.finding import find_states
    from elastica.state import states as names_of_states
    from studies.errors import StudyError

    if not (loads or shortenings or gaps):
        with _mechanics():
            names = [name for held in ends for name in names_of_states(held, max_contacts)]
        names = list(dict.fromkeys(names))
        click.echo(json.dumps(names) if as_json else "\n".join(names))
        return
    rows: list[dict] = []
    tables = []
    asked = list(product(ends, _points(loads, shortenings, gaps)))
    for held, point in asked:
        with _mechanics():
            found = find_states(ends=held, max_contacts=max_contacts, **point)
        if found.reasons:
            raise StudyError(found.reasons[0])
        rows += _rows(found, held) if as_json else []
        tables.append(_headed(str(found), held, len(ends) > 1))
    if as_json:
        _print_json(rows)
    else:
        click.echo("\n\n".join(tables))


def _headed(table, heading, several):
    """A table, under a heading if there are several."""
    return f"{heading}\n{table}" if several else table


@main.command()
@several("--state", "names", kind=STATES, required=True, help="Name such as U, Ua, U-, UD.")
@ENDS
@several("--H", "gaps", kind=NUMBERS, required=True, help="Half gap H*/L.")
@click.option("--control", type=Choice(["P", "shortening"]), default="P", show_default=True)
@click.option(
    "--P-max", "P_max", type=NUMBER, default=12.0, show_default=True, help="Events up to this load."
)
@JSON
def transitions(names, ends, gaps, control, P_max, as_json):
    """List where states begin and end, and where their stability changes."""
    from elastica.paths.transitions import transitions as events_of

    rows: list[dict] = []
    tables = []
    asked = list(product(names, ends))
    for name, held in asked:
        with _mechanics():
            events = events_of(name, gaps, held, control, P_max)
        rows += _rows(events, held) if as_json else []
        table = str(events) if len(events) else f"{name}: no event up to P = {P_max:g}"
        tables.append(_headed(table, f"{name} {held}", len(asked) > 1))
    if as_json:
        _print_json(rows)
    else:
        click.echo("\n\n".join(tables))


def _rows(answer, ends):
    """Rows of an answer at one point, by name."""
    for row in answer:
        yield {"ends": ends} | {name: value for name, value in row._asdict().items() if name != "point"}


def _print_json(value):
    click.echo(json.dumps(_plain(value)))


def _plain(value):
    """A value as JSON has it: codes by their names, null for NaN and infinity, which it does not know."""
    from elastica.codes import Code

    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, Code):
        return str(value)
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
