"""The index of a catalogue: what its archived datasets hold, found without opening one of them.

A catalogue is a folder with `index.json` and the datasets that it names. Left out: how a dataset gets in and
is verified (`archive`).
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from elastica.ends import parse_ends
from elastica.states import parse_state
from studies.errors import StudyError

INDEX = "index.json"
INDEX_VERSION: Final = 1
ANY_NAME = "1/2"
"""Ends at which every name of a state has a meaning."""


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Extent(_Record):
    """First and last label of an axis, and how many there are."""

    start: float
    stop: float
    num: int

    def __contains__(self, value):
        """Whether a value lies between the first and the last label."""
        return self.start <= value <= self.stop

    def __str__(self):
        """As it stands in a list."""
        return f"{self.start:g} … {self.stop:g} ({self.num})" if self.num > 1 else f"{self.start:g}"


class Entry(_Record):
    """What the index says of a dataset."""

    title: str
    study: str
    study_id: str
    numerics_id: str
    content_hash: str
    sha256: str
    bytes: int
    date_created: str
    date_added: str
    ends: tuple[str, ...]
    states: tuple[str, ...]
    H: Extent
    P: Extent | None = None
    shortening: Extent | None = None
    solve: dict[str, str | int | tuple[float, ...]]
    outputs: dict[str, int]

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
            and method in (None, self.solve.get("method"))
        )


def _canonical(state, ends):
    """Name of a state for given ends; none where it has no meaning."""
    try:
        return parse_state(state, ends).name
    except ValueError:
        return None


def _plain(name):
    if Path(name).name != name:
        raise ValueError(f"{name!r} is no name of a file in the folder of the index")
    return name


class _Index(_Record):
    format_version: Literal[1]
    entries: dict[Annotated[str, AfterValidator(_plain)], Entry]


@dataclass(frozen=True)
class Catalog:
    """A folder of archived datasets, as its index describes it.

    Attributes
    ----------
    folder : Path
    entries : dict of str to Entry
        By the name of the file in the folder.
    """

    folder: Path
    entries: dict[str, Entry]

    @classmethod
    def read(cls, folder: str | Path) -> "Catalog":
        """Read the index of a folder; a folder without one is an empty catalogue.

        Parameters
        ----------
        folder : str or Path

        Returns
        -------
        Catalog

        Raises
        ------
        StudyError
            If there is no such folder, or its index is damaged or of a newer version.
        """
        folder = Path(folder)
        if not folder.is_dir():
            raise StudyError(
                f"{folder}: there is no such folder; create it, or name another with --catalog or "
                "$ELASTICA_CATALOG"
            )
        path = folder / INDEX
        try:
            index = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return cls(folder, {})
        except (ValueError, RecursionError) as problem:
            raise _damaged(path, problem) from None
        version = index.get("format_version") if isinstance(index, dict) else None
        if isinstance(version, int) and version > INDEX_VERSION:
            raise StudyError(
                f"{path}: version {version} of the index is newer than {INDEX_VERSION}, which this version "
                "reads; install a newer constrained-elastica"
            )
        try:
            return cls(folder, _Index.model_validate(index).entries)
        except ValidationError as problem:
            error = problem.errors()[0]
            where = ".".join(map(str, error["loc"]))
            raise _damaged(path, f"{where}: {error['msg']}") from None

    def path(self, name: str) -> Path:
        """Path of an archived dataset."""
        return self.folder / name

    def condition(self, name: str) -> str:
        """What a look at the folder tells of a dataset: "present", "gone" or "changed"."""
        try:
            size = self.path(name).stat().st_size
        except FileNotFoundError:
            return "gone"
        return "present" if size == self.entries[name].bytes else "changed"

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
        return Catalog(
            self.folder, {name: entry for name, entry in self.entries.items() if entry.holds(**query)}
        )

    def text(self) -> str:
        """Content of `index.json`."""
        entries = {name: self.entries[name] for name in sorted(self.entries)}
        index = _Index(format_version=INDEX_VERSION, entries=entries).model_dump(
            mode="json", exclude_none=True
        )
        return json.dumps(index, indent=1, ensure_ascii=False) + "\n"


def _damaged(path, reason):
    return StudyError(
        f"{path}: this is no index of a catalogue ({reason}); restore it, or move it away and add the "
        "datasets again"
    )
