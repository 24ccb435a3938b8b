"""The equilibria of a state as curves, on which everything is a smooth function of one parameter t.

t is κ/√p, on which the load has no folds (`equilibria.branch`); in the line regime, where κ = 0, the thrust;
for free shapes with λ = 0 it may also be −ln(1 − m), which goes on where κ/√p = 2√m does not any more. Each
event is a root of such a function:

    wall touched      H − |y| of a bump                   reaction lost     μ of a contact
    point to line     κ, or in the line regime the length left over
    fold              dP/dt, at prescribed shortening dΔL/dt
    flat buckles      √p ℓ_f − 2π
    right angle       90° − |θ|, beyond which only branches that alternate, lines and free shapes are followed
    ends meet         1 − ΔL of a free shape

Not here: all curves of a state (`tracing`); on which side of an event it is, and what it meets there
(`transitions`); where a strip stays on a curve (`stretch`).
"""

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.codes import Event, Status
from elastica.control import Control
from elastica.equilibria.branch import Points, bordered, settle
from elastica.equilibria.line import line_roots
from elastica.equilibria.periods import Group
from elastica.equilibria.roots import spread
from elastica.pendulum.elliptic import integrals
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solution import solution_of
from elastica.solving import solve
from elastica.state import State

POINTS = 16
"""Points solved at once ahead of the last one that is known."""
FIRST, WIDEST, RESOLUTION = 0.05, 0.4, 1e-15
"""Interval that they span, of κ/√p or √p: at first, at most, and when the end is found."""
SAME = 1e-6
"""Relative difference of κ/√p, and of the load, of one and the same point."""


class Events(NamedTuple):
    """What happens on curves, one entry each.

    Attributes
    ----------
    event : ndarray of int, shape (n,)
        Codes of `Event`.
    near : ndarray of int, shape (n,)
        Known point beside it.
    t, low, high : ndarray, shape (n,)
        Where it happens, and the interval of known points around.
    """

    event: np.ndarray
    near: np.ndarray
    t: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, eq=False)
