"""Subcommands that look at a dataset: check, plot."""

import sys
from pathlib import Path

import click

from studies.command_line.group import BAD_INPUT, main
from studies.command_line.options import FILE, writable


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
    writable(output)
    identify(file, read=("status", "stability"))
    with open_dataset(file) as dataset:
        save_chart(dataset, output)
    click.echo(f"{output}")
