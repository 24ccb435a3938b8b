"""The study file: what is asked for, validated before anything runs, and its identity.

Left out: how the work is divided (`plan`) and who does it (`run`).
"""

import hashlib
import json
import math
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictInt,
    StrictStr,
    ValidationError,
    field_validator,
    model_validator,
)

from elastica.chain.profile import parse_profile
from elastica.chain.solution import CLAMPS, LINKS, check_chain
from elastica.ends import parse_ends
from elastica.states import parse_state, states
from studies.errors import StudyError
from studies.evaluate import Task

NUMERICS_VERSION = 2
"""Raised whenever the same study may give other values than before, beyond rounding."""
LABEL_DIGITS = 12
MOST_LABELS = 1_000_000
MOST_POINTS = 1_000_000_000
LARGEST_NUMBER = 1e300


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def canonical(value):
    """A label with 12 significant digits, so that the same label from another grid compares equal."""
    return float(f"{value:.{LABEL_DIGITS - 1}e}") + 0.0


def _number(value):
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or abs(value) > LARGEST_NUMBER or math.isnan(value):
        raise ValueError(f"{str(value)[:40]} is not a finite number; write one such as 0.1")
    return value


Number = Annotated[float, BeforeValidator(_number)]


class Range(_Table):
    """`{ start, stop, num, spacing }`, both ends included."""

    start: Number
    stop: Number
    num: Annotated[StrictInt, Field(ge=1, le=MOST_LABELS)]
    spacing: Literal["linear", "log"] = "linear"

    def values(self):
        """Labels of the axis."""
        if self.num > 1 and self.stop <= self.start:
            raise ValueError(f"stop = {self.stop!r} is not above start = {self.start!r}; exchange them")
        if self.spacing == "linear":
            return np.linspace(self.start, self.stop, self.num)
        if self.start <= 0:
            raise ValueError(f"a log axis cannot start at {self.start!r}; start above 0")
        return np.geomspace(self.start, self.stop, self.num)


def _axis(value):
    """Canonical, strictly increasing labels from a list or a range."""
    if isinstance(value, dict):
        value = Range(**value).values()
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise ValueError(f"{value!r} is neither a list nor {{ start = …, stop = …, num = … }}")
    labels = tuple(canonical(_number(float(v) if isinstance(v, np.floating) else v)) for v in value)
    if not labels:
        raise ValueError("the axis is empty; give at least one value")
    for before, after in pairwise(labels):
        if after <= before:
            raise ValueError(f"{after!r} follows {before!r}; values must increase")
    return labels


Axis = Annotated[tuple[float, ...], BeforeValidator(_axis)]


class About(_Table):
    """`[study]`: the name of the output and what the dataset says about itself."""

    name: Annotated[StrictStr, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=100)]
    title: StrictStr = ""
    summary: StrictStr = ""
    creator_name: StrictStr = ""
    institution: StrictStr = ""
    license: StrictStr = ""
    keywords: StrictStr = ""
    references: StrictStr = ""


class Grid(_Table):
    """`[grid]`: end conditions, half gaps, and loads or shortenings."""

    ends: Annotated[tuple[StrictStr, ...], Field(min_length=1)]
    H: Axis
    P: Axis | None = None
    shortening: Axis | None = None

    @field_validator("ends")
    @classmethod
    def _known_ends(cls, ends):
        names = tuple(str(parse_ends(name)) for name in ends)
        if len(set(names)) < len(names):
            raise ValueError(f"{list(ends)} names an end condition twice")
        return names

    @field_validator("H")
    @classmethod
    def _between_the_walls(cls, H):
        if not (H[0] > 0 and H[-1] < 0.5):
            raise ValueError(f"values run from {H[0]!r} to {H[-1]!r}; keep 0 < H < 0.5")
        return H

    @field_validator("P")
    @classmethod
    def _finite_loads(cls, P):
        if P and not (P[0] >= 0 and P[-1] <= 1e6):
            raise ValueError(f"values run from {P[0]!r} to {P[-1]!r}; keep 0 <= P <= 1e6")
        return P

    @field_validator("shortening")
    @classmethod
    def _possible_shortenings(cls, shortening):
        if shortening and not (shortening[0] >= 0 and shortening[-1] < 2):
            raise ValueError(
                f"values run from {shortening[0]!r} to {shortening[-1]!r}; keep 0 <= shortening < 2"
            )
        return shortening

    @model_validator(mode="after")
    def _one_control(self):
        if (self.P is None) == (self.shortening is None):
            raise ValueError("give either P or shortening: one is prescribed, the other follows")
        return self

    @model_validator(mode="after")
    def _countable(self):
        points = len(self.ends) * len(self.H) * len(self.given)
        if points > MOST_POINTS:
            raise ValueError(
                f"{points:,} points are too many; keep ends × H × {self.control} to {MOST_POINTS:,}"
            )
        return self

    @property
    def control(self):
        """What is prescribed, "P" or "shortening"."""
        return "P" if self.shortening is None else "shortening"

    @property
    def given(self):
        """Labels of what is prescribed."""
        return self.P if self.shortening is None else self.shortening


