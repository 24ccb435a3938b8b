"""The `elastica` command itself: how it reports bad input, and its exit status."""

import sys
from typing import Any

import click

from studies.command_line.options import Command
from studies.errors import FailedPoints, StudyError
from studies.messages import printable
from studies.system import refuse_pyelastica, refuse_windows

BAD_INPUT = 2
FAILED_POINTS = 3
INTERRUPTED = 130


class Group(click.Group):
    """Report bad input as one sentence with exit status 2."""

    command_class = Command
    group_class = type

    def main(self, *arguments, **settings):
        """Run the command as its arguments say."""
        for stream in (sys.stdout, sys.stderr):
            # What a terminal or a locale cannot show must not stop the command; there may be no stream.
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        return super().main(*arguments, **settings)

    def invoke(self, ctx):
        """Run a subcommand."""
        try:
            refuse_windows()
            refuse_pyelastica()
            return super().invoke(ctx)
        except BrokenPipeError:
            raise
        except FailedPoints as problem:
            raise _refused(problem, FAILED_POINTS) from None
        except StudyError as problem:
            raise _refused(problem) from None
        except MemoryError:
            raise _refused(
                "there is not enough memory; let the command have more (`ulimit -v`), or give it less to do"
            ) from None
        except OSError as problem:
            where = f"{problem.filename}: " if problem.filename else ""
            raise _refused(f"{where}{problem.strerror or problem}") from None


def say(text, err=False):
    """Print a line, of which parts may be from a file."""
    click.echo(printable(text), err=err)


def _refused(problem, status=BAD_INPUT):
    # click declares the status for a class of errors, but reads it from the error.
    error: Any = click.ClickException(printable(problem))
    error.exit_code = status
    return error


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="constrained-elastica", prog_name="elastica")
def main():
    """Equilibria and stability of an elastic strip pushed between two walls."""
