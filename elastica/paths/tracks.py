"""States followed at several gaps along their branches, on which everything is smooth in one parameter t.

t is κ/√p, in the line regime the load, for free shapes with λ = 0 −ln(1 − m). Where a function of t vanishes
something happens to the state: which events these are, and what comes after them, is told by `transitions`.
"""

from collections import Counter
from typing import NamedTuple

import numpy as np

from elastica.codes import Event
from elastica.control import CONTROLS
from elastica.equilibria.branch import Points, bordered, settle, steepest_angle
from elastica.equilibria.buckled import free_branch, periodic
from elastica.equilibria.euler import euler_root
from elastica.equilibria.line import line_roots
from elastica.equilibria.periods import Group, groups, most_periods
from elastica.equilibria.roots import spread
from elastica.equilibria.shortening_control import MOST_PERIODS
from elastica.equilibria.tracing import Loads
from elastica.pendulum.elliptic import integrals
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solution import solution_of

NEAR_FOLD = 8
"""Further samples of line states between the last load looked at and their fold."""
AT_RIGHT_ANGLE, AT_FOLD = 1e-3, 1e-6
"""How near to 90°, and to dP/dk = 0, a branch is cut that ends there."""
JUST_BUCKLED = 1e-5
"""Gap from which on shapes with λ are known at the wall: before, their load is that of Euler to rounding."""
LOOP = 4.0
"""−ln(1 − m) of a free shape just beyond κ/√p = 1.98."""


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
        yield _free_track(state, ends, H, control, P_max)
        return
    loads = Loads(Scene(ends, H), np.sqrt(FOUR_PI_SQUARED * P_max))
    for periods in range(min(MOST_PERIODS, most_periods(state, ends, loads.table.p)) + 1):
        for group in groups(state, ends, periods):
            samples = _line_samples(loads, group.segments) if state.line else loads.trace(group.segments)
            make = _line_track if state.line else _point_track
            for pattern in group.patterns:
                yield make(state, ends, H, control, group._replace(patterns=(pattern,)), samples)


def _functions(solution, *more):
    """Functions of a track, one row each: reactions, clearance, 90° less the angle, then others."""
    overhang = np.pi / 2 - solution.max_slope
    columns = (solution.clearance, overhang, *more)
    return np.concatenate([solution.reaction.T, *(values[None] for values in columns)])


def _point_track(state, ends, H, control, group, branch):
    def at(samples, t):
        seed = branch.at(samples)
        gaps = H[seed.gap]
        points = settle(group.segments, Scene(ends, gaps), t, seed.p, seed.lam)
        return _described(state, ends, control, group, gaps, points)

    contacts = (Event.REACTION_LOST,) * len(state.word)
    first = np.flatnonzero(np.diff(branch.gap, prepend=-1))
    last = np.flatnonzero(np.diff(branch.gap, append=-1))
    edges = np.concatenate([first, last])
    edge = branch.at(edges)
    slope = steepest_angle(group.segments, Points(None, edge.k, edge.p, edge.lam))
    # A branch that is steep to its end was followed to the fold, or was left as a taut string.
    reasons = {
        int(i): reason
        for i, reason in zip(
            edges,
            np.select(
                [edge.k == 0, np.abs(slope - np.pi / 2) < AT_RIGHT_ANGLE, np.abs(edge.load_k) < AT_FOLD],
                [Event.POINT_TO_LINE, Event.RIGHT_ANGLE, Event.FOLD],
                -1,
            ),
            strict=True,
        )
        if reason >= 0
    }
    events = (*contacts, Event.WALL_TOUCHED, Event.RIGHT_ANGLE, Event.FOLD)
    return Track(branch.gap, branch.k, at, events, reasons)


