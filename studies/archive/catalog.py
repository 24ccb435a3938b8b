"""The index of a catalog: what its archived datasets hold, found without opening one of them.

A catalog is a folder with `index.json` and the datasets that it names.

Not here: how a dataset gets in and is verified (`keeping`).
"""

import json
import math
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
    model_validator,
)

from elastica.ends import parse_ends
from elastica.state import parse_state
from studies.errors import StudyError
from studies.messages import named, shown
from studies.schema import ANY_NAME

INDEX = "index.json"
INDEX_VERSION: Final = 1
SUFFIX = ".nc"
MOST_DIGITS, LONGEST_NAME, LONGEST_TEXT = 300, 255, 10_000
"""Digits of a number, bytes of the name of a file, characters of a text."""
Count = Annotated[int, Field(ge=0, lt=2**63)]
Text = Annotated[str, Field(max_length=LONGEST_TEXT)]
Texts = Annotated[tuple[Text, ...], Field(max_length=100_000)]
MOST_ENDS, MOST_OF_TITLE = 2, 80
"""In a list: end conditions that are named, characters of a title."""
METHODS = ("exact", "chain")


def _known_ends(names):
    for name in names:
        parse_ends(name)
    return names


def _by_a_method(arguments):
    if arguments.get("method") not in METHODS:
        raise ValueError(f"the method is one of {', '.join(METHODS)}")
    return arguments


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Extent(_Record):
    """First and last label of an axis, and how many there are."""

    start: FiniteFloat
    stop: FiniteFloat
    num: Count

    def __contains__(self, value):
        """Whether a value lies between the first and the last label."""
        return self.start <= value <= self.stop

    def __str__(self):
        """As it stands in a list."""
        return f"{self.start:g} … {self.stop:g} ({self.num})" if self.num > 1 else f"{self.start:g}"


class Entry(_Record):
    """What the index says of a dataset."""

    title: Text
    study: Text
    study_id: Text
    numerics_id: Text
    content_hash: Text
    sha256: Text
    bytes: Count
    date_created: Text
    date_added: Text
    ends: Annotated[Texts, AfterValidator(_known_ends)]
    states: Texts
    H: Extent
    P: Extent | None = None
    shortening: Extent | None = None
    solve: Annotated[dict[Text, Text | Count | tuple[FiniteFloat, ...]], AfterValidator(_by_a_method)]
    outputs: dict[Text, Count]

    @model_validator(mode="after")
    def _one_control(self):
        if (self.P is None) == (self.shortening is None):
            raise ValueError("give either P or shortening")
        return self

    def __str__(self):
        """As it stands in a list, on one line; the title last, since it may be long."""
        ends = ", ".join(self.ends) if len(self.ends) <= MOST_ENDS else f"{len(self.ends)} end conditions"
        prescribed = f"{self.control} {getattr(self, self.control)}"
        what = (
            f"{self.bytes / 1e6:.2g} MB",
            str(self.solve["method"]),
            self.date_created[:10],
            ends,
            f"H {self.H}",
        )
        return "  ".join([*what, prescribed, f"{len(self.states)} states", self.title[:MOST_OF_TITLE]])

    @property
    def control(self):
        """What is prescribed, "P" or "shortening"."""
        return "P" if self.shortening is None else "shortening"

    def holds(self, ends=None, state=None, H=None, P=None, shortening=None, method=None):
        """Whether the dataset answers a query; see `Catalog.find`."""
        matching = self.ends if ends is None else [name for name in self.ends if name == ends]
        return (
            any(state is None or _canonical(state, name) in self.states for name in matching)
            and (H is None or H in self.H)
            and (P is None or (self.P is not None and P in self.P))
            and (shortening is None or (self.shortening is not None and shortening in self.shortening))
            and method in (None, self.solve["method"])
        )


def _canonical(state, ends):
    """Name of a state for given ends; none where it has no meaning."""
    try:
        return parse_state(state, ends).name
    except ValueError:
        return None


def is_name(name):
    """Whether a text may be the name of a dataset in the folder of the index."""
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        return False
    return Path(name).name == name and name.endswith(SUFFIX) and "\0" not in name and size <= LONGEST_NAME


def _whole(text):
    """A whole number; one that no file can have becomes infinite, which no entry accepts."""
    return int(text) if len(text) <= MOST_DIGITS else math.inf


class _Object(dict):
    """An object of JSON, and which of its keys are there twice."""

    def __init__(self, pairs):
        super().__init__(pairs)
        keys = [key for key, _ in pairs]
        self.twice = {key for key in keys if keys.count(key) > 1} if len(self) < len(keys) else set()

    def anywhere_twice(self):
        """Such keys here and in the objects below."""
        below = (value.anywhere_twice() for value in self.values() if isinstance(value, _Object))
        return self.twice.union(*below)


