"""The tables of a study file: their keys, and which values each may have.

Not here: labels of axes (`axes`), what the tables mean together (`request`).
"""

import math
from typing import Annotated, Literal

from pydantic import (
    BeforeValidator,
    Field,
    StrictBool,
    StrictInt,
    StrictStr,
    field_serializer,
    field_validator,
    model_validator,
)

from elastica.chain.solution import CLAMPS, LINKS, check_chain
from elastica.ends import parse_ends
from elastica.solution import LARGEST_LOAD, SMALLEST_GAP, SMALLEST_SHORTENING
from elastica.state import parse_state, states
from studies.design.axes import Axis, Refine, Table, one_or_more
from studies.messages import shown

MOST_POINTS = 1_000_000_000
MOST_DRAWN = 10_000_000
"""Points drawn at random in all cells of a refined grid, which are in memory together."""
MOST_LETTERS = 100
"""Of the name of a state or of an end condition."""


Whole = Annotated[StrictInt, Field(ge=-(2**63), lt=2**63)]
Name = Annotated[StrictStr, Field(max_length=MOST_LETTERS)]


Names = Annotated[tuple[Name, ...], BeforeValidator(one_or_more)]


class About(Table):
    """`[study]`: the name of the output and what the dataset says about itself."""

    name: Annotated[StrictStr, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=100)]
    title: StrictStr = ""
    summary: StrictStr = ""
    creator_name: StrictStr = ""
    institution: StrictStr = ""
    license: StrictStr = ""
    keywords: StrictStr = ""
    references: StrictStr = ""


class Grid(Table):
    """`[grid]`: end conditions, half gaps, and loads or shortenings, all of them or refined."""

    ends: Annotated[Names, Field(min_length=1)]
    # Before the axes, whose labels it decides.
    refine: Refine | None = None
    H: Axis
    P: Axis | None = None
    shortening: Axis | None = None

    @field_validator("ends")
    @classmethod
    def _known_ends(cls, ends):
        names = tuple(str(parse_ends(name)) for name in ends)
        if len(set(names)) < len(names):
            raise ValueError(f"{shown(list(ends))} names an end condition twice")
        return names

    @field_validator("H")
    @classmethod
    def _between_the_walls(cls, H):
        if not (H[0] >= SMALLEST_GAP and H[-1] < 0.5):
            raise ValueError(
                f"values run from {H[0]!r} to {H[-1]!r}; keep 0 < H < 0.5, from {SMALLEST_GAP:g} on"
            )
        return H

    @field_validator("P")
    @classmethod
    def _finite_loads(cls, P):
        if P and not (P[0] >= 0 and P[-1] <= LARGEST_LOAD):
            raise ValueError(f"values run from {P[0]!r} to {P[-1]!r}; keep 0 <= P <= 1e6")
        return P

    @field_validator("shortening")
    @classmethod
    def _possible_shortenings(cls, shortening):
        if shortening and not (shortening[0] >= 0 and shortening[-1] < 2):
            raise ValueError(
                f"values run from {shortening[0]!r} to {shortening[-1]!r}; keep 0 <= shortening < 2"
            )
        if lost := [value for value in shortening if 0 < value < SMALLEST_SHORTENING]:
            raise ValueError(
                f"{lost[0]!r} is lost in the rounding of the length; use 0 or from {SMALLEST_SHORTENING:g} on"
            )
        return shortening

    @model_validator(mode="after")
    def _one_control(self):
        if (self.P is None) == (self.shortening is None):
            raise ValueError("give either P or shortening: one is prescribed, the other follows")
        return self

    @model_validator(mode="after")
    def _countable(self):
        points = len(self.ends) * len(self.H) * len(self.prescribed)
        if points > MOST_POINTS:
            raise ValueError(
                f"{points:,} points are too many; keep ends × H × {self.control} to {MOST_POINTS:,}"
            )
        if self.refine:
            cells = math.prod((len(axis) - 1) // self.refine.stride for axis in (self.H, self.prescribed))
            if cells * self.refine.audit > MOST_DRAWN:
                raise ValueError(
                    f"refine.audit = {self.refine.audit} in {cells:,} cells are too many points; keep to "
                    f"{MOST_DRAWN:,}"
                )
        return self

    @field_serializer("H", "P", "shortening")
    def _as_in_the_file(self, labels):
        return self.refine.coarsest(labels) if self.refine and labels else labels

    @property
    def control(self):
        """What is prescribed, "P" or "shortening"."""
        return "P" if self.shortening is None else "shortening"

    @property
    def prescribed(self):
        """Labels of what is prescribed."""
        return self.P if self.shortening is None else self.shortening


class States(Table):
    """`[states]`: either all up to a number of contacts, or a list of names."""

    max_contacts: Whole | None = None
    names: Names | None = None

    @model_validator(mode="after")
    def _one_way(self):
        if (self.max_contacts is None) == (self.names is None):
            raise ValueError("give either max_contacts or names")
        if self.names is not None and not self.names:
            raise ValueError("names is empty; name at least one state")
        if self.max_contacts is not None:
            states(max_contacts=self.max_contacts)
        return self


class Solve(Table):
    """`[solve]`: how states are computed; `links`, `clamp` and `stiffness` are those of a chain."""

    method: Literal["exact", "chain"] = "exact"
    links: Whole | None = None
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


class Outputs(Table):
    """`[outputs]`: what is stored beside the maps."""

    eigenvalues: Annotated[StrictInt, Field(ge=0, le=100)] = 0
    frequencies: Annotated[StrictInt, Field(ge=0, le=100)] = 0
    shapes: Annotated[StrictInt, Field(ge=0, le=100_000)] = 0
    # None rather than false: a study that does not ask for them is the one it was before they were known.
    transitions: StrictBool | None = None

    @field_validator("shapes")
    @classmethod
    def _a_line_needs_two_points(cls, shapes):
        if shapes == 1:
            raise ValueError("1 sample is no shape; use 0 for none or at least 2")
        return shapes

    @field_validator("transitions")
    @classmethod
    def _not_asked_for(cls, transitions):
        return transitions or None
