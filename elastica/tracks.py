"""States followed at several gaps along their branches, on which everything is smooth in one parameter t.

t is κ/√p, in the line regime the load. Where a function of t vanishes something happens to the state: which
events these are, and what comes after them, is told by `transitions`.
"""

from collections import Counter
from typing import NamedTuple

import numpy as np

from elastica.alternating import alternating
from elastica.branch import Loads, bordered, free_branch, settle
from elastica.codes import Event
from elastica.equilibrium import alternates, spread
from elastica.euler import euler_root
from elastica.newton import Roots
from elastica.patterns import Group, groups, most_periods
from elastica.scales import FOUR_PI_SQUARED
from elastica.shortening_control import MOST_PERIODS
from elastica.solution import solution_of
from elastica.sweep import line_force


class Track(NamedTuple):
    """One pattern of a state followed at several gaps.

    `gap` (m,) and `t` (m,) are its samples in order; `at(samples, t)` solves it at other t, starting from
    samples, and gives the solution, the functions whose roots are `events` (functions, m), and whether it
    could be solved (m,). `ends_at` says which sample is the end of the branch, and for what reason.
    """

    gap: np.ndarray
    t: np.ndarray
    at: object
    events: tuple
    ends_at: dict


def tracks(state, ends, H, control, P_max):
    """Each pattern of periods of a state, followed."""
    if state.mode:
        yield _free_track(state, ends, H, control)
        return
    loads = Loads(H, np.sqrt(FOUR_PI_SQUARED * P_max))
    for periods in range(min(MOST_PERIODS, most_periods(state, ends, loads.table.p)) + 1):
        for group in groups(state, ends, periods):
            if state.line:
                samples = _line_samples(loads, group.segments)
            else:
                known = None
                if not periods and alternates(state, ends):
                    roots = alternating(group.segments, loads.table)
                    place = np.flatnonzero(roots.found)
                    known = place, roots.at(place)
                samples = loads.trace(group.segments, known)
            for pattern in group.patterns:
                make = _line_track if state.line else _point_track
                yield make(state, ends, H, control, group._replace(patterns=(pattern,)), samples)


def _functions(solution, *more):
    """Functions of the admissible range, one row each: reactions and clearance, then others."""
    reaction = solution.reaction.T
    return np.concatenate([reaction, solution.clearance[None], *(values[None] for values in more)])


def _point_track(state, ends, H, control, group, branch):
    def at(samples, t):
        seed = branch.at(samples)
        gaps = H[seed.gap]
        return _settled(state, ends, control, group, gaps, gaps, t, seed.p, seed.lam)

    contacts = (Event.REACTION_LOST,) * len(state.word)
    first = np.flatnonzero(np.diff(branch.gap, prepend=-1))
    last = np.flatnonzero(np.diff(branch.gap, append=-1))
    reasons = {
        int(i): Event.POINT_TO_LINE if branch.k[i] == 0 else Event.RIGHT_ANGLE for i in (*first, *last)
    }
    return Track(branch.gap, branch.k, at, (*contacts, Event.WALL_TOUCHED, Event.FOLD), reasons)


def _free_track(state, ends, H, control):
    ((kind, *_),) = plain = state.segments(ends)
    onset = float(euler_root(state.mode, ends))
    k, p, ratio, _, _ = free_branch(kind, onset)
    gap, node = (grid.ravel() for grid in np.meshgrid(np.arange(H.size), np.arange(1, k.size), indexing="ij"))
    group = Group(Counter(plain), ((0,),))

    def at(samples, t):
        seed = node[samples]
        lam = (ratio[seed] * t * p[seed])[None]
        gaps = H[gap[samples]]
        return _settled(state, ends, control, group, np.zeros_like(gaps), gaps, t, p[seed], lam)

    return Track(gap, k[node], at, (Event.WALL_TOUCHED, Event.FOLD), {})


def _settled(state, ends, control, group, rise, H, t, p, lam):
    """What a track gives at κ/√p = t in the point regime, started from p and λ; `rise` of each segment."""
    points = settle(group.segments, rise, t, p, lam)
    linear = bordered(group.segments, points.p, rise, t, points.lam)
    found = spread(state.segments(ends), group, np.arange(t.size), points.roots, points.p)
    solution = solution_of(state, ends, control, None, H, found)
    slope = linear.load_k if control == "P" else linear.shortening_k
    return solution, _functions(solution, slope), points.found


def _line_samples(loads, segments):
    """Loads at which every segment of a line state exists: gap and p of each, in order."""
    p, H = loads.table.p, loads.table.H
    there = np.all([np.isfinite(line_force(segment, p, H)) for segment in segments], axis=0)
    place = np.flatnonzero(there)
    place = place[np.lexsort((p[place], loads.gap[place]))]
    return loads.gap[place], p[place]


def _line_track(state, ends, H, control, group, samples):
    gap, p = samples

    def at(samples, t):
        gaps = H[gap[samples]]
        lam = np.stack([line_force(segment, t, gaps) for segment in group.segments])
        good = np.isfinite(lam).all(axis=0)
        found = spread(state.segments(ends), group, np.arange(t.size), Roots(good, np.zeros_like(t), lam), t)
        solution = solution_of(state, ends, control, None, gaps, found)
        flat = solution.flat_length
        return solution, _functions(solution, flat, np.sqrt(t) * flat - 2 * np.pi), good

    contacts = (Event.REACTION_LOST,) * len(state.word)
    events = (*contacts, Event.WALL_TOUCHED, Event.POINT_TO_LINE, Event.FLAT_BUCKLES)
    return Track(gap, p, at, events, {})
