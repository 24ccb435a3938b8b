"""Axes of a grid: labels from a list or a range, coarse or refined.

Not here: the grid that they make (`tables`).
"""

import math
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StrictInt, ValidationInfo

from studies.messages import shown
from studies.schema import canonical

MOST_LABELS = 1_000_000
LARGEST_NUMBER = 1e300
MOST_LEVELS, MOST_AUDITED = 8, 1000


class Table(BaseModel):
    """A table of a study file: it has these keys and no others, and it does not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _number(value):
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or abs(value) > LARGEST_NUMBER or math.isnan(value):
        raise ValueError(f"{shown(value)} is not a finite number; write one such as 0.1")
    return value


Number = Annotated[float, BeforeValidator(_number)]


def one_or_more(value):
    """A list, of one if a text or a number stands alone."""
    return [value] if isinstance(value, (str, int, float)) else value


class Range(Table):
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


class Refine(Table):
    """`refine = { levels, audit }`: split cells in halves, `levels` times, where the stable states change.

    The ranges of the axes then count the coarse grid; the labels are those of the finest. `audit` points
    are drawn at random in every coarse cell, for what lies between its corners.
    """

    levels: Annotated[StrictInt, Field(ge=1, le=MOST_LEVELS)]
    audit: Annotated[StrictInt, Field(ge=0, le=MOST_AUDITED)] = 1

    @property
    def stride(self):
        """Steps of the finest grid along a side of a coarse cell."""
        return 2**self.levels

    def finest(self, axis):
        """The range of the finest labels from that of the coarse ones."""
        if not isinstance(axis, dict):
            raise ValueError("only a range can be refined; write { start = …, stop = …, num = … }")
        coarse = Range(**axis)
        if coarse.num < 2:
            raise ValueError(f"num = {coarse.num} leaves no cell to refine; use at least 2, or no refine")
        num = (coarse.num - 1) * self.stride + 1
        if num > MOST_LABELS:
            raise ValueError(
                f"num = {coarse.num} gives {num:,} labels with refine.levels = {self.levels}; keep them to "
                f"{MOST_LABELS:,}"
            )
        ends = {"start": canonical(coarse.start), "stop": canonical(coarse.stop)}
        return coarse.model_copy(update=ends | {"num": num})

    def coarsest(self, labels):
        """The range of the coarse labels from the finest labels, as a study file has it."""
        ends = {"start": labels[0], "stop": labels[-1]}
        linear = _canonical_labels(Range(**ends, num=len(labels)).values())
        num = (len(labels) - 1) // self.stride + 1
        return {**ends, "num": num, "spacing": "linear" if labels == linear else "log"}


def _canonical_labels(values):
    return tuple(canonical(_number(float(v) if isinstance(v, np.floating) else v)) for v in values)


def _axis(value, info: ValidationInfo):
    """Canonical, strictly increasing labels from a list or a range, which a refined grid makes finest."""
    if refine := info.data.get("refine"):
        value = refine.finest(value).values()
    elif isinstance(value, dict):
        value = Range(**value).values()
    if not isinstance(value, str):
        value = one_or_more(value)
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise ValueError(f"{shown(value)} is neither a list nor {{ start = …, stop = …, num = … }}")
    labels = _canonical_labels(value)
    if not labels:
        raise ValueError("the axis is empty; give at least one value")
    for before, after in pairwise(labels):
        if after <= before:
            raise ValueError(f"{after!r} follows {before!r}; values must increase")
    return labels


Axis = Annotated[tuple[float, ...], BeforeValidator(_axis)]
