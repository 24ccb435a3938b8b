"""The subcommand that measures: accuracy."""

import signal
import sys
from pathlib import Path

import click

from studies.command_line.group import INTERRUPTED, main


@main.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=".", help="Folder of the report.")
@click.option("--quick", is_flag=True, help="Fewer settings and repeats: less than a minute.")
@click.option("--method", "names", multiple=True, help="Only this method; may be repeated. Default: all.")
def accuracy(output, quick, names):
    """Measure speed against error of every method here, beside SciPy, IPOPT and dense algebra."""
    from studies.accuracy.files import Folder
    from studies.accuracy.measure import QUICK_ROUNDS, ROUNDS, methods, rounds

    folder = Folder.checked(output)
    chosen, skipped = methods(names, quick)
    for line in skipped:
        click.echo(line, err=True)
    count, done = QUICK_ROUNDS if quick else ROUNDS, 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(INTERRUPTED))
    try:
        for seconds, error in rounds(chosen, count):
            folder.keep(chosen, seconds, error)
            done += 1
            click.echo(f"round {done} of {count}", err=True)
        if not names:
            folder.add_floor(quick)
    except (KeyboardInterrupt, SystemExit):
        if done:
            folder.finish()
        click.echo(f"stopped; {done} of {count} rounds are kept in {output}", err=True)
        sys.exit(INTERRUPTED)
    click.echo(folder.finish(), nl=False)
