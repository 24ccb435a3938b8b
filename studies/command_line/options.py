"""Options and arguments that several subcommands share."""

import os
from pathlib import Path

import click

STUDY = click.argument("study", type=click.Path(path_type=Path), metavar="STUDY.toml")
FILE = click.argument("file", type=click.Path(path_type=Path), metavar="FILE.nc")


OUTPUT = click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Default: <study name>.nc here."
)
FORCE = click.option(
    "--force-unlock", is_flag=True, help="Take over from a run on another host, which has ended."
)
REUSE = click.option(
    "--reuse", type=click.Path(path_type=Path), metavar="OTHER.nc", help="Take the points that are there."
)
JSON = click.option("--json", "as_json", is_flag=True, help="Machine-readable output.")


def writable(output):
    """Refuse a file in a folder that takes none.

    Raises
    ------
    StudyError
        If the folder does not exist or cannot be written to.
    """
    from studies.errors import StudyError

    if not output.parent.is_dir() or not os.access(output.parent, os.W_OK):
        raise StudyError(f"{output.parent}: this folder does not exist or cannot be written to")
