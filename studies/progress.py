"""Progress of a run: a bar with rate and time left on a terminal, a line every 30 s elsewhere.

It never stops a run: where a terminal is closed, a disk full or nobody listening, it is not told.
"""

import sys
import time
from contextlib import contextmanager

from studies.messages import Forgiving, readable_time

QUIET_SECONDS = 30.0


@contextmanager
def progress(total, done=0, stream=None):
    """Give a function that takes the number of grid points just finished."""
    stream = Forgiving(stream or sys.stderr)
    with _bar(total, done, stream) if stream.isatty() else _lines(total, done, stream) as advance:
        yield advance


@contextmanager
def _bar(total, done, stream):
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        BarColumn(),
        TextColumn("{task.completed:,.0f}/{task.total:,.0f} points"),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(file=stream), transient=True) as bar:
        task = bar.add_task("", total=total, completed=done, rate="")
        start = time.monotonic()
        finished = 0

        def advance(points):
            nonlocal finished
            finished += points
            rate = finished / max(time.monotonic() - start, 1e-9)
            bar.update(task, advance=points, rate=f"{rate:,.0f} points/s")

        yield advance


@contextmanager
def _lines(total, done, stream):
    start = last = time.monotonic()
    finished = 0

    def advance(points):
        nonlocal finished, last
        finished += points
        now = time.monotonic()
        if now - last >= QUIET_SECONDS:
            last = now
            rate = finished / (now - start)
            left = (total - done - finished) / rate
            print(
                f"{done + finished:,}/{total:,} points, {rate:,.0f} points/s, {readable_time(left)} left",
                file=stream,
                flush=True,
            )

    yield advance
