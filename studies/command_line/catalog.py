"""Subcommands of the archive: catalog list, add, find, verify."""

import json
import sys
from pathlib import Path

import click

from studies.command_line.group import BAD_INPUT, main
from studies.command_line.options import FILE, JSON, NUMBER, Choice

FOLDER = click.option(
    "--catalog",
    "folder",
    type=click.Path(path_type=Path),
    envvar="ELASTICA_CATALOG",
    default="catalogs",
    show_default=True,
    show_envvar=True,
    help="Folder of the catalogue.",
)


@main.group()
def catalog():
    """Keep datasets in a folder, find them again, and prove that they are whole."""


@catalog.command("list")
@FOLDER
@JSON
def list_all(folder, as_json):
    """List what is in the catalogue."""
    from studies.catalog import Catalog

    _show(Catalog.read(folder), as_json)


@catalog.command()
@click.option("--ends", metavar="A-B|A/B", help="End conditions, such as clamped-pinned.")
@click.option("--state", help="Name of a state that is solved somewhere, such as UD.")
@click.option("--H", "H", type=NUMBER, help="Half gap between the first and the last of the dataset.")
@click.option("--P", "P", type=NUMBER, help="Likewise a thrust, where thrusts are prescribed.")
@click.option("--shortening", type=NUMBER, help="Likewise a shortening, where shortenings are prescribed.")
@click.option("--method", type=Choice(["exact", "chain"]))
@FOLDER
@JSON
def find(folder, as_json, **query):
    """Find the datasets that hold a state, an end condition, a gap, a load."""
    from studies.catalog import Catalog

    everything = Catalog.read(folder)
    found = everything.find(**query)
    _show(found, as_json)
    if not found.entries:
        click.echo(f"{folder}: none of {len(everything.entries)} datasets holds this", err=True)


def _show(catalog, as_json):
    """Print entries; on the error output, what a look at the folder tells of their files."""
    condition = {name: catalog.condition(name) for name in catalog.entries}
    for name, found in condition.items():
        if found != "present":
            click.echo(f"problem: {catalog.path(name)}: the file is {found}", err=True)
    if as_json:
        rows = [
            {"name": name, "path": str(catalog.path(name)), "file": condition[name]}
            | entry.model_dump(mode="json", exclude_none=True)
            for name, entry in catalog.entries.items()
        ]
        click.echo(json.dumps(rows))
        return
    for name, entry in catalog.entries.items():
        about = f"{entry.bytes / 1e6:.2g} MB, {entry.solve['method']}, {entry.date_created[:10]}"
        control, given = entry.control, getattr(entry, entry.control)
        click.echo(f"{name}  ({about})  {entry.title}")
        click.echo(f"  {', '.join(entry.ends)};  H {entry.H};  {control} {given};  {' '.join(entry.states)}")


@catalog.command()
@FILE
@FOLDER
def add(file, folder):
    """Move a dataset into the catalogue."""
    from studies.archive import add as add_file

    click.echo(f"{folder / add_file(folder, file)}")


@catalog.command()
@click.option(
    "--sample",
    type=click.IntRange(min=0),
    default=50,
    show_default=True,
    help="Grid points of each dataset to solve again.",
)
@FOLDER
def verify(folder, sample):
    """Check every dataset: its hash, its attributes, and a sample of its values."""
    from studies.archive import strays
    from studies.archive import verify as verify_all
    from studies.catalog import Catalog

    everything = Catalog.read(folder)
    bad = 0
    for name, verdict, problems in verify_all(everything, sample):
        bad += bool(problems)
        for problem in problems:
            click.echo(f"problem: {name}: {problem}", err=True)
        if not problems:
            click.echo(f"{name}: {verdict}")
    for name in strays(everything):
        click.echo(f"{name}: not in the index; `elastica catalog add` takes it in")
    if bad:
        click.echo(f"{folder}: {bad} of {len(everything.entries)} datasets are not good", err=True)
        sys.exit(BAD_INPUT)