def _free_track(state, ends, H, control, P_max):
    """A free shape. Where λ = 0, t is −ln(1 − m), which goes on where κ/√p = 2√m does not any more."""
    ((kind, *_),) = plain = state.segments(ends)
    onset = float(euler_root(state.mode, ends))
    k, p, ratio, _, _ = free_branch(kind, onset)
    # A strip with κ/√p < H touches no wall.
    nodes = np.broadcast_to(k, (H.size, k.size)).copy()
    nodes[:, 0] = np.minimum(np.maximum(H, 0 if periodic(kind) else JUST_BUCKLED), k[1]) / 2
    if periodic(kind):
        longest = max(2 * np.sqrt(FOUR_PI_SQUARED * P_max) / kind.first, LOOP)
        loops = np.broadcast_to(np.arange(LOOP, longest + 1), (H.size, int(longest + 1 - LOOP) + 1))
        nodes = np.concatenate([-np.log1p(-(nodes**2) / 4), loops], axis=1)
    gap, node = (grid.ravel() for grid in np.indices(nodes.shape))
    group = Group(Counter(plain), ((0,),))

    def at(samples, t):
        gaps = H[gap[samples]]
        if periodic(kind):
            m1 = np.exp(-t)
            load = (kind.first * integrals(m1, 0 * t, 1 + 0 * t)[0]) ** 2
            points = Points(np.ones(t.size, bool), 2 * np.sqrt(-np.expm1(-t)), load, np.zeros((1, t.size)))
        else:
            seed = np.maximum(node[samples], 1)
            lam = (ratio[seed] * t * p[seed])[None]
            points = settle(group.segments, Scene(ends, gaps), t, p[seed], lam)
        return _described(state, ends, control, group, gaps, points)

    events = (Event.WALL_TOUCHED, Event.RIGHT_ANGLE, Event.FOLD, Event.ENDS_MEET)
    return Track(gap, nodes.ravel(), at, events, {})


def _described(state, ends, control, group, H, points):
    """What a track gives at points of the point regime."""
    linear = bordered(group.segments, points.p, Scene(ends, H), points.k, points.lam)
    found = spread(state.segments(ends), group, np.arange(H.size), points.roots, points.p)
    solution = solution_of(state, Scene(ends, H), CONTROLS[control], None, found)
    slope = linear.load_k if control == "P" else linear.shortening_k
    apart = (1 - solution.shortening,) if state.mode else ()
    return solution, _functions(solution, slope, *apart), points.found


def _line_samples(loads, segments):
    """Loads at which every segment of a line state exists: gap and p of each, in order, up to the fold.

    Next to the fold everything changes with the root of the distance from it.
    """
    _, last, folds = loads.line_range(segments)
    gap, p = loads.gap, loads.table.p
    below = np.flatnonzero(p < last[gap])
    gap, p = gap[below], p[below]
    nearest = np.full(last.size, loads.first)
    np.maximum.at(nearest, gap, p)
    toward = nearest + (last - nearest) * (1 - (1 - np.linspace(0, 1, NEAR_FOLD + 1)[1:, None]) ** 2)
    toward[-1] = last
    gap = np.concatenate([gap, *[np.arange(last.size)] * NEAR_FOLD])
    p = np.concatenate([p, toward.ravel()])
    order = np.lexsort((p, gap))
    gap, p = gap[order], p[order]
    ends = np.flatnonzero(np.diff(gap, append=-1))
    return gap, p, {int(i): Event.FOLD for i in ends[folds[gap[ends]]]}


def _line_track(state, ends, H, control, group, samples):
    gap, p, folds = samples

    def at(samples, t):
        gaps = H[gap[samples]]
        roots = line_roots(group.segments, t, Scene(ends, gaps))
        found = spread(state.segments(ends), group, np.arange(t.size), roots, t)
        solution = solution_of(state, Scene(ends, gaps), CONTROLS[control], None, found)
        flat = solution.flat_length
        return solution, _functions(solution, flat, np.sqrt(t) * flat - 2 * np.pi), roots.found

    contacts = (Event.REACTION_LOST,) * len(state.word)
    events = (*contacts, Event.WALL_TOUCHED, Event.RIGHT_ANGLE, Event.POINT_TO_LINE, Event.FLAT_BUCKLES)
    return Track(gap, p, at, events, folds)
