"""Progress of a run: a bar with rate and time left on a terminal, a line every 30 s elsewhere.

It never stops a run: where a terminal is closed, a disk full or nobody listening, it is not told.
"""

import sys
import time
from contextlib import contextmanager

from studies.messages import printable, readable_time

QUIET_SECONDS = 30.0


class Forgiving:
    """A stream of text that says what it can, and nothing where that fails."""

    def __init__(self, stream):
        self.stream = stream

    def write(self, text):
        """Write text, if that is possible."""
        self._attempt("write", text)
        return len(text)

    def flush(self):
        """Send what is written, if that is possible."""
        self._attempt("flush")

    def isatty(self):
        """Whether it is a terminal that is there."""
        return bool(self._attempt("isatty"))

    @property
    def encoding(self):
        """As of the stream, whose terminal may not know every character."""
        return getattr(self.stream, "encoding", None) or "utf-8"

    def _attempt(self, what, *arguments):
        try:
            # Python has no stream at all where the descriptor was closed at the start.
            return getattr(self.stream, what)(*arguments) if self.stream is not None else None
        except (OSError, ValueError):
            return None


def note(text):
    """Tell the user what happened on the way."""
    print(printable(text), file=Forgiving(sys.stderr), flush=True)


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
