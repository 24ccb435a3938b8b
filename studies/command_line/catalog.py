"""Subcommands of the archive: catalog list, add, find, verify."""

import json
import sys
from pathlib import Path

import click

from studies.command_line.group import BAD_INPUT, main, say
from studies.command_line.options import FILE, JSON, NUMBER, Choice, Whole

FOLDER = click.option(
    "--catalog",
    "folder",
    type=click.Path(path_type=Path),
    envvar="ELASTICA_CATALOG",
    default="catalogs",
    show_default=True,
    show_envvar=True,
    help="Folder of the catalog.",
)


@main.group()
def catalog():
    """Keep datasets in a folder, find them again, and prove that they are whole."""


@catalog.command("list")
@FOLDER
@JSON
def list_all(folder, as_json):
    """List what is in the catalog."""
    from studies.archive.catalog import Catalog

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
    from studies.archive.catalog import Catalog

    everything = Catalog.read(folder)
    found = everything.find(**query)
    if not found.entries and not found.bad:
        say(f"{folder}: none of {len(everything.entries)} datasets holds this", err=True)
    _show(found, as_json)


def _show(catalog, as_json):
    """Print entries; on the error output, those that are bad and what a look at the folder tells of files."""
    condition = {name: catalog.condition(name) for name in catalog.entries}
    for name, found in condition.items():
        if found != "present":
            say(f"problem: {catalog.path(name)}: the file is {found}", err=True)
    if as_json:
        rows = [
            {"name": name, "path": str(catalog.path(name)), "file": condition[name]}
            | entry.model_dump(mode="json", exclude_none=True)
            for name, entry in catalog.entries.items()
        ]
        click.echo(json.dumps(rows))
    else:
        width = max(map(len, catalog.entries), default=0)
        for name, entry in catalog.entries.items():
            say(f"{name:<{width}}  {entry}")
    _name_bad(catalog)


def _name_bad(catalog):
    """Name the entries of the index that cannot be used; the exit status tells that there are some."""
    for problem in catalog.bad.values():
        say(f"problem: {problem}", err=True)
    if catalog.bad:
        sys.exit(BAD_INPUT)


@catalog.command()
@FILE
@FOLDER
def add(file, folder):
    """Move a dataset into the catalog."""
    from studies.archive.keeping import add as add_file

    say(f"{folder / add_file(folder, file)}")


@catalog.command()
@click.option(
    "--sample",
    type=Whole(min=0),
    default=50,
    show_default=True,
    help="Grid points of each dataset to solve again.",
)
@FOLDER
def verify(folder, sample):
    """Check every dataset: its hash, its attributes, and a sample of its values."""
    from studies.archive.catalog import Catalog
    from studies.archive.keeping import strays
    from studies.archive.keeping import verify as verify_all

    everything = Catalog.read(folder)
    bad = 0
    for name, verdict, problems in verify_all(everything, sample):
        bad += bool(problems)
        for problem in problems:
            say(f"problem: {name}: {problem}", err=True)
        if not problems:
            say(f"{name}: {verdict}")
    for name in strays(everything):
        say(f"{name}: not in the index; `elastica catalog add` takes it in")
    if bad:
        say(f"{folder}: {bad} of {len(everything.entries)} datasets are not good", err=True)
    _name_bad(everything)
    if bad:
        sys.exit(BAD_INPUT)
