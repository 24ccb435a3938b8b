"""End conditions: how each end of the strip is held, read from names such as "clamped-pinned"."""

import re
from enum import Enum
from typing import NamedTuple


class End(Enum):
    """One end of the strip: the angle is held (clamped) or free (pinned)."""

    CLAMPED = "clamped"
    PINNED = "pinned"


class Ends(NamedTuple):
    """End A (fixed, s = 0) and end B (sliding, s = 1)."""

    A: End
    B: End

    @property
    def alike(self):
        """Whether the strip looks the same from both ends."""
        return self.A is self.B

    def __str__(self):
        """Write `A-B`, the form that `parse_ends` reads."""
        return f"{self.A.value}-{self.B.value}"


ALLOWED = tuple(str(Ends(a, b)) for a in End for b in End)


def parse_ends(text):
    """Read an end condition `A-B` or `A/B`.

    Parameters
    ----------
    text : str or Ends

    Returns
    -------
    Ends

    Raises
    ------
    ValueError
        If the text names no known end condition; the message lists those there are.
    """
    if isinstance(text, Ends):
        return text
    parts = re.split(r"[-/]", text.strip()) if isinstance(text, str) else []
    try:
        a, b = (End(part.strip()) for part in parts)
    except ValueError:
        raise ValueError(f"ends = {text!r} is not known; use one of {', '.join(ALLOWED)}") from None
    return Ends(a, b)
