"""How values, texts of files, paths, sizes and times are shown in a sentence; and how one is told."""

import os
import sys

MOST_SHOWN = 60
"""Characters of a value in a sentence."""


def shown(value):
    """A value from a file, as it fits into one sentence."""
    try:
        text = repr(value)
    except ValueError:  # A whole number of more digits than Python writes.
        text = "a number of thousands of digits"
    return cut(text)


def named(key):
    """A key or name from a file, as it is where it fits into one sentence."""
    key = str(key)
    return key if len(key) <= MOST_SHOWN and key.isprintable() else shown(key)


def cut(text, most=MOST_SHOWN):
    """A text of a file, of a long one the beginning."""
    text = str(text)
    return text if len(text) <= most else f"{text[:most]}…"


def printable(text):
    """A text that may be from a file, as it can be printed: one line in which nothing drives a terminal.

    Control characters, ends of lines, and marks that turn the direction of writing are escaped.
    """
    return "".join(mark if mark.isprintable() else repr(mark)[1:-1] for mark in str(text))


def readable_path(path):
    """A path as text that can be shown and stored, whatever its bytes are."""
    return os.fsencode(path).decode(errors="backslashreplace")


def readable_bytes(count):
    """A size with its unit, such as 3.2 MB."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


def readable_time(seconds):
    """A duration such as 3 s, 12 min or 2.5 h."""
    if seconds < 1:
        return "less than a second"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


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
