"""The equilibria of one set of segments at one gap as a curve with the parameter k = κ/√p.

At fixed k every length scales with 1/√p, and below 90° a segment's length grows with its rise less than in
proportion (its elasticity is at most 0.634). So Σnℓ(p) falls with p at fixed k: there is one load for each
k, and the whole branch, with all its folds, is a single curve p(k), 0 ≤ k < √2. Under any control an
equilibrium is a point where a function along that curve has a given value.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.optimize.elementwise import find_root

from elastica.equilibria.alternating import TAUT
from elastica.equilibria.lengths import LengthTable
from elastica.equilibria.line import line_range, line_roots
from elastica.equilibria.newton import Bracket, Roots, sign_known
from elastica.equilibria.sweep import every_root
from elastica.pendulum.segments import arc, geometry, pendulum, shortening, steepest
from elastica.scene import Scene
from elastica.state import Segment

FIRST_LOAD, LOAD_STEP = 0.4, 0.3
"""√p of the first load at which branches are looked for, and the distance of the next."""
END_STEPS = 24
LONGEST_FREE_PERIOD = 7.6
"""√p times the longest period below 90°, a little more than 4K(½)."""
MOST_STEPS = 40
MET = 1e-10
"""Relative error of a shortening that is met as well as the worst conditioned points allow."""
SAME_POINT = 1e-9
"""Relative distance of k below which two points of a branch are one."""
FEW = 8
"""Points of a branch at one gap of which it is enough to have so many."""
ALMOST_STEEP = np.pi / 2 - 1e-3
"""Angle from which on the end of a branch is one at 90°."""
FOLD_STEP, MOST_FOLD_STEPS, NEXT_LOAD = 0.02, 120, 0.2
"""Step of k towards the fold of a steep branch, how many of them, and ln p by which one step may change."""
FREE_NODES = (0.02, 0.1, *np.arange(0.2, 1.9, 0.1), *np.arange(1.84, 1.985, 0.02))


class Bordered(NamedTuple):
    """The equations of a branch at n points, linearised, with every λ_j eliminated.

    With κ = k√p, changes of k and of ln p move Σnℓ − 1 (`excess`) and the total shortening by the
    derivatives given; λ_j/p by `across` + `along_k` δk + `along_load` δ ln p.
    """

    excess: np.ndarray
    excess_k: np.ndarray
    excess_load: np.ndarray
    shorter: np.ndarray
    shorter_k: np.ndarray
    shorter_load: np.ndarray
    across: np.ndarray
    along_k: np.ndarray
    along_load: np.ndarray

    @property
    def load_k(self):
        """Slope d ln p/dk of the branch."""
        return -self.excess_k / self.excess_load

    @property
    def shortening_k(self):
        """Slope dΔL/dk of the branch."""
        return self.shorter_k + self.shorter_load * self.load_k


def bordered(segments, p, scene, k, lam, arcs=None):
    """Linearise at k (n,), p (n,) and λ (distinct segments, n); the arcs there may be known better."""
    root_p = np.sqrt(p)
    totals = np.zeros((6, p.size))
    totals[0] = -1.0
    across, along_k, along_load = np.empty((3, *lam.shape))
    for j, (segment, count) in enumerate(segments.items()):
        piece = arcs[j] if arcs else arc(segment.kind, pendulum(p, k * root_p, lam[j]))
        g = geometry(piece, load=True)
        across[j] = (scene.rise(segment) - g.rise) / g.rise_lam
        along_k[j] = -g.rise_kappa * root_p / g.rise_lam
        along_load[j] = -g.rise_load / g.rise_lam
        totals += count * np.stack(
            [
                g.length + g.length_lam * across[j],
                g.length_kappa * root_p + g.length_lam * along_k[j],
                g.length_load + g.length_lam * along_load[j],
                shortening(piece) + g.shorter_lam * across[j],
                g.shorter_kappa * root_p + g.shorter_lam * along_k[j],
                g.shorter_load + g.shorter_lam * along_load[j],
            ]
        )
    return Bordered(*totals, across / p, along_k / p, along_load / p)


class Points(NamedTuple):
    """Points on branches: `found`, k and p (n,), λ (distinct segments, n)."""

    found: np.ndarray
    k: np.ndarray
    p: np.ndarray
    lam: np.ndarray

    def at(self, where):
        """Some of the points."""
        return Points(self.found[where], self.k[where], self.p[where], self.lam[:, where])

    @property
    def roots(self):
        """The same as unknowns of load control."""
        return Roots(self.found, self.k * np.sqrt(self.p), self.lam)


def settle(segments, scene, k, p, lam, target=None, bracket=None):
    """Newton for the load at fixed k; with a `target` shortening for k too, kept in its bracket.

    Parameters
    ----------
    segments : Mapping of Segment to int
    scene : Scene
        Of n points.
    k, p : ndarray, shape (n,)
    lam : ndarray, shape (distinct segments, n)
    target : ndarray, shape (n,), optional
        Shortening.
    bracket : Bracket, optional
        Interval of k in which the shortening crosses its target.

    Returns
    -------
    Points
    """
    k, p, lam = k.copy(), p.copy(), lam.copy()
    found = np.zeros(p.size, bool)
    live = np.flatnonzero(np.isfinite(p) & np.isfinite(lam).all(axis=0))
    previous = np.full(p.size, np.inf)
    for _ in range(MOST_STEPS):
        if not live.size:
            break
        b = bordered(segments, p[live], scene.at(live), k[live], lam[:, live])
        step_k, trusted = np.zeros(live.size), True
        if target is not None:
            missing = b.shorter - target[live] - b.shorter_load / b.excess_load * b.excess
            aside = np.maximum(np.abs(b.across).max(axis=0), np.abs(b.excess / b.excess_load))
            step_k, replaced = bracket.confine(
                live, k[live], missing, sign_known(missing, aside), -missing / b.shortening_k
            )
            # A step to the middle is small when the interval is, whatever is in it.
            trusted = ~replaced | (np.abs(missing) <= MET * target[live])
        step_load = -(b.excess + b.excess_k * step_k) / b.excess_load
        step_lam = b.across + b.along_k * step_k + b.along_load * step_load
        size = np.maximum(np.abs(step_lam).max(axis=0), np.abs(step_load))
        if target is not None:
            size = np.maximum(size, np.abs(step_k))
        shrink = np.minimum(1, 0.5 / np.maximum(size, 1e-300))
        k[live] += shrink * step_k
        lam[:, live] = (lam[:, live] / p[live] + shrink * step_lam) * p[live]
        grow = np.exp(shrink * step_load)
        p[live] *= grow
        lam[:, live] *= grow
        converged = ((size < 1e-9) | ((size < 1e-6) & (size > 0.5 * previous[live]))) & trusted
        found[live] = converged
        previous[live] = size
        live = live[~converged & np.isfinite(size)]
    return Points(found, k, p, lam)


class Branch(NamedTuple):
    """Points on the branches of one set of segments at several gaps, in order of gap, then of k.

    Attributes
    ----------
    gap : ndarray of int, shape (m,)
        Position in the array of gaps.
    k, p : ndarray, shape (m,)
    lam : ndarray, shape (distinct segments, m)
    shorter, slope : ndarray, shape (m,)
        Shortening ΔL and dΔL/dk.
    fold : ndarray, shape (m,)
        d ln p/dk.
    """

    gap: np.ndarray
    k: np.ndarray
    p: np.ndarray
    lam: np.ndarray
    shorter: np.ndarray
    slope: np.ndarray
    fold: np.ndarray

    @classmethod
    def of(cls, segments, scene, gap, points):
        """Evaluate points, leave out what was not found, and sort."""
        keep = np.flatnonzero(points.found)
        keep = keep[np.lexsort((points.k[keep], gap[keep]))]
        gap, points = gap[keep], points.at(keep)
        b = bordered(segments, points.p, scene.at(gap), points.k, points.lam)
        return cls(gap, points.k, points.p, points.lam, b.shorter, b.shortening_k, b.load_k)

    def at(self, where):
        """Some of the points."""
        return Branch(*(field[..., where] for field in self))

    @property
    def pairs(self):
        """First of each two neighbours on the same branch."""
        return np.flatnonzero(self.gap[:-1] == self.gap[1:])


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

    def trace(self, segments, known=None):
        """The branch of a set of segments at every gap.

        Parameters
        ----------
        segments : Mapping of Segment to int
        known : tuple of (points, Roots), optional
            Equilibria at these loads where they have been found already, with angles beyond 90°.

        Returns
        -------
        Branch
        """
        place, roots = known or every_root(segments, self.table)[:2]
        p, gap = self.table.p[place], self.gap[place]
        found = Points(np.ones(place.size, bool), roots.kappa / np.sqrt(p), p, roots.lam)
        branch = _joined(Branch.of(segments, self.scene, gap, found), self._lines(segments))
        if not branch.k.size:
            return branch
        branch = _joined(branch, self._ends(segments, branch))
        branch = _joined(branch, self._between(segments, branch))
        if known:
            branch = self._to_folds(segments, branch)
        return _joined(branch, self._turns(segments, branch))

    def _lines(self, segments):
        """Where branches leave κ = 0: at the load from which on the strip is longer than its line shapes."""
        p = self.line_range(segments).first
        gap = np.flatnonzero(np.isfinite(p))
        p = p[gap]
        line = line_roots(segments, p, self.scene.at(gap))
        points = Points(line.found, line.kappa, p, line.lam)
        points.found[:] &= below_right_angle(segments, points)
        return Branch.of(segments, self.scene, gap, points)

    def _between(self, segments, branch):
        """Points in between where the window of loads is so narrow that few were looked at."""
        pairs = branch.pairs
        few = np.bincount(branch.gap, minlength=self.scene.size) < FEW
        pairs = pairs[few[branch.gap[pairs]]]
        near = np.repeat(pairs, FEW)
        share = np.tile(np.arange(1, FEW + 1) / (FEW + 1), pairs.size)
        k = branch.k[near] + share * (branch.k[near + 1] - branch.k[near])
        points = settle(segments, self.scene.at(branch.gap[near]), k, branch.p[near], branch.lam[:, near])
        points.found[:] &= below_right_angle(segments, points)
        return Branch.of(segments, self.scene, branch.gap[near], points)

    def _to_folds(self, segments, branch):
        """Ends at 90° or beyond it continued to where the load turns round, or to a taut string."""
        for side, beside in ((-1, "prepend"), (1, "append")):
            edge = branch.at(np.flatnonzero(np.diff(branch.gap, **{beside: -1})))
            steep = steepest_angle(segments, Points(None, edge.k, edge.p, edge.lam)) > ALMOST_STEEP
            edge = edge.at(np.flatnonzero(steep & (edge.k > 0)))
            k, p, lam, step = edge.k.copy(), edge.p.copy(), edge.lam.copy(), np.full(edge.k.size, FOLD_STEP)
            turned, live = np.zeros(k.size, bool), np.arange(k.size)
            trail = [branch]
            for _ in range(MOST_FOLD_STEPS):
                if not live.size:
                    break
                scene, ahead = self.scene.at(edge.gap[live]), k[live] + side * step[live]
                there = settle(segments, scene, np.maximum(ahead, 0), p[live], lam[:, live])
                slope = bordered(segments, there.p, scene, there.k, there.lam).load_k
                bent = there.lam.max(axis=0) > -TAUT * there.p
                good = there.found & (ahead > 0) & bent & (np.abs(np.log(there.p / p[live])) < NEXT_LOAD)
                step[live[~good]] /= 4
                won = live[good]
                k[won], p[won], lam[:, won] = there.k[good], there.p[good], there.lam[:, good]
                turned[won] = slope[good] * edge.fold[won] < 0
                trail.append(Branch.of(segments, self.scene, edge.gap[won], there.at(np.flatnonzero(good))))
                live = live[~turned[live] & (step[live] > FOLD_STEP / 300)]
            branch = _joined(*trail)
            branch = _joined(branch, self._turns(segments, branch))
            outermost = np.flatnonzero(np.diff(branch.gap, **{beside: -1}))
            outermost = outermost[np.isin(branch.gap[outermost], edge.gap[turned])]
            branch = branch.at(np.setdiff1d(np.arange(branch.k.size), outermost))
        return branch

    def _ends(self, segments, branch):
        """Go on to κ = 0 and to κ = √(2p), or to 90° if that comes first."""
        first = np.flatnonzero(np.diff(branch.gap, prepend=-1))
        last = np.flatnonzero(np.diff(branch.gap, append=self.scene.size))
        edge = branch.at(np.concatenate([first, last]))
        near, far = edge.k.copy(), np.repeat([0.0, np.sqrt(2)], [first.size, last.size])
        p, lam, reached = edge.p.copy(), edge.lam.copy(), np.zeros(near.size, bool)
        live = np.arange(near.size)
        ahead = far.copy()
        for _ in range(END_STEPS):
            there = settle(segments, self.scene.at(edge.gap[live]), ahead[live], p[live], lam[:, live])
            good = there.found & below_right_angle(segments, there)
            won, lost = live[good], live[~good]
            p[won], lam[:, won], reached[won] = there.p[good], there.lam[:, good], True
            near[won], far[lost] = ahead[won], ahead[lost]
            live = live[near[live] != far[live]]
            ahead = 0.5 * (near + far)
        return Branch.of(segments, self.scene, edge.gap, Points(reached, near, p, lam))

    def _turns(self, segments, branch):
        """Extremes of the shortening and of the load between neighbours."""
        first, which = [], []
        for number, slopes in enumerate((branch.slope, branch.fold)):
            turns = branch.pairs[slopes[branch.pairs] * slopes[branch.pairs + 1] < 0]
            first.append(turns)
            which.append(np.full(turns.size, number))
        first, which = np.concatenate(first), np.concatenate(which)

        def slope(k, first, which):
            return np.where(which == 0, *self._linear(segments, branch, first, k)[1])

        root = find_root(slope, (branch.k[first], branch.k[first + 1]), args=(first, which))
        good = root.success
        points, _ = self._linear(segments, branch, first[good], root.x[good])
        return Branch.of(segments, self.scene, branch.gap[first[good]], points)

    def _linear(self, segments, branch, near, k):
        """Settle at k, starting near known points; slopes of the shortening and of the load there."""
        start = branch.at(near)
        points = settle(segments, self.scene.at(start.gap), k, start.p, start.lam)
        linear = bordered(segments, points.p, self.scene.at(start.gap), k, points.lam)
        return points, (linear.shortening_k, linear.load_k)


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
    which = order[np.repeat(begin, end - begin) + offset]
    left, right = branch.at(pair), branch.at(pair + 1)
    missing = left.shorter - target[which]
    share = np.clip(missing / (left.shorter - right.shorter), 0, 1)
    start = (a + (b - a) * share for a, b in zip(left[1:4], right[1:4], strict=True))
    bracket = Bracket(left.k.copy(), right.k.copy(), np.sign(missing))
    points = settle(segments, scene.at(left.gap), *start, target[which], bracket)
    return which[points.found], points.at(points.found)


def below_right_angle(segments, points):
    """Whether |θ| < 90° on every segment, shape (n,)."""
    return steepest_angle(segments, points) < np.pi / 2


def steepest_angle(segments, points):
    """The largest |θ| of all segments, shape (n,)."""
    angles = [
        steepest(segment.kind, pendulum(points.p, points.k * np.sqrt(points.p), lam))
        for segment, lam in zip(segments, points.lam, strict=True)
    ]
    return np.max(angles, axis=0)


@cache
def free_branch(kind, onset):
    """The branch of a free mode from its Euler load √p = `onset` to the loop where κ/√p = 1.98.

    Returns
    -------
    k, p, ratio, shorter : ndarray, shape (nodes,)
        κ/√p, thrust, λ/(κ√p) and shortening.
    last : int
        Node of the fold, where p is largest, or the last one.
    """
    segments = {Segment(kind, 0, 0): 1}
    no_walls = Scene(None, np.zeros(1))

    def at(k, p, ratio):
        """Load, ratio and shortening at k from a start, and the slope of the load."""
        point = settle(segments, no_walls, np.array([k]), np.array([p]), np.array([[ratio * k * p]]))
        linear = bordered(segments, point.p, no_walls, point.k, point.lam)
        here = point.p[0], point.lam[0, 0] / (k * point.p[0]), linear.shorter[0]
        return tuple(map(float, here)), float(linear.load_k[0]) if point.found[0] else np.nan

    nodes = [(0.0, onset**2, _onset_ratio(kind, onset), 0.0)]
    last = None
    for ahead in FREE_NODES:
        k, p, ratio, _ = nodes[-1]
        here, slope = at(ahead, p, ratio)
        if np.isnan(slope):
            break
        if slope < 0 and last is None:
            near = p, ratio
            fold = brentq(lambda k, near=near: at(k, *near)[1], k or 1e-3, ahead, xtol=1e-12)
            last = len(nodes)
            nodes.append((fold, *at(fold, *near)[0]))
        nodes.append((ahead, *here))
    return (*np.array(nodes).T, len(nodes) - 1 if last is None else last)


def _onset_ratio(kind, onset):
    """λ/(κ√p) = tan φ₀ of the infinitesimal mode: rise 0 at total phase √p = `onset`."""
    phi = np.linspace(-1, 1, 4001)[1:-1] * np.pi / 2
    sin, cos = np.sin(phi), np.cos(phi)
    phase, jump = kind.first * np.pi / 2 + kind.second * phi, kind.second * cos
    for c, sigma in kind.springs:
        eta = np.arccos(np.clip(c * sigma * sin / np.hypot(c, onset), -1, 1)) - np.arctan2(c, onset)
        phase, jump = phase - eta, jump + sigma * np.cos(eta)
    rise = jump + phase * sin
    return float(np.tan(phi[np.argmin(np.abs(rise) + np.abs(phase - onset))]))
