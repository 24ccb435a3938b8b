"""Branches followed from end to end: found at loads of a grid, continued to their ends, with their extremes.

What comes out is a table of points in order along each branch, between which load and shortening are
monotonic: each shortening that lies between two neighbours belongs to one point between them.

Not here: the equations (`branch`).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.equilibria.alternating import alternating, has_single_root
from elastica.equilibria.branch import (
    Points,
    below_right_angle,
    bordered,
    settle,
    settle_at_shortening,
    steepest_angle,
)
from elastica.equilibria.lengths import LengthTable
from elastica.equilibria.line import line_range, line_roots
from elastica.equilibria.newton import Bracket
from elastica.equilibria.sweep import every_root
from elastica.equilibria.widening import TAUT
from elastica.scene import Scene

FIRST_LOAD, LOAD_STEP = 0.4, 0.3
"""√p of the first load at which branches are looked for, and the distance of the next."""
END_STEPS = 24
SAME_POINT = 1e-9
"""Relative distance of k below which two points of a branch are one."""
FEW = 8
"""Points of a branch at one gap of which it is enough to have so many."""
ALMOST_STEEP = np.pi / 2 - 1e-3
"""Angle from which on the end of a branch is one at 90°."""
FOLD_STEP, MOST_FOLD_STEPS, NEXT_LOAD = 0.02, 120, 0.2
"""Step of k towards the fold of a steep branch, how many of them, and ln p by which one step may change."""
SMALLEST_FOLD_STEP = FOLD_STEP / 300


class Branch(NamedTuple):
    """Points on the branches of one set of segments at several gaps, in order of gap, then of k.

    Attributes
    ----------
    gap : ndarray of int, shape (m,)
        Position in the array of gaps.
    k, p : ndarray, shape (m,)
    lam : ndarray, shape (distinct segments, m)
    shorter : ndarray, shape (m,)
        Shortening ΔL.
    shortening_k, load_k : ndarray, shape (m,)
        Slopes dΔL/dk and d ln p/dk.
    """

    gap: np.ndarray
    k: np.ndarray
    p: np.ndarray
    lam: np.ndarray
    shorter: np.ndarray
    shortening_k: np.ndarray
    load_k: np.ndarray

    def at(self, where):
        """Some of the points."""
        return Branch(*(field[..., where] for field in self))

    @property
    def pairs(self):
        """First of each two neighbours on the same branch."""
        return np.flatnonzero(self.gap[:-1] == self.gap[1:])

    @property
    def first(self):
        """First point at each gap."""
        return np.flatnonzero(np.diff(self.gap, prepend=-1))

    @property
    def last(self):
        """Last point at each gap."""
        return np.flatnonzero(np.diff(self.gap, append=-1))


class Loads:
    """Points (load, gap) at which branches are looked for: a grid in √p that is fine enough for each.

    Parameters
    ----------
    scene : Scene
        Of the n gaps.
    largest : float
        √p up to which branches are looked for.
    """

    def __init__(self, scene, largest):
        root_p = np.arange(FIRST_LOAD, largest + LOAD_STEP, LOAD_STEP)
        self.first, self.last = root_p[0] ** 2, root_p[-1] ** 2
        p, self.gap = (grid.ravel() for grid in np.meshgrid(root_p**2, np.arange(scene.size), indexing="ij"))
        self.scene = scene
        self.table = LengthTable(p, scene.at(self.gap))
        self._folds = {}

    def line_range(self, segments):
        """The range of line states of some segments at each gap."""
        return line_range(segments, self.scene, self.first, self.last, self._folds)

    def trace(self, segments):
        """The branch of a set of segments at every gap; beyond 90° where there is a single root at a load.

        Parameters
        ----------
        segments : Mapping of Segment to int

        Returns
        -------
        Branch
        """
        followed = _Followed(segments, self.scene)
        single = has_single_root(segments)
        if single:
            roots = alternating(segments, self.table)
            place = np.flatnonzero(roots.found)
            roots = roots.at(place)
        else:
            place, roots, *_ = every_root(segments, self.table)
        p = self.table.p[place]
        points = Points(np.ones(place.size, bool), roots.kappa / np.sqrt(p), p, roots.lam)
        branch = followed.branch(self.gap[place], points)
        branch = _joined(branch, followed.starts(self.line_range(segments).first))
        if not branch.k.size:
            return branch
        branch = _joined(branch, followed.ends(branch))
        branch = _joined(branch, followed.between(branch))
        if single:
            branch = followed.to_folds(branch)
        return _joined(branch, followed.extremes(branch))


class _Followed(NamedTuple):
    """What is followed: a set of segments at the gaps of a scene."""

    segments: Mapping
    scene: Scene

    def branch(self, gap, points):
        """Evaluate points, leave out what was not found, and sort."""
        keep = np.flatnonzero(points.found)
        keep = keep[np.lexsort((points.k[keep], gap[keep]))]
        gap, points = gap[keep], points.at(keep)
        b = bordered(self.segments, points.p, self.scene.at(gap), points.k, points.lam)
        return Branch(gap, points.k, points.p, points.lam, b.shorter, b.shortening_k, b.load_k)

    def starts(self, p):
        """Where branches leave κ = 0: at the load (gaps,) from which on the strip is long enough."""
        gap = np.flatnonzero(np.isfinite(p))
        p = p[gap]
        line = line_roots(self.segments, p, self.scene.at(gap))
        points = Points(line.found, line.kappa, p, line.lam)
        points.found[:] &= below_right_angle(self.segments, points)
        return self.branch(gap, points)

    def ends(self, branch):
        """Go on to κ = 0 and to κ = √(2p), or to 90° if that comes first."""
        first, last = branch.first, branch.last
        edge = branch.at(np.concatenate([first, last]))
        near, far = edge.k.copy(), np.repeat([0.0, np.sqrt(2)], [first.size, last.size])
        p, lam, reached = edge.p.copy(), edge.lam.copy(), np.zeros(near.size, bool)
        live = np.arange(near.size)
        ahead = far.copy()
        for _ in range(END_STEPS):
            scene = self.scene.at(edge.gap[live])
            there = settle(self.segments, scene, ahead[live], p[live], lam[:, live])
            good = there.found & below_right_angle(self.segments, there)
            won, lost = live[good], live[~good]
            p[won], lam[:, won], reached[won] = there.p[good], there.lam[:, good], True
            near[won], far[lost] = ahead[won], ahead[lost]
            live = live[near[live] != far[live]]
            ahead = 0.5 * (near + far)
        return self.branch(edge.gap, Points(reached, near, p, lam))

    def between(self, branch):
        """Points in between where the window of loads is so narrow that few were looked at."""
        pairs = branch.pairs
        few = np.bincount(branch.gap, minlength=self.scene.size) < FEW
        pairs = pairs[few[branch.gap[pairs]]]
        near = np.repeat(pairs, FEW)
        share = np.tile(np.arange(1, FEW + 1) / (FEW + 1), pairs.size)
        k = branch.k[near] + share * (branch.k[near + 1] - branch.k[near])
        start = branch.at(near)
        points = settle(self.segments, self.scene.at(start.gap), k, start.p, start.lam)
        points.found[:] &= below_right_angle(self.segments, points)
        return self.branch(start.gap, points)

    def to_folds(self, branch):
        """Ends at 90° or beyond it continued to where the load turns round, or to a taut string."""
        for side in (-1, 1):
            edge = branch.at(branch.first if side < 0 else branch.last)
            points = Points(np.ones(edge.k.size, bool), edge.k, edge.p, edge.lam)
            steep = steepest_angle(self.segments, points) > ALMOST_STEEP
            edge = edge.at(np.flatnonzero(steep & (edge.k > 0)))
            trail, turned = self._beyond(edge, side)
            branch = _joined(branch, *trail)
            branch = _joined(branch, self.extremes(branch))
            # What turned round did so between its last two points.
            outermost = branch.first if side < 0 else branch.last
            outermost = outermost[np.isin(branch.gap[outermost], edge.gap[turned])]
            branch = branch.at(np.setdiff1d(np.arange(branch.k.size), outermost))
        return branch

    def _beyond(self, edge, side):
        """Points beyond an edge in one direction of k, and which of its points turn round in the end."""
        k, p, lam, step = edge.k.copy(), edge.p.copy(), edge.lam.copy(), np.full(edge.k.size, FOLD_STEP)
        turned, live = np.zeros(k.size, bool), np.arange(k.size)
        trail = []
        for _ in range(MOST_FOLD_STEPS):
            if not live.size:
                break
            scene, ahead = self.scene.at(edge.gap[live]), k[live] + side * step[live]
            there = settle(self.segments, scene, np.maximum(ahead, 0), p[live], lam[:, live])
            slope = bordered(self.segments, there.p, scene, there.k, there.lam).load_k
            bent = there.lam.max(axis=0) > -TAUT * there.p
            good = there.found & (ahead > 0) & bent & (np.abs(np.log(there.p / p[live])) < NEXT_LOAD)
            step[live[~good]] /= 4
            won = live[good]
            k[won], p[won], lam[:, won] = there.k[good], there.p[good], there.lam[:, good]
            turned[won] = slope[good] * edge.load_k[won] < 0
            trail.append(self.branch(edge.gap[won], there.at(np.flatnonzero(good))))
            live = live[~turned[live] & (step[live] > SMALLEST_FOLD_STEP)]
        return trail, turned

    def extremes(self, branch):
        """Extremes of the shortening and of the load between neighbours."""
        first, which = [], []
        for number, slopes in enumerate((branch.shortening_k, branch.load_k)):
            turns = branch.pairs[slopes[branch.pairs] * slopes[branch.pairs + 1] < 0]
            first.append(turns)
            which.append(np.full(turns.size, number))
        first, which = np.concatenate(first), np.concatenate(which)

        def slope(k, first, which):
            _, linear = self._settled(branch, first, k)
            return np.where(which == 0, linear.shortening_k, linear.load_k)

        root = find_root(slope, (branch.k[first], branch.k[first + 1]), args=(first, which))
        good = root.success
        points, _ = self._settled(branch, first[good], root.x[good])
        return self.branch(branch.gap[first[good]], points)

    def _settled(self, branch, near, k):
        """Points at k, starting near known points, and the equations there."""
        start = branch.at(near)
        scene = self.scene.at(start.gap)
        points = settle(self.segments, scene, k, start.p, start.lam)
        return points, bordered(self.segments, points.p, scene, k, points.lam)


def _joined(*parts):
    """Branches merged in order of gap and k, equal points once (an extreme may be found twice)."""
    joined = Branch(*(np.concatenate(fields, axis=-1) for fields in zip(*parts, strict=True)))
    order = np.lexsort((joined.k, joined.gap))
    apart = np.diff(joined.k[order], prepend=-1)
    again = (np.abs(apart) <= SAME_POINT * joined.k[order]) & (np.diff(joined.gap[order], prepend=-1) == 0)
    return joined.at(order[~again])


def at_shortening(segments, branch, scene, target, gap):
    """Points of branches with given shortenings.

    Parameters
    ----------
    segments : Mapping of Segment to int
    branch : Branch
    scene : Scene
        Of the gaps that `branch.gap` counts.
    target, gap : ndarray, shape (n,)
        Shortening, and position of its gap.

    Returns
    -------
    which : ndarray of int, shape (m,)
        Positions in `target`.
    points : Points
    """
    which, pair = _pairs_around(branch, target, gap)
    left, right = branch.at(pair), branch.at(pair + 1)
    missing = left.shorter - target[which]
    share = np.clip(missing / (left.shorter - right.shorter), 0, 1)
    sides = (left.k, right.k), (left.p, right.p), (left.lam, right.lam)
    k, p, lam = (a + (b - a) * share for a, b in sides)
    bracket = Bracket(left.k.copy(), right.k.copy(), np.sign(missing))
    points = settle_at_shortening(segments, scene.at(left.gap), k, p, lam, target[which], bracket)
    return which[points.found], points.at(points.found)


def _pairs_around(branch, target, gap):
    """Positions of targets, and the first of two neighbours on a branch between which each lies."""
    first = branch.pairs
    order = np.lexsort((target, gap))
    # One number orders by gap, then by shortening, which lies between 0 and 2.
    key = 4.0 * gap[order] + target[order]
    begin, end = (
        np.searchsorted(key, 4.0 * branch.gap[first] + side(branch.shorter[first], branch.shorter[first + 1]))
        for side in (np.minimum, np.maximum)
    )
    pair = np.repeat(first, end - begin)
    offset = np.arange(pair.size) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin)
    return order[np.repeat(begin, end - begin) + offset], pair
