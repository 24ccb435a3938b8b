"""What of a system keeps studies from working on it: Windows, its paths, and another package of our name."""

import os
import re
import sys
from importlib.util import find_spec
from pathlib import Path

from studies.errors import StudyError
from studies.messages import readable_path

WINDOWS_PATH = re.compile(r"[A-Za-z]:[\\/]|.*\\")


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


def refuse_windows_path(path):
    """Refuse to write to a path of another system, which here would be a strange name in this folder.

    Raises
    ------
    StudyError
    """
    if os.name == "posix" and WINDOWS_PATH.match(os.fsdecode(path)):
        raise StudyError(f"{readable_path(path)}: this is a path of Windows; here folders are divided by /")
