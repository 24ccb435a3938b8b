"""The `elastica` command itself: how it reports bad input, and its exit status."""

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
