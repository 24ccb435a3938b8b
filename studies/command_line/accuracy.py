"""The subcommand that measures: accuracy."""

import signal
import sys

import click

from studies.command_line.group import INTERRUPTED, main
from studies.command_line.options import NUMBER, Output, Whole


@main.command()
@click.option("-o", "--output", type=Output(), default=".", help="Folder of the report.")
@click.option("--quick", is_flag=True, help="Fewer settings and repeats: less than a minute.")
@click.option("--method", "names", multiple=True, help="Only this method; may be repeated. Default: all.")
@click.option(
    "--scale",
    type=NUMBER,
    metavar="POINTS",
    help="Instead: time, memory and bytes of whole studies of 1,000 to so many grid points, such as 1e6.",
)
@click.option("--workers", type=Whole(min=1), default=2, show_default=True, help="Of those studies.")
def accuracy(output, quick, names, scale, workers):
    """Measure speed against error of every method here, beside SciPy, IPOPT and dense algebra."""
    if scale is not None:
        _scale(output, scale, workers)
        return
    from studies.accuracy.folder import Folder
    from studies.accuracy.measure import QUICK_ROUNDS, ROUNDS, methods, rounds

    chosen, skipped = methods(names, quick)
    folder = Folder.made(output)
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


def _scale(output, largest, workers):
    """Whole studies: dataset after each, then table and figure."""
    from studies.accuracy.folder import Folder
    from studies.accuracy.scale import scale, sizes
    from studies.accuracy.scale_report import figure, markdown

    sizes(largest)
    folder = Folder.made(output)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(INTERRUPTED))
    data = None
    try:
        for told, data in scale(largest, workers, output):
            folder.write(data, "scale.nc")
            click.echo(told, err=True)
    except (KeyboardInterrupt, SystemExit):
        click.echo(f"stopped; what is measured is kept in {output}", err=True)
        sys.exit(INTERRUPTED)
    finally:
        if data is not None:
            (output / "scale.md").write_text(markdown(data), encoding="utf-8")
            figure(data).savefig(output / "scale.png", dpi=150)
    click.echo(markdown(data), nl=False)
