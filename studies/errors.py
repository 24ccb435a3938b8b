"""The error that a user sees as one sentence."""


class StudyError(ValueError):
    """A study, or a file, that cannot be used; the message says why and what to change."""
