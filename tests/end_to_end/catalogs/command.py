"""The command `elastica catalog`, in this process, and the catalog that ships with the project."""

from pathlib import Path

from click.testing import CliRunner

from studies.command_line import main

CATALOGS = Path(__file__).parents[3] / "catalogs"
SHIPPED = CATALOGS / "clamped-and-pinned.nc"


def catalog(command, *arguments, folder=None):
    where = () if folder is None else ("--catalog", folder)
    return CliRunner().invoke(main, ["catalog", command, *map(str, (*arguments, *where))])