class States(_Table):
    """`[states]`: either all up to a number of contacts, or a list of names."""

    max_contacts: StrictInt | None = None
    names: tuple[StrictStr, ...] | None = None

    @model_validator(mode="after")
    def _one_way(self):
        if (self.max_contacts is None) == (self.names is None):
            raise ValueError("give either max_contacts or names")
        if self.names is not None and not self.names:
            raise ValueError("names is empty; name at least one state")
        if self.max_contacts is not None:
            states(max_contacts=self.max_contacts)
        return self


class Solve(_Table):
    """`[solve]`: how states are computed; `links`, `clamp` and `stiffness` are those of a chain."""

    method: Literal["exact", "chain"] = "exact"
    links: StrictInt | None = None
    clamp: StrictStr | None = None
    stiffness: tuple[float, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _of_a_chain(cls, table):
        if not isinstance(table, dict):
            return table
        if table.get("method") == "chain":
            return {"links": LINKS, "clamp": CLAMPS[0]} | table
        given = [name for name in ("links", "clamp", "stiffness") if name in table]
        if given and table.get("method", "exact") == "exact":
            raise ValueError(f'{", ".join(given)}: of a chain only; add method = "chain"')
        return table

    @model_validator(mode="after")
    def _a_chain_that_can_be(self):
        if self.method == "chain":
            check_chain(parse_state("0", "clamped-clamped"), self.links, self.clamp, self.stiffness)
        return self

    @property
    def arguments(self):
        """Arguments of `elastica.solve`."""
        return self.model_dump(exclude_none=True)

    def check(self, name, ends):
        """Raise ValueError if the method cannot solve a state."""
        state = parse_state(name, ends)
        if self.method == "chain":
            check_chain(state, self.links, self.clamp, self.stiffness)


class Outputs(_Table):
    """`[outputs]`: what is stored beside the maps."""

    eigenvalues: Annotated[StrictInt, Field(ge=0, le=100)] = 0
    frequencies: Annotated[StrictInt, Field(ge=0, le=100)] = 0
    shapes: Annotated[StrictInt, Field(ge=0, le=100_000)] = 0

    @field_validator("shapes")
    @classmethod
    def _a_line_needs_two_points(cls, shapes):
        if shapes == 1:
            raise ValueError("1 sample is no shape; use 0 for none or at least 2")
        return shapes


class Study(_Table):
    """A validated study: the grid, the states, the method and the outputs."""

    study: About
    grid: Grid
    states: States
    solve: Solve = Solve()
    outputs: Outputs = Outputs()

    @model_validator(mode="after")
    def _states_fit_the_ends(self):
        for name in self.states.names or ():
            problems = []
            for ends in self.grid.ends:
                try:
                    self.solve.check(name, ends)
                except ValueError as problem:
                    problems.append(str(problem))
            if len(problems) == len(self.grid.ends):
                raise ValueError(f"states.names: {problems[0]}")
        return self

    @model_validator(mode="after")
    def _a_catalogue_that_the_chain_can_solve(self):
        contacts, solve = self.states.max_contacts, self.solve
        if contacts is None or solve.method == "exact":
            return self
        if solve.stiffness and not parse_profile(solve.stiffness, solve.links).uniform:
            raise ValueError(
                "states.max_contacts lists the states of a uniform strip; name those of this one instead"
            )
        try:
            solve.check("U" * max(contacts, 1), self.grid.ends[0])
        except ValueError as problem:
            raise ValueError(f"states.max_contacts: {problem}") from None
        return self

    @classmethod
    def from_toml(cls, path):
        """Read and validate a study file.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Study

        Raises
        ------
        StudyError
            With file, key, value and remedy in one sentence.
        """
        path = Path(path)
        try:
            content = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as problem:
            raise StudyError(f"{path}: {problem.strerror}; give the path of a study file") from None
        except (ValueError, RecursionError) as problem:
            reason = str(problem).splitlines()[0]
            raise StudyError(f"{path}: this is no TOML file ({reason}); mend or replace it") from None
        return cls.from_dict(content, path)

    @classmethod
    def from_dict(cls, content, path="study"):
        """Validate the content of a study file; `path` names it in messages."""
        try:
            return cls.model_validate(content)
        except ValidationError as problem:
            raise StudyError(f"{path}: {_explain(problem)}") from None

    @property
    def name(self):
        """Name of the study and of its default output."""
        return self.study.name

    @property
    def task(self):
        """What is computed at every grid point."""
        return Task(self.state_names, self.states.names is None, self.outputs, self.solve)

    @property
    def state_names(self):
        """Canonical names of the states to solve, each once; with max_contacts, of their first roots."""
        if self.states.names is not None:
            wanted = (
                parse_state(name, ends).name
                for name in self.states.names
                for ends in self.grid.ends
                if _has_meaning(name, ends)
            )
        else:
            wanted = (name for ends in self.grid.ends for name in states(ends, self.states.max_contacts))
        return tuple(dict.fromkeys(wanted))

    @property
    def config_json(self):
        """The whole study as canonical JSON."""
        return json.dumps(self.model_dump(mode="json", exclude_none=True), sort_keys=True, ensure_ascii=False)

    @property
    def study_id(self):
        """Identity of everything in the study file."""
        return hashlib.sha256(self.config_json.encode()).hexdigest()[:32]

    @property
    def numerics_id(self):
        """Identity of the method; results that share it may be merged."""
        numerics = {
            "solve": self.solve.model_dump(mode="json", exclude_none=True),
            "version": NUMERICS_VERSION,
        }
        return hashlib.sha256(json.dumps(numerics, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def identity(self):
        """Both identities, by their names in files."""
        return {"study_id": self.study_id, "numerics_id": self.numerics_id}

    def plan(self, **policy):
        """Divide the study into blocks; see `studies.plan.Plan`."""
        from studies.plan import Plan

        return Plan.of(self, **policy)


def _has_meaning(name, ends):
    try:
        parse_state(name, ends)
    except ValueError:
        return False
    return True


ALLOWED_KEYS = {
    (): Study,
    ("study",): About,
    ("grid",): Grid,
    ("states",): States,
    ("solve",): Solve,
    ("outputs",): Outputs,
}


REMEDIES = {
    "tuple_type": "write a list, in [ ]",
    "model_type": "write a table",
    "string_type": "write a text, in quotes",
    "string_pattern_mismatch": "use letters, digits, '.', '_' and '-'",
    "int_type": "write a whole number",
    "too_short": "name at least one",
}


def _explain(problem):
    """The first error of a validation as one sentence: key, value, remedy."""
    error = problem.errors()[0]
    where = tuple(str(part) for part in error["loc"])
    key = ".".join(where)
    kind, value = error["type"], error["input"]
    if kind == "extra_forbidden":
        allowed = ", ".join(ALLOWED_KEYS.get(where[:-1], Range).model_fields)
        return f"unknown key {key}; allowed here are {allowed}"
    if kind == "missing":
        return f"{key} is missing; add it"
    if kind == "value_error":
        message = str(error["ctx"]["error"])
        if isinstance(error["ctx"]["error"], ValidationError):
            message = _explain(error["ctx"]["error"])
        return f"{key}: {message}" if key else message
    remedy = REMEDIES.get(kind, error["msg"][:1].lower() + error["msg"][1:])
    return f"{key} = {value!r} is not allowed; {remedy}"
