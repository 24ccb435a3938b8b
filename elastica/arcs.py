"""A state followed along its branch in both directions for as long as it is there and stable.

A branch is a curve with a parameter t: k = κ/√p, on which the load is a function of t and has no folds
(`branch`), and √p in the line regime, where κ = 0. Between the places where a state is lost the prescribed
quantity, load or shortening, rises or falls steadily with t, so that each of its values belongs to one point.

Left out: what comes after the ends (`quasistatic`).
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.branch import Points, settle
from elastica.codes import Stability, Status
from elastica.ends import Ends
from elastica.equilibrium import spread
from elastica.euler import euler_root
from elastica.patterns import Group
from elastica.scales import FOUR_PI_SQUARED
from elastica.solution import solution_of, solve
from elastica.states import State
from elastica.sweep import line_force

LASTING = (Stability.STABLE, Stability.NEUTRAL_FAMILY, Stability.CRITICAL)
"""Verdicts with which a state holds: a family of equal energy rests anywhere, critical is the last point."""
POINTS = 16
"""Points solved at once ahead of the last one known."""
FIRST, WIDEST, RESOLUTION = 0.05, 0.4, 1e-15
"""Interval of t that they span: at first, at most, and when the end is found."""
SAME = 1e-6
"""Relative difference of curvature of one and the same point."""


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
        Its distinct segments, and the pattern of further periods.
    t, p, given : ndarray, shape (m,)
        Parameter of points on the branch, ascending; thrust and prescribed quantity there.
    lam : ndarray, shape (distinct segments, m)
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

    @property
    def low(self):
        """Least value of the prescribed quantity."""
        return float(self.given.min())

    @property
    def high(self):
        """Greatest value of the prescribed quantity."""
        return float(self.given.max())

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

    def covers(self, other):
        """Whether another arc is the same piece of the same branch, to rounding."""
        if (self.state, self.group) != (other.state, other.group):
            return False
        middle = 0.5 * (other.low + other.high)
        if not self.low <= middle <= self.high:
            return False
        here, there = (arc.at(np.array([middle])).curvature for arc in (self, other))
        return bool(np.abs(here - there) <= SAME * (here + there))

    def end(self, upper):
        """The state where it is lost, shape (1,)."""
        return self.at(np.array([self.high if upper else self.low]))

    def _settled(self, t, near):
        """The branch at t (n,), starting near known points."""
        return _solved(self, t, self.p[near], self.lam[:, near])[0]


def arc_through(solution, control):
    """The arc that one solved point lies on.

    Parameters
    ----------
    solution : Solution
        Of a single point, whatever its own control.
    control : str
        "P" or "shortening": what is prescribed from now on.

    Returns
    -------
    Arc or None
        None where the state does not hold at this control.
    """
    ends = solution.ends
    state = solution.state._replace(root=1, name=solution.state.name.partition(":")[0])
    H = float(solution.H.ravel()[0])
    if state.straight:
        euler = float(euler_root(1, ends)) ** 2
        p = np.array([0.0, euler]) if control == "P" else np.array([euler])
        given = p / FOUR_PI_SQUARED if control == "P" else np.zeros(1)
        return Arc(state, ends, control, H, None, given, p, given, np.zeros((0, p.size)))
    pattern = tuple(solution.periods.ravel().tolist())
    order = state.segments(ends, pattern)
    segments = Counter(sorted(order))
    p = FOUR_PI_SQUARED * solution.P.ravel()[:1]
    lam = solution.lam.ravel()[[order.index(segment) for segment in segments]][:, None]
    t = np.sqrt(p) if state.line else solution.curvature.ravel()[:1] / np.sqrt(p)
    arc = Arc(state, ends, control, H, Group(segments, (pattern,)), t, p, None, lam)
    if not _holds(*_solved(arc, t, p, lam))[0]:
        return None
    below, above = _reach(arc, -1), _reach(arc, 1)
    t, p, lam = (
        np.concatenate([a[..., ::-1], b[..., 1:]], axis=-1) for a, b in zip(below, above, strict=True)
    )
    given = getattr(_solved(arc, t, p, lam)[0], control)
    return Arc(state, ends, control, H, arc.group, t, p, given, lam)


def _reach(arc, direction):
    """t, p and λ of points from the arc's only one to where the state is lost, in one direction of t."""
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
        narrowing |= lost.size > 0 and points.found[kept]
        width = width / POINTS if lost.size or narrowing else min(2 * width, WIDEST)
    return t, p, lam


def _holds(solution, points):
    """Whether a state is there and stays there, shape (n,)."""
    return points.found & (solution.status == Status.SOLVED) & np.isin(solution.stability, LASTING)


def _solved(arc, t, p, lam):
    """The branch at t (n,), starting from p (n,) and λ (distinct segments, n).

    Returns
    -------
    Solution, Points
    """
    H = np.full(t.size, arc.H)
    with np.errstate(all="ignore"):
        if arc.state.line:
            lam = np.stack([line_force(segment, t**2, H) for segment in arc.group.segments])
            points = Points(np.isfinite(lam).all(axis=0), np.zeros_like(t), t**2, lam)
        else:
            points = settle(arc.group.segments, H, t, p, lam)
        plain = arc.state.segments(arc.ends)
        found = spread(plain, arc.group, np.arange(t.size), points.roots, points.p)
        return solution_of(arc.state, arc.ends, arc.control, None, H, found), points
