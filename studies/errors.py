"""The error that a user sees as one sentence, and how values are shown in it."""

import os
import re
import sys
from importlib.util import find_spec
from pathlib import Path

WINDOWS_PATH = re.compile(r"[A-Za-z]:[\\/]|.*\\")
MOST_SHOWN = 60
"""Characters of a value in a sentence."""


class StudyError(ValueError):
    """A study, or a file, that cannot be used; the message says why and what to change."""


class FailedPoints(StudyError):
    """A run that stops because points failed, as the user asked."""


class UnfitWorker(Exception):
    """A worker that cannot compute a study: its address, and why."""


def refuse_windows():
    """Refuse a system whose processes and locks are not those that runs rely on.

    Raises
    ------
    StudyError
    """
    if sys.platform == "win32":
        raise StudyError(
            "studies and the command `elastica` need Linux, macOS or, on Windows, WSL (wsl --install); "
            "`import elastica` in Python solves states here too"
        )


def refuse_pyelastica():
    """Refuse to work with PyElastica in the place of `elastica`, whose name it has.

    Raises
    ------
    StudyError
    """
    found = find_spec("elastica")
    origin = Path(found.origin) if found and found.origin else None
    if (
        origin
        and origin.is_file()
        and "find_states" not in origin.read_text(encoding="utf-8", errors="replace")
    ):
        raise StudyError(
            f"{origin.parent} is PyElastica, whose import name is elastica too; install each into an "
            "environment of its own (pip install --force-reinstall constrained-elastica)"
        )


def printable(text):
    """A text that may be from a file, as it can be printed: one line in which nothing drives a terminal.

    Control characters, ends of lines, and marks that turn the direction of writing are escaped.
    """
    return "".join(mark if mark.isprintable() else repr(mark)[1:-1] for mark in str(text))


def refuse_windows_path(path):
    """Refuse to write to a path of another system, which here would be a strange name in this folder.

    Raises
    ------
    StudyError
    """
    if os.name == "posix" and WINDOWS_PATH.match(os.fsdecode(path)):
        raise StudyError(f"{readable_path(path)}: this is a path of Windows; here folders are divided by /")


def shown(value):
    """A value from a file, as it fits into one sentence."""
    try:
        text = repr(value)
    except ValueError:  # A whole number of more digits than Python writes.
        text = "a number of thousands of digits"
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…"


def readable_path(path):
    """A path as text that can be shown and stored, whatever its bytes are."""
    return os.fsencode(path).decode(errors="backslashreplace")
