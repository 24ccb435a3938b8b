"""Subcommands that look at a dataset: check, plot."""

import sys

import click

from studies.command_line.group import BAD_INPUT, main, say
from studies.command_line.options import (
    FILE,
    NUMBER,
    NUMBERS,
    STATES,
    Choice,
    Output,
    Whole,
    several,
    writable,
)


@main.command()
@FILE
@click.option(
    "--sample",
    type=Whole(min=0),
    default=200,
    show_default=True,
    help="Grid points to solve again.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Which ones.  [default: others every time]")
def check(file, sample, seed):
    """Verify a dataset and say what is in it."""
    from studies.archive.checking import check as check_file

    report, problems = check_file(file, sample, seed)
    for line in report:
        say(line)
    for problem in problems:
        say(f"problem: {problem}", err=True)
    if problems:
        sys.exit(BAD_INPUT)


@main.command()
@FILE
@click.option("--kind", type=Choice(["chart", "bifurcation", "shapes"]), default="chart", show_default=True)
@click.option("--show", help="Chart: stable, preferred, count or a variable; bifurcation: a quantity.")
@several("--state", "states", kind=STATES, help="State, or several; of a chart, whose variable.")
@click.option("--H", "H", type=NUMBER, help="Half gap of a bifurcation diagram or of shapes.")
@several("--P", "loads", kind=NUMBERS, help="Load of shapes, or several.")
@several("--shortening", "shortenings", kind=NUMBERS, help="Or shortening of shapes.")
@click.option("--ends", help="End condition of shapes.  [default: the first]")
@click.option(
    "-o",
    "--output",
    type=Output(),
    help="PNG, PDF or SVG; default: beside the file.",
)
def plot(file, kind, output, **options):
    """Draw a dataset."""
    from studies import plot as figures
    from studies.errors import StudyError
    from studies.schema import control_of
    from studies.store.datasets import identify
    from studies.store.datasets import open as open_dataset

    arguments = _arguments(kind, options)
    output = output or file.with_name(file.stem + f"-{kind}" * (kind != "chart") + ".png")
    figures.drawing.format_of(output)
    writable(output)
    identify(file, read=("status", "stability"))
    with open_dataset(file) as dataset:
        control = control_of(dataset.sizes)
        if options["loads" if control == "shortening" else "shortenings"]:
            raise StudyError(f"{file}: {control} is prescribed in this dataset; choose points by --{control}")
        figure = getattr(figures, kind)(dataset, **arguments)
        figures.save(figure, output)
    say(f"{output}" + f": {figure.note}" * bool(figure.note))


ARGUMENTS = {
    "chart": {"show", "states"},
    "bifurcation": {"show", "states", "H"},
    "shapes": {"states", "H", "loads", "shortenings", "ends"},
}


def _arguments(kind, options):
    """Arguments of a figure from the options given.

    Raises
    ------
    StudyError
        If an option has no meaning for this kind of figure.
    """
    from studies.errors import StudyError

    given = {name: value for name, value in options.items() if value not in (None, ())}
    foreign = sorted(given.keys() - ARGUMENTS[kind])
    if foreign:
        spelled = {"states": "state", "loads": "P", "shortenings": "shortening"}.get(foreign[0], foreign[0])
        raise StudyError(f"--{spelled} has no meaning for --kind {kind}; leave it out")
    prescribed = [given.pop(name) for name in ("loads", "shortenings") if name in given]
    if len(prescribed) > 1:
        raise StudyError("give either --P or --shortening, whichever is the axis of the dataset")
    if prescribed:
        given["given"] = prescribed[0]
    if kind == "chart" and "states" in given:
        if len(given["states"]) > 1:
            raise StudyError("--state: a chart shows the variable of one state; give it once")
        (given["state"],) = given.pop("states")
    return given
