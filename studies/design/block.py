"""What is computed at one time: a block of points or of gaps, and the task there.

Not here: how a grid is cut into blocks (`plan`), how one is computed (`evaluate`).
"""

from math import prod
from typing import NamedTuple

import numpy as np


class Block(NamedTuple):
    """A rectangle of the grid: one end condition, some half gaps, some loads or shortenings, every state.

    `place` is the position (ends, first H, first of those prescribed) in the grid; `control` says what is
    prescribed.
    """

    place: tuple[int, int, int]
    ends: str
    H: tuple[float, ...]
    control: str
    prescribed: tuple[float, ...]

    @property
    def shape(self):
        """Extent of its arrays along ends, H and the control."""
        return 1, len(self.H), len(self.prescribed)

    @property
    def points(self):
        """Number of grid points."""
        return prod(self.shape)

    @property
    def key(self):
        """Place and extent in the grid."""
        return *self.place, *self.shape[1:]

    def labels(self):
        """Labels H and those prescribed of every point, in the order of the arrays, shape (points,)."""
        return tuple(grid.ravel() for grid in np.meshgrid(self.H, self.prescribed, indexing="ij"))


class Scattered(Block):
    """Points of the grid, wherever they are, in one row: `H` and `prescribed` have the labels of each."""

    __slots__ = ()

    @property
    def shape(self):
        """Extent of its arrays along ends, H and the control."""
        return 1, 1, len(self.prescribed)

    def labels(self):
        """Labels H and those prescribed of every point, shape (points,)."""
        return np.array(self.H), np.array(self.prescribed)


class Gaps(NamedTuple):
    """Half gaps with one end condition, at which the events of states are found.

    The events are those between the first and the last load of the study, which are `prescribed`; `control`
    is "P".
    """

    place: tuple[int, int, int]
    ends: str
    H: tuple[float, ...]
    control: str
    prescribed: tuple[float, float]

    @property
    def points(self):
        """Number of gaps."""
        return len(self.H)

    @property
    def key(self):
        """Place and extent in the grid: without loads, so no block of points has the same."""
        return *self.place, len(self.H), 0


class Task(NamedTuple):
    """What is computed at every grid point.

    With `every_root`, all roots of the words among `names`, which are then those of first roots;
    `outputs` and `method` are those of the study.
    """

    names: tuple[str, ...]
    every_root: bool
    outputs: object
    method: object

    def in_order(self, found):
        """Names that label a dataset in which these were found: by name, then by root; never none."""
        if not self.every_root:
            return self.names
        place = {name: number for number, name in enumerate(self.names)}

        def rank(name):
            first, _, root = name.partition(":")
            return place[first], int(root or 1)

        return tuple(sorted(set(found), key=rank)) or self.names[:1]