class Curve:
    """The equilibria with one pattern of extra periods, one curve for each gap of a scene, in t = κ/√p.

    Attributes
    ----------
    state : State
        Without the number of a root.
    scene : Scene
        With the gaps, shape (gaps,).
    control : Control
    group : Group
        Its distinct segments, and the one pattern.
    gap : ndarray of int, shape (m,)
        Which gap each known point belongs to.
    t : ndarray, shape (m,)
    points : Points
        The known points, from which others are solved; None where t alone tells.
    ends_at : dict of int to Event
        Known points at which a curve ends, and for what reason.
    """

    power: ClassVar[int] = 1
    """t is this power of what changes evenly: κ/√p, and √p in the line regime."""

    state: State
    scene: Scene
    control: Control
    group: Group
    gap: np.ndarray
    t: np.ndarray
    points: Points | Any
    ends_at: dict[int, Event]

    def at(self, t, near):
        """The curve at t (n,), solved from known points (n,).

        Returns
        -------
        Solution, Points
        """
        scene = self.scene.at(self.gap[near])
        with np.errstate(all="ignore"):
            points = self._solved(t, near, scene)
            plain = self.state.segments(scene.ends)
            found = spread(plain, self.group, np.arange(t.size), points.roots, points.p)
            return solution_of(self.state, scene, self.control, None, found), points

    @property
    def steps(self):
        """What changes evenly along the curve, κ/√p or √p, at the known points."""
        return self.t ** (1 / self.power)

    def passes(self, other):
        """Whether the only known point of another curve lies between those of this one, at the same gap."""
        if (self.state, self.group) != (other.state, other.group):
            return False
        steps, (step,) = self.steps, other.steps
        if not steps[0] * (1 - SAME) <= step <= steps[-1] * (1 + SAME):
            return False
        near = np.abs(steps - step).argmin(keepdims=True)
        return bool(np.abs(self.at(other.t, near)[1].p / other.points.p - 1)[0] <= SAME)

    def followed(self, holds, resolution=RESOLUTION):
        """The curve from its only known point in both directions, for as long as something holds.

        Parameters
        ----------
        holds : callable
            What: of a Solution (n,), gives bool (n,).
        resolution : float
            Part of κ/√p or √p within which the ends are found.

        Returns
        -------
        curve : Curve
            With the points on the way.
        cut : tuple of bool
            Whether at its first and at its last point following ends, but not necessarily what holds: no
            branch is found beyond, as it may happen beyond 90°.
        """
        (below, cut_below), (above, cut_above) = (self._reach(holds, way, resolution) for way in (-1, 1))
        t = np.concatenate([below.t[::-1], above.t[1:]])
        known = below.points.at(slice(None, None, -1)), above.points.at(slice(1, None))
        return self._known(t, *known), (cut_below, cut_above)

    def _reach(self, holds, direction, resolution):
        """The curve with the points in one direction of t, and whether it is cut there."""
        curve, (last,) = self, self.steps
        width, narrowing = FIRST, False
        while width > resolution * max(1.0, last) and not (direction < 0 and last == 0):
            ahead = last + direction * width * np.arange(1, POINTS + 1) / POINTS
            ahead = np.unique(np.maximum(ahead, 0))[::direction]
            t = ahead**self.power
            solution, points = curve.at(t, np.full(t.size, curve.t.size - 1))
            lost = np.flatnonzero(~(points.found & holds(solution)))
            kept = lost[0] if lost.size else t.size
            if kept:
                on = np.concatenate([curve.t, t[:kept]])
                curve, last = curve._known(on, curve.points, points.at(slice(kept))), ahead[kept - 1]
            # Next to its end a verdict may be noise: once the state was there and lost, the end is enclosed.
            narrowing |= lost.size > 0 and points.found[kept] and solution.status[kept] != Status.NOT_FOLLOWED
            width = width / POINTS if lost.size or narrowing else min(2 * width, WIDEST)
        return curve, not narrowing and last > 0

    def _known(self, t, *parts):
        """The curve at its only gap with other known points."""
        points = Points(*(np.concatenate(fields, axis=-1) for fields in zip(*parts, strict=True)))
        return replace(self, gap=np.zeros(t.size, int), t=t, points=points)

    def events(self):
        """The ends of the curves, then what happens between two known points.

        Returns
        -------
        Events
        """
        ends = sorted(self.ends_at.items(), key=lambda end: end[1])
        at, event = np.array(ends, int).reshape(-1, 2).T
        after = np.minimum(at + 1, self.t.size - 1)
        inner = np.where((after > at) & (self.gap[after] == self.gap[at]), after, at - 1)
        t, beside = self.t[at], self.t[inner]
        ends = event, at, t, np.minimum(t, beside), np.maximum(t, beside)
        return Events(*(np.concatenate(pair) for pair in zip(ends, self._roots(), strict=True)))

    def _roots(self):
        """Roots of the functions between neighbours, as `Events`."""
        solution, points = self.at(self.t, np.arange(self.t.size))
        values = np.where(points.found, self._functions(solution, points), np.nan)
        kinds = np.array(self._conditions)
        for end, event in self.ends_at.items():
            # What ends a branch is zero there to rounding.
            values[kinds == event, end] = np.nan
        sign = np.where(np.isnan(values), np.nan, np.where(values < 0, -1.0, 1.0))
        which, left = np.nonzero((self.gap[:-1] == self.gap[1:]) & (sign[:, :-1] * sign[:, 1:] < 0))

        def function(t, which, left):
            return self._functions(*self.at(t, left))[which, np.arange(t.size)]

        low, high = self.t[left], self.t[left + 1]
        root = find_root(function, (low, high), args=(which, left))
        # A point that is itself a root to rounding brackets nothing.
        nearer = np.where(np.abs(values[which, left]) < np.abs(values[which, left + 1]), low, high)
        return Events(kinds[which], left, np.where(root.success, root.x, nearer), low, high)

    @property
    def _conditions(self):
        """The event at a root of each of the functions."""
        contacts = (Event.REACTION_LOST,) * len(self.state.word)
        apart = (Event.ENDS_MEET,) if self.state.mode else ()
        return (*contacts, Event.WALL_TOUCHED, Event.RIGHT_ANGLE, Event.FOLD, *apart)

    def _functions(self, solution, points):
        """Functions of t whose roots are events, shape (conditions, n)."""
        scene = self.scene._replace(H=solution.H)
        linear = bordered(self.group.segments, points.p, scene, points.k, points.lam)
        slope = linear.shortening_k if self.control.fixes_shortening else linear.load_k
        apart = (1 - solution.shortening,) if self.state.mode else ()
        return _stacked(solution, slope, *apart)

    def _solved(self, t, near, scene):
        """Points at t, scene there."""
        return settle(self.group.segments, scene, t, self.points.p[near], self.points.lam[:, near])


