"""Extra full periods: how they can be shared out among the segments of a word.

A segment between a wall and the opposite wall, or an end, may contain any number of extra full periods of
its pendulum. Which segments have them does not change the total length, only how many of each kind do: so
patterns are solved in groups that have the same kinds. A segment that returns to its own wall has none:
its period would touch that wall, which is the word with the letter repeated.
"""

from collections import Counter
from functools import cache
from typing import NamedTuple

import numpy as np

MOST_PERIODS, MOST_PATTERNS = 8, 1000
SHORTEST_PERIOD = 5.49
"""√p times the shortest period below 90°, 4K(sin²(π/8))/√(√2 p)."""


class Group(NamedTuple):
    """Distinct segments with their number, and every pattern of periods (A to B) that has them."""

    segments: Counter
    patterns: tuple


@cache
def groups(state, ends, periods):
    """Patterns with this many extra periods in all, grouped by the kinds of segment they have.

    Parameters
    ----------
    state : State
        A contact word, or a free shape, which has no place for extra periods.
    ends : Ends
    periods : int

    Returns
    -------
    tuple of Group
        Of patterns that are mirror images of each other, one.
    """
    plain = state.segments(ends)
    places = [i for i, segment in enumerate(plain) if segment.start != segment.end]
    symmetric = state.symmetric(ends)
    found: dict[tuple, list[tuple]] = {}
    for shares in _compositions(periods, len(places)):
        pattern = [0] * len(plain)
        for place, share in zip(places, shares, strict=True):
            pattern[place] = share
        pattern = tuple(pattern)
        if symmetric and pattern < pattern[::-1]:
            continue
        # Sorted, so that words with the same segments in another order give identical numbers.
        kinds = tuple(sorted(state.segments(ends, pattern)))
        found.setdefault(kinds, []).append(pattern)
    return tuple(Group(Counter(kinds), tuple(patterns)) for kinds, patterns in found.items())


def room(p):
    """Extra periods that a strip under thrusts p has room for, of those that are searched at most."""
    return np.minimum(np.floor(np.sqrt(p) / SHORTEST_PERIOD), MOST_PERIODS)


def most_periods(state, ends, p):
    """Extra periods that a strip under thrusts up to max(p) has room for, within what is searched.

    Searched are up to 8 extra periods in all, fewer for long words: no more than have 1,000 patterns.
    """
    places = sum(segment.start != segment.end for segment in state.segments(ends))
    most = np.max(room(p), initial=0)
    total, count = 0, 1
    while total + 1 <= most:
        count *= (total + places) / (total + 1)
        if count > MOST_PATTERNS:
            break
        total += 1
    return total


def unsearched(state, p, scene):
    """Where a strip that reaches its walls has room for more periods than are searched, shape (n,)."""
    reach = scene.reach(Counter(state.segments(scene.ends)))
    return (np.sqrt(p) >= SHORTEST_PERIOD * (most_periods(state, scene.ends, np.inf) + 1)) & (reach < 1)


def _compositions(total, places):
    """Every way to write `total` as a sum of `places` whole numbers, first ones large first."""
    if not places:
        if not total:
            yield ()
        return
    for first in range(total, -1, -1):
        for rest in _compositions(total - first, places - 1):
            yield (first, *rest)
