"""A state followed along its branch in both directions for as long as it is there and stable.

A branch is a curve with a parameter t: k = κ/√p, on which the load is a function of t and has no folds
(`branch`), and √p in the line regime, where κ = 0. Between the places where a state is lost the prescribed
quantity, load or shortening, rises or falls steadily with t, so that each of its values belongs to one point.

Not here: what comes after the ends (`quasistatic`).
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.codes import Stability, Status
from elastica.control import CONTROLS
from elastica.ends import Ends
from elastica.equilibria.branch import Points, settle
from elastica.equilibria.buckled import free_branch
from elastica.equilibria.euler import euler_root
from elastica.equilibria.line import line_roots
from elastica.equilibria.periods import Group
from elastica.equilibria.roots import spread
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solution import solution_of
from elastica.solving import solve
from elastica.state import State, parse_state

LASTING = (Stability.STABLE, Stability.NEUTRAL_FAMILY, Stability.CRITICAL)
"""Verdicts with which a state holds: a family of equal energy rests anywhere, critical is the last point."""
POINTS = 16
"""Points solved at once ahead of the last one known."""
FIRST, WIDEST, RESOLUTION = 0.05, 0.4, 1e-15
"""Interval of t that they span: at first, at most, and when the end is found."""
SAME = 1e-6
"""Relative difference of curvature of one and the same point."""
STRAIGHT = 1e-6
"""Next to where a free shape begins it is straight to rounding, and its verdict noise."""


@dataclass(frozen=True, eq=False)
class Arc:
    """A piece of a branch on which a state holds.

    Attributes
    ----------
    state : State
        Without the number of a root.
    ends : Ends
    control : str
        "P" or "shortening".
    H : float
    group : Group
        Its distinct segments, and the pattern of extra periods.
    t, p, given : ndarray, shape (m,)
        Parameter of points on the branch, ascending; thrust and prescribed quantity there.
    lam : ndarray, shape (distinct segments, m)
    cut : tuple of bool
        Whether at its first and at its last point following ends, but not necessarily the state: no branch is
        found beyond, as it may happen beyond 90°.
    """

    state: State
    ends: Ends
    control: str
    H: float
    group: Group
    t: np.ndarray
    p: np.ndarray
    given: np.ndarray
    lam: np.ndarray
    cut: tuple[bool, bool] = (False, False)

    @property
    def low(self):
        """Least value of the prescribed quantity."""
        return float(self.given.min())

    @property
    def high(self):
        """Greatest value of the prescribed quantity."""
        return float(self.given.max())

    def reaches(self, given):
        """Whether the state is there at a prescribed value; at zero only the straight strip is."""
        return self.low <= given <= self.high and (given > 0 or self.state.straight)

    def at(self, given):
        """The state at values of the prescribed quantity between `low` and `high`.

        Returns
        -------
        Solution, shape of `given` (n,)
        """
        if self.state.straight:
            return solve("0", H=self.H, ends=self.ends, **{self.control: given})
        order = np.argsort(self.given)
        right = np.clip(np.searchsorted(self.given[order], given), 1, max(self.given.size - 1, 1))
        left, right = order[right - 1], order[np.minimum(right, order.size - 1)]

        def missing(t, left, given):
            return getattr(self._settled(t, left), self.control) - given

        found = find_root(missing, (self.t[left], self.t[right]), args=(left, given))
        nearer = np.abs(self.given[left] - given) < np.abs(self.given[right] - given)
        t = np.where(found.success, found.x, np.where(nearer, self.t[left], self.t[right]))
        return self._settled(t, left)

    def passes(self, solution, at=0):
        """Whether one point of a solution lies on the arc.

        Parameters
        ----------
        solution : Solution
        at : int
            Which of its points, by its flat index.
        """
        if _plain(solution.state) != self.state:
            return False
        if self.state.straight:
            return True
        group, t, p, _ = _place(solution, at)
        if group != self.group or not self.t[0] * (1 - SAME) <= t[0] <= self.t[-1] * (1 + SAME):
            return False
        near = np.abs(self.t - t).argmin(keepdims=True)
        return bool(np.abs(_solved(self, t, self.p[near], self.lam[:, near])[1].p / p - 1)[0] <= SAME)

    def end(self, upper):
        """The state where it is lost, shape (1,)."""
        if self.state.straight:
            return self.at(np.array([self.high if upper else self.low]))
        last = np.array([self._end(upper)])
        return self._settled(self.t[last], last)

    def cut_at(self, upper):
        """Whether it is following that ends there."""
        return self.cut[self._end(upper)]

    def _end(self, upper):
        """Position of the last point in a direction of the prescribed quantity."""
        return -int(upper == (self.given[-1] > self.given[0]))

    def _settled(self, t, near):
        """The branch at t (n,), starting near known points."""
        return _solved(self, t, self.p[near], self.lam[:, near])[0]


def arc_through(solution, control, at=0):
    """The arc that one solved point lies on.

    Parameters
    ----------
    solution : Solution
        Whatever its own control.
    control : str
        "P" or "shortening": what is prescribed from now on.
    at : int
        Which of its points, by its flat index.

    Returns
    -------
    Arc or None
        None where the state does not hold at this control.
    """
    ends, state = solution.ends, _plain(solution.state)
    H = float(solution.H.ravel()[at])
    if state.straight:
        euler = float(euler_root(1, ends)) ** 2
        p = np.array([0.0, euler]) if control == "P" else np.array([euler])
        given = p / FOUR_PI_SQUARED if control == "P" else np.zeros(1)
        return Arc(state, ends, control, H, None, given, p, given, np.zeros((0, p.size)))
    group, t, p, lam = _place(solution, at)
    arc = Arc(state, ends, control, H, group, t, p, None, lam)
    if not _holds(*_solved(arc, t, p, lam))[0]:
        return None
    *below, cut_below = _reach(arc, -1)
    *above, cut_above = _reach(arc, 1)
    t, p, lam = (
        np.concatenate([a[..., ::-1], b[..., 1:]], axis=-1) for a, b in zip(below, above, strict=True)
    )
    given = getattr(_solved(arc, t, p, lam)[0], control)
    if state.mode and t[0] < STRAIGHT:
        given[0] = float(euler_root(state.mode, ends)) ** 2 / FOUR_PI_SQUARED if control == "P" else 0.0
    return Arc(state, ends, control, H, group, t, p, given, lam, (cut_below, cut_above))


def just_buckled(ends, H):
    """A strip that has buckled and does not touch a wall yet, however close they are.

    Returns
    -------
    Solution, shape (1,)
    """
    state, euler = parse_state("B1", ends), float(euler_root(1, ends))
    segments = Counter(state.segments(ends))
    (kind,) = (segment.kind for segment in segments)
    # Where it touches a wall κ/√p is more than 2H.
    t, p = np.array([H / 2]), np.array([euler**2])
    lam = (free_branch(kind, euler).ratio[0] * t * p)[None]
    arc = Arc(state, ends, "shortening", H, Group(segments, ((0,),)), t, p, None, lam)
    return _solved(arc, t, p, lam)[0]


def _plain(state):
    """A state without the number of a root."""
    return state._replace(root=1, name=state.name.partition(":")[0])


def _place(solution, at):
    """Where one point of a bent state lies: its segments, t (1,), p (1,) and λ (distinct segments, 1)."""
    pattern = tuple(solution.periods.reshape(solution.P.size, -1)[at].tolist())
    order = solution.state.segments(solution.ends, pattern)
    segments = Counter(sorted(order))
    p = FOUR_PI_SQUARED * solution.P.ravel()[[at]]
    each = solution.lam.reshape(solution.P.size, -1)[at]
    lam = each[[order.index(segment) for segment in segments]][:, None]
    t = np.sqrt(p) if solution.state.line else solution.curvature.ravel()[[at]] / np.sqrt(p)
    return Group(segments, (pattern,)), t, p, lam


def _reach(arc, direction):
    """Points from the arc's only one to where the state is lost, in one direction of t.

    Returns
    -------
    t, p, lam : ndarray
    cut : bool
        Whether nothing was found beyond: then it may be following that ends, and not the state.
    """
    t, p, lam = arc.t, arc.p, arc.lam
    width, narrowing = FIRST, False
    while width > RESOLUTION * max(1.0, t[-1]) and not (direction < 0 and t[-1] == 0):
        ahead = t[-1] + direction * width * np.arange(1, POINTS + 1) / POINTS
        ahead = np.unique(np.maximum(ahead, 0))[::direction]
        near = np.full(ahead.size, p[-1]), np.repeat(lam[:, -1:], ahead.size, axis=1)
        solution, points = _solved(arc, ahead, *near)
        lost = np.flatnonzero(~_holds(solution, points))
        kept = lost[0] if lost.size else ahead.size
        t = np.concatenate([t, ahead[:kept]])
        p, lam = np.concatenate([p, points.p[:kept]]), np.concatenate([lam, points.lam[:, :kept]], axis=1)
        # Next to its end a verdict may be noise: once the state was there and lost, the end is only enclosed.
        narrowing |= lost.size > 0 and points.found[kept] and solution.status[kept] != Status.NOT_FOLLOWED
        width = width / POINTS if lost.size or narrowing else min(2 * width, WIDEST)
    return t, p, lam, not narrowing and t[-1] > 0


def _holds(solution, points):
    """Whether a state is there and stays there, shape (n,)."""
    return points.found & (solution.status == Status.SOLVED) & np.isin(solution.stability, LASTING)


def _solved(arc, t, p, lam):
    """The branch at t (n,), starting from p (n,) and λ (distinct segments, n).

    Returns
    -------
    Solution, Points
    """
    scene = Scene(arc.ends, np.full(t.size, arc.H))
    with np.errstate(all="ignore"):
        if arc.state.line:
            line = line_roots(arc.group.segments, t**2, scene)
            points = Points(line.found, line.kappa, t**2, line.lam)
        else:
            points = settle(arc.group.segments, scene, t, p, lam)
        plain = arc.state.segments(arc.ends)
        found = spread(plain, arc.group, np.arange(t.size), points.roots, points.p)
        return solution_of(arc.state, scene, CONTROLS[arc.control], None, found), points
