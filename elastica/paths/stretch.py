"""Where a state holds: the stretch of its curve on which it is there and stable, followed in both directions.

Between the places where a state is lost the prescribed quantity, load or shortening, rises or falls steadily
along the curve, so that each of its values belongs to one point.

Not here: what comes after the ends (`quasistatic`).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.codes import Stability, Status
from elastica.control import SHORTENING
from elastica.equilibria.branch import Points
from elastica.equilibria.buckled import free_branch
from elastica.equilibria.euler import euler_root
from elastica.equilibria.periods import groups
from elastica.paths.curve import Curve
from elastica.scales import FOUR_PI_SQUARED
from elastica.solving import solve
from elastica.state import parse_state

LASTING = (Stability.STABLE, Stability.NEUTRAL_FAMILY, Stability.CRITICAL)
"""Verdicts with which a state holds: a family of equal energy rests anywhere, critical is the last point."""
STRAIGHT = 1e-6
"""Next to where a free shape begins it is straight to rounding, and its verdict noise."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of a curve on which a state holds.

    Attributes
    ----------
    curve : Curve
        At one gap, with known points of the stretch.
    prescribed : ndarray, shape (m,)
        What the control prescribes at them.
    cut : tuple of bool
        Whether at its first and at its last point following ends, but not necessarily the state: no branch is
        found beyond, as it may happen beyond 90°.
    """

    curve: Curve
    prescribed: np.ndarray
    cut: tuple[bool, bool] = (False, False)

    @property
    def state(self):
        """The state, without the number of a root."""
        return self.curve.state

    @property
    def low(self):
        """Least value of the prescribed quantity."""
        return float(self.prescribed.min())

    @property
    def high(self):
        """Greatest value of the prescribed quantity."""
        return float(self.prescribed.max())

    def reaches(self, value):
        """Whether the state is there at a prescribed value; at zero only the straight strip is."""
        return self.low <= value <= self.high and (value > 0 or self.state.straight)

    def at(self, values):
        """The state at values (n,) of the prescribed quantity between `low` and `high`.

        Returns
        -------
        Solution, shape (n,)
        """
        curve, control = self.curve, self.curve.control.name
        if self.state.straight:
            return solve("0", H=curve.scene.H, ends=curve.scene.ends, **{control: values})
        order = np.argsort(self.prescribed)
        right = np.searchsorted(self.prescribed[order], values)
        right = np.clip(right, 1, max(self.prescribed.size - 1, 1))
        left, right = order[right - 1], order[np.minimum(right, order.size - 1)]

        def missing(step, left, value):
            return getattr(curve.at(step**curve.power, left)[0], control) - value

        steps = curve.steps
        found = find_root(missing, (steps[left], steps[right]), args=(left, values))
        off_left, off_right = (np.abs(self.prescribed[side] - values) for side in (left, right))
        nearer = np.where(off_left < off_right, steps[left], steps[right])
        step = np.where(found.success, found.x, nearer)
        return curve.at(step**curve.power, left)[0]

    def end(self, upper):
        """The state where it is lost, shape (1,)."""
        if self.state.straight:
            return self.at(np.array([self.high if upper else self.low]))
        last = np.array([self._end(upper)])
        return self.curve.at(self.curve.t[last], last)[0]

    def cut_at(self, upper):
        """Whether it is following that ends there."""
        return self.cut[self._end(upper)]

    def _end(self, upper):
        """Position of the last point in a direction of the prescribed quantity."""
        return -int(upper == (self.prescribed[-1] > self.prescribed[0]))


def stretch_of(curve):
    """The stretch around the only known point of a curve.

    Parameters
    ----------
    curve : Curve

    Returns
    -------
    Stretch or None
        None where the state does not hold at the curve's control.
    """
    state, control = curve.state, curve.control
    solution, points = curve.at(curve.t, np.zeros(1, int))
    if not (points.found & _holds(solution))[0]:
        return None
    onset = 0.0
    if not (state.word or control.fixes_shortening):
        # A free shape begins where the straight strip has lost as many directions as its mode.
        onset = float(euler_root(max(state.mode, 1), curve.scene.ends)) ** 2 / FOUR_PI_SQUARED
    if state.straight:
        buckling = float(euler_root(1, curve.scene.ends)) ** 2
        return Stretch(replace(curve, t=np.array([0.0, buckling])), np.array([0.0, onset]))
    curve, cut = curve.followed(_holds)
    prescribed = getattr(curve.at(curve.t, np.arange(curve.t.size))[0], control.name)
    if state.mode and curve.t[0] < STRAIGHT:
        prescribed[0] = onset
    return Stretch(curve, prescribed, cut)


def just_buckled(scene):
    """A strip that has buckled and does not touch a wall yet, however close they are.

    Returns
    -------
    Solution, shape (1,)
    """
    state, euler = parse_state("B1", scene.ends), float(euler_root(1, scene.ends))
    (group,) = groups(state, scene.ends, 0)
    (kind,) = (segment.kind for segment in group.segments)
    # Where it touches a wall κ/√p is more than 2H.
    k, p = scene.H / 2, np.array([euler**2])
    lam = (free_branch(kind, euler).ratio[0] * k * p)[None]
    near, points = np.zeros(1, int), Points(np.ones(1, bool), k, p, lam)
    return Curve(state, scene, SHORTENING, group, near, k, points, {}).at(k, near)[0]


def _holds(solution):
    """Whether a state is there and stays there, shape (n,)."""
    return (solution.status == Status.SOLVED) & np.isin(solution.stability, LASTING)
