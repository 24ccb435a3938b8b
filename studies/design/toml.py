"""Read a TOML file of unknown origin: what is no text, too large or would take for ever is refused before.

Not here: what the tables of a study may hold (`tables`).
"""

import codecs
import re
import tomllib

from studies.errors import StudyError
from studies.messages import MOST_SHOWN, shown

LARGEST_FILE = 50_000_000
"""Bytes: two axes of a million labels each, with room."""
MOST_DOTS = 16
"""Of a key. The time that the parser takes grows with their square."""
PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){PART}(?:[ \t]*+\.[ \t]*+{PART}){{{MOST_DOTS + 1}}}")
OTHER_TEXTS = {codecs.BOM_UTF32_LE: "UTF-32", codecs.BOM_UTF16_LE: "UTF-16", codecs.BOM_UTF16_BE: "UTF-16"}


def read_toml(content, path):
    """The tables of a file.

    Parameters
    ----------
    content : bytes
        At most one more than `LARGEST_FILE`.
    path : Path
        Names it in messages.

    Returns
    -------
    dict

    Raises
    ------
    StudyError
        In one sentence.
    """
    if len(content) > LARGEST_FILE:
        raise _no_toml(path, f"it has more than {LARGEST_FILE:,} bytes")
    text = _decoded(content, path).replace("\r\n", "\n").replace("\r", "\n")
    if found := LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise _no_toml(path, f"the key {shown(found[0])} in line {line} has more than {MOST_DOTS} dots")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:
        reason = str(problem).splitlines()[0]
        if len(reason) > 2 * MOST_SHOWN:  # The end says where.
            reason = f"{reason[:MOST_SHOWN]}…{reason[-MOST_SHOWN:]}"
        raise _no_toml(path, reason) from None


def _decoded(content, path):
    """The text, which some editors begin with a mark of its encoding."""
    for mark, name in OTHER_TEXTS.items():
        if content.startswith(mark):
            raise _no_toml(path, f"it is {name}", "save it as UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = content.count(b"\n", 0, problem.start) + 1
        reason = f"line {line} has the byte 0x{content[problem.start]:02x}, which is not UTF-8"
        raise _no_toml(path, reason, "save it as UTF-8") from None


def _no_toml(path, reason, remedy="mend or replace it"):
    return StudyError(f"{path}: this is no TOML file ({reason}); {remedy}")