@dataclass(frozen=True)
class Catalog:
    """A folder of archived datasets, as its index describes it.

    Attributes
    ----------
    folder : Path
    entries : dict of str to Entry
        By the name of the file in the folder.
    bad : dict of str to str
        Entries that cannot be used: what is wrong with each.
    """

    folder: Path
    entries: dict[str, Entry]
    bad: dict[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: str | Path) -> "Catalog":
        """Read the index of a folder; a folder without one is an empty catalog.

        Parameters
        ----------
        folder : str or Path

        Returns
        -------
        Catalog

        Raises
        ------
        StudyError
            If there is no such folder, or its index is no JSON with entries or of a newer version. An entry
            that cannot be used does not hide the others.
        """
        folder = Path(folder)
        if not folder.is_dir():
            raise StudyError(
                f"{folder}: there is no such folder; create it, or name another with --catalog or "
                "$ELASTICA_CATALOG"
            )
        path = folder / INDEX
        if path.exists() and not path.is_file():
            raise _damaged(path, "it is no file")
        try:
            text = path.read_text(encoding="utf-8")
            index = json.loads(text, object_pairs_hook=_Object, parse_int=_whole)
        except FileNotFoundError:
            return cls(folder, {})
        except (ValueError, RecursionError) as problem:
            raise _damaged(path, problem) from None
        found = index.get("entries") if isinstance(index, _Object) else None
        if not isinstance(found, _Object) or index.twice:
            raise _damaged(path, "it has no table of entries, or two")
        version = index.get("format_version")
        if not isinstance(version, (int, float)) or isinstance(version, bool) or version < 1:
            raise _damaged(path, f"its format_version is {shown(version)}")
        if version > INDEX_VERSION:
            raise StudyError(
                f"{path}: version {shown(version)} of the index is newer than {INDEX_VERSION}, which this "
                "version reads; install a newer constrained-elastica"
            )
        catalog = cls(folder, {})
        for name, content in found.items():
            try:
                catalog.entries[name] = _entry(name, content, name in found.twice)
            except StudyError as problem:
                catalog.bad[name] = f"{path}: {problem}"
        return catalog

    def path(self, name: str) -> Path:
        """Path of an archived dataset."""
        return self.folder / name

    def condition(self, name: str) -> str:
        """What a look at the folder tells of a dataset: "present", "gone", "changed" or "unreadable"."""
        try:
            found = self.path(name).stat()
        except FileNotFoundError:
            return "gone"
        except OSError:
            return "unreadable"
        whole = stat.S_ISREG(found.st_mode) and found.st_size == self.entries[name].bytes
        return "present" if whole else "changed"

    def find(
        self,
        ends: str | None = None,
        state: str | None = None,
        H: float | None = None,
        P: float | None = None,
        shortening: float | None = None,
        method: str | None = None,
    ) -> "Catalog":
        """Datasets that hold what is asked for; what is left out may be anything.

        Parameters
        ----------
        ends : str, optional
            End conditions, such as "clamped-pinned".
        state : str, optional
            Name of a state that is solved somewhere in the dataset.
        H, P, shortening : float, optional
            Values between the first and the last label of the dataset; they need not be labels.
        method : str, optional
            "exact" or "chain".

        Returns
        -------
        Catalog
            With the entries that hold it.

        Raises
        ------
        StudyError
            If a name is not known or a number is not finite.
        """
        try:
            ends = None if ends is None else str(parse_ends(ends))
            if state is not None:
                parse_state(state, ends or ANY_NAME)
        except ValueError as problem:
            raise StudyError(str(problem)) from None
        for name, value in (("H", H), ("P", P), ("shortening", shortening)):
            if value is not None and not math.isfinite(value):
                raise StudyError(f"{name} = {value} is not a finite number; write one such as 0.1")
        query = {"ends": ends, "state": state, "H": H, "P": P, "shortening": shortening, "method": method}
        found = {name: entry for name, entry in self.entries.items() if entry.holds(**query)}
        return Catalog(self.folder, found, self.bad)

    def text(self) -> str:
        """Content of `index.json`."""
        entries = {name: self.entries[name] for name in sorted(self.entries)}
        table = {name: entry.model_dump(mode="json", exclude_none=True) for name, entry in entries.items()}
        index = {"format_version": INDEX_VERSION, "entries": table}
        return json.dumps(index, indent=1, ensure_ascii=False) + "\n"


def _entry(name, content, is_twice):
    """An entry of the index.

    Raises
    ------
    StudyError
        If it cannot be used.
    """
    remedy = "; restore it, or take it out and add its dataset again"
    where = f"entries.{named(name)}"
    if not is_name(name):
        raise StudyError(f"{where}: {shown(name)} is no name of a file in the folder of the index{remedy}")
    if is_twice or (isinstance(content, _Object) and content.anywhere_twice()):
        raise StudyError(f"{where} is there twice, or a key of it{remedy}")
    try:
        return Entry.model_validate(content)
    except ValidationError as problem:
        error = problem.errors(include_url=False, include_input=False)[0]
        keys = ".".join([where, *map(named, error["loc"])])
        raise StudyError(f"{keys}: {error['msg']}{remedy}") from None


def _damaged(path, reason):
    return StudyError(
        f"{path}: this is no index of a catalogue ({reason}); restore it, or move it away and add the "
        "datasets again"
    )
