"""Errors that end in one sentence for the user. How values are shown in it: `messages`."""


class StudyError(ValueError):
    """A study, or a file, that cannot be used; the message says why and what to change."""


class FailedPoints(StudyError):
    """A run that stops because points failed, as the user asked."""


class UnfitWorker(Exception):
    """A worker that cannot compute a study: its address, and why."""
