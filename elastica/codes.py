"""Codes of the flags that solutions and datasets carry."""

from enum import IntEnum


class Status(IntEnum):
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


class Stability(IntEnum):
    """Verdict on a solved state, from the second variation with moving contacts."""

    STABLE = 0
    UNSTABLE = 1
    UNSTABLE_THIRD_ORDER = 2
    NEUTRAL_FAMILY = 3
    CRITICAL = 4
    NOT_SOLVED = -1


class Event(IntEnum):
    """What happens to a state."""

    BUCKLES = 0
    WALL_TOUCHED = 1
    REACTION_LOST = 2
    POINT_TO_LINE = 3
    FLAT_BUCKLES = 4
    FOLD = 5
    RIGHT_ANGLE = 6
