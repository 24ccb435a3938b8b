"""Which name was meant where one is not known: one rule for every closed list of names."""

import difflib
import reprlib
from collections.abc import Iterable

ALIKE = 0.6
"""Least share of letters in common with what was meant."""
BRIEF = reprlib.Repr()
BRIEF.maxstring = BRIEF.maxother = BRIEF.maxlong = 100


def meant(text: object, names: Iterable[str]) -> str | None:
    """The name that is the text but for the case of its letters, else the one most like it.

    Parameters
    ----------
    text : object
    names : iterable of str

    Returns
    -------
    str or None
        None where no name is like it.
    """
    known = {name.casefold(): name for name in names}
    close = difflib.get_close_matches(str(text)[:100].casefold(), known, n=1, cutoff=ALIKE)
    return known[close[0]] if close else None


def did_you_mean(text: object, names: Iterable[str]) -> str:
    """A question to follow the text in an error, with a space before it; empty where no name is like it."""
    name = meant(text, names)
    return "" if name is None else f" (did you mean {name!r}?)"


def shown(value: object) -> str:
    """What was given, as Python writes it, for an error: the middle of a long one is left out."""
    return BRIEF.repr(value)