def _stacked(solution, *more):
    """Reactions, clearance and what the angle leaves of 90°, then others: one row each."""
    columns = (solution.clearance, np.pi / 2 - solution.max_slope, *more)
    return np.concatenate([solution.reaction.T, *(values[None] for values in columns)])


class LineCurve(Curve):
    """The line regime: κ = 0 and t is the thrust p."""

    power = 2

    @property
    def _conditions(self):
        contacts = (Event.REACTION_LOST,) * len(self.state.word)
        return (*contacts, Event.WALL_TOUCHED, Event.RIGHT_ANGLE, Event.POINT_TO_LINE, Event.FLAT_BUCKLES)

    def _functions(self, solution, points):
        flat = solution.flat_length
        return _stacked(solution, flat, np.sqrt(points.p) * flat - 2 * np.pi)

    def _solved(self, t, near, scene):
        roots = line_roots(self.group.segments, t, scene)
        return Points(roots.found, roots.kappa, t, roots.lam)


class LoopCurve(Curve):
    """Free shapes with λ = 0: t is −ln(1 − m)."""

    def _solved(self, t, near, scene):
        (segment,) = self.group.segments
        m1 = np.exp(-t)
        p = (segment.kind.first * integrals(m1, 0 * t, 1 + 0 * t)[0]) ** 2
        return Points(np.ones(t.size, bool), 2 * np.sqrt(-np.expm1(-t)), p, np.zeros((1, t.size)))


@dataclass(frozen=True, eq=False)
class FreeCurve(Curve):
    """Other free shapes, t = κ/√p: λ/(κ√p), which is `ratio` (m,), changes least along them."""

    ratio: np.ndarray

    def _solved(self, t, near, scene):
        p = self.points.p[near]
        return settle(self.group.segments, scene, t, p, (self.ratio[near] * t * p)[None])


class StraightCurve(Curve):
    """The straight strip: t is the thrust p."""

    power = 2

    def at(self, t, near):
        """Any thrust, without a known point."""
        solution = solve("0", P=t / FOUR_PI_SQUARED, H=self.scene.H[0], ends=self.scene.ends)
        return solution, Points(np.ones(t.size, bool), np.zeros_like(t), t, np.zeros((0, t.size)))

    def passes(self, other):
        """Whether the only known point of another curve is a thrust between those of this one."""
        return other.state.straight and bool(self.t[0] <= other.t[0] <= self.t[-1] * (1 + SAME))


def curve_through(solution, control, at=0):
    """The curve that one solved point lies on; nothing else is known of it.

    Parameters
    ----------
    solution : Solution
        Whatever its own control.
    control : Control
        What is prescribed from now on.
    at : int
        Which of its points, by its flat index.

    Returns
    -------
    Curve
    """
    state = solution.state._replace(root=1, name=solution.state.name.partition(":")[0])
    scene = Scene(solution.ends, solution.H.reshape(-1)[[at]])
    P, curvature = (values.reshape(-1)[[at]] for values in (solution.P, solution.curvature))
    periods, lam = (values.reshape(solution.P.size, -1)[at] for values in (solution.periods, solution.lam))
    p = FOUR_PI_SQUARED * P
    order = state.segments(scene.ends, periods.tolist())
    segments = Counter(sorted(order))
    k = np.divide(curvature, np.sqrt(p), where=p > 0, out=np.zeros(1))
    lam = lam[[order.index(segment) for segment in segments]][:, None]
    make = StraightCurve if state.straight else LineCurve if state.line else Curve
    t = k if make is Curve else np.sqrt(p) ** make.power
    group = Group(segments, (tuple(periods.tolist()),))
    points = Points(np.ones(1, bool), k, p, lam)
    return make(state, scene, control, group, np.zeros(1, int), t, points, {})
