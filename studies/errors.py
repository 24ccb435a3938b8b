"""The error that a user sees as one sentence, and how values are shown in it."""

import os

MOST_SHOWN = 60
"""Characters of a value in a sentence."""


class StudyError(ValueError):
    """A study, or a file, that cannot be used; the message says why and what to change."""


class FailedPoints(StudyError):
    """A run that stops because points failed, as the user asked."""


class UnfitWorker(Exception):
    """A worker that cannot compute a study: its address, and why."""


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
