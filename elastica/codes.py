"""Codes of the flags that solutions and datasets carry."""

from enum import IntEnum

import numpy as np


class Code(IntEnum):
    """A code that prints as its name."""

    def __str__(self) -> str:
        """Name as datasets spell it: "stable", not 0."""
        return self.name.lower()

    @classmethod
    def names(cls, codes: np.ndarray) -> np.ndarray:
        """Names of an array of codes, shape of `codes`."""
        codes, place = np.unique(codes, return_inverse=True)
        return np.array([str(cls(code)) for code in codes], "<U32")[place]


class Status(Code):
    """What became of a state at a point.

    NO_EQUILIBRIUM says that the branches of the state have all ended on this side of the point: folded, gone
    flat, bifurcated. NOT_FOLLOWED says that the search ended before it could tell, mostly at 90°: the state
    may well be there.
    """

    SOLVED = 0
    NO_EQUILIBRIUM = 1
    INADMISSIBLE = 2
    FAILED = 3
    NOT_FOLLOWED = 4
    NOT_COMPUTED = -1


class Stability(Code):
    """Verdict on a solved state, from the second variation with moving contacts."""

    STABLE = 0
    UNSTABLE = 1
    UNSTABLE_THIRD_ORDER = 2
    NEUTRAL_FAMILY = 3
    CRITICAL = 4
    NOT_SOLVED = -1


class Event(Code):
    """What happens to a state."""

    BUCKLES = 0
    WALL_TOUCHED = 1
    REACTION_LOST = 2
    POINT_TO_LINE = 3
    FLAT_BUCKLES = 4
    FOLD = 5
    RIGHT_ANGLE = 6
    ENDS_MEET = 7


CODES: dict[str, type[Code]] = {"status": Status, "stability": Stability, "event": Event}
"""Which codes the arrays of these names hold."""
