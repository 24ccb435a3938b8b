"""Every root of many words at once: tabulate the length of each kind of segment along κ, then sum.

At a point (p, H) a word is a sum of lengths of few kinds of segment, each a function of κ alone once its
rise is met. The lengths, with their derivatives D, are tabulated once at nodes of κ shared by all kinds; the
roots of any sum of them are bracketed from the table and refined on the exact functions (`newton`).

Every kind begins at κ = 0 with its line shape, and the rise at which it reaches 90° falls with κ: below 90°
its range is one interval from κ = 0.
"""

from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from elastica.equilibria.newton import (
    ROUNDING,
    Bracket,
    Roots,
    arrow_system,
    below_right_angles,
    newton,
    total_length,
)
from elastica.pendulum.elliptic import integrals
from elastica.pendulum.segments import arc, below_right_angle, geometry, pendulum, steepest
from elastica.scene import Scene

NODES = 32
NODE_STEPS = 8
GOOD_STEP = 1e-3
"""Relative step of λ after which a node's length, corrected to first order, is good to 1e-6."""
EXTREMUM_STEPS = 8
DIP = 0.25
"""An extremum is looked at when the estimate of its height misses zero by no more than this part of its
distance from the nodes."""
UNSURE, DIP_ERROR = 1e-4, 3e-6
"""|Σnℓ − 1| of nodes below which the table is not relied on; error of the height of an extremum between."""
NEARLY = 1e-2
"""Relative error that lengths interpolated in the table, or their nodes, certainly keep."""
SHARES = np.linspace(0, 1, NODES)
SCALED_GRID = np.concatenate([np.arange(-23.0, -1.4, 0.1), np.arange(-1.3, 3.5, 0.02)])
"""Values of ln(H√p) of the scaled tables."""
BEYOND = 2.0
"""Angle in radians up to which scaled tables go, so that they can be interpolated at 90°."""
LARGEST_RISE = 3.3054 / 4
"""√p times the rise at κ = 0 and 90°, a quarter of a period's."""
LINE_FOLD = 0.5281603073179724
"""H√P at the fold of the clamped line states, the maximum of sin α √cos α (2E − K)/(π/2) at α = 47.761°;
beyond it there are none. A segment from a pin ends at half of it."""
LINE_FOLD_ANGLE = np.radians(47.761)
LINE_NODES = 200


def line_force(segment, p, scene):
    """λ of one segment at κ = 0, from the small-deflection form on; NaN where it has none before its fold.

    The rise is a concave function of λ up to the fold of the line states, so Newton climbs to the
    root without passing it.

    Returns
    -------
    ndarray, shape (n,)
    """
    kind, rise = segment.kind, scene.rise(segment)
    if not segment.rise:
        return np.zeros_like(p)
    root_p = np.sqrt(p)
    phase, jump = (kind.first + kind.second) * np.pi / 2, 0.0
    fold = LINE_FOLD * phase / (2 * np.pi)
    for c, sigma in kind.springs:
        eta = 2 * np.arctan(root_p / c) - np.pi / 2 if sigma > 0 else np.pi / 2
        phase, jump = phase - eta, np.cos(eta)
        fold = np.inf
    start = p * root_p * rise / (phase + jump)
    below = np.flatnonzero((rise * root_p / (2 * np.pi) <= fold * (1 + 4 * ROUNDING)) & (p > 0))
    p = p[below]
    line = newton({segment: 1}, p, scene.at(below), np.zeros_like(p), start[None, below], fixed_kappa=True)
    before_fold = geometry(arc(kind, pendulum(p, line.kappa, line.lam[0]))).rise_lam > 0
    lam = np.full_like(start, np.nan)
    lam[below] = np.where(line.found & before_fold, line.lam[0], np.nan)
    return lam


def rough_line_length(segment, p, scene):
    """Length of a segment at κ = 0 to 1e-3; infinite beyond the fold, NaN next to it and on springs.

    Such a segment is a number of equal quarters of a period, with √p ℓ = K √cos α and
    √p d = sin α √cos α (2E − K) each, m = sin²(α/2).

    Returns
    -------
    ndarray, shape (n,)
    """
    if segment.kind.springs:
        return np.full_like(p, np.nan)
    if not segment.rise:
        return np.zeros_like(p)
    root_p = np.sqrt(p)
    quarters = segment.kind.first + segment.kind.second
    rises, lengths = _quarters()
    rise = root_p * scene.rise(segment) / quarters
    length = np.interp(rise, rises, lengths, right=np.nan)
    length[rise > rises[-1] * (1 + NEARLY)] = np.inf
    return quarters * length / root_p


@cache
def _quarters():
    alpha = np.linspace(0, LINE_FOLD_ANGLE, LINE_NODES)
    m1 = np.cos(alpha / 2) ** 2
    K, DK, _, _ = integrals(m1, np.zeros_like(alpha), np.ones_like(alpha))
    stretch = np.sqrt(np.cos(alpha))
    return np.sin(alpha) * stretch * (K - 2 * (1 - m1) * DK), K * stretch


class Lengths(NamedTuple):
    """One kind of segment along the nodes of κ: λ, length and D, shape (nodes, n); NaN out of range.

    `shortest` and `longest` are the extremes of the length over the nodes, `last` is the last node in range,
    −1 if there is none, shape (n,).
    """

    lam: np.ndarray
    length: np.ndarray
    D: np.ndarray
    shortest: np.ndarray
    longest: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, lam, length, D):
        """Cut what follows the first node past the range, and find the extremes."""
        known = ~np.isnan(length)
        shortest = np.where(known, length, np.inf).min(axis=0)
        longest = np.where(known, length, -np.inf).max(axis=0)
        last = np.logical_and.accumulate(known, axis=0).sum(axis=0) - 1
        return cls(lam, length, D, shortest, longest, last)


class Table:
    """Lengths of kinds of segment at n points, each computed when it is first needed.

    Nodes are graded: fine below κ = pH, where a segment leaves its line shape, coarse up to
    κ = √(2p), where a segment without reaction reaches 90°.

    Parameters
    ----------
    p : ndarray, shape (n,)
        Positive.
    scene : Scene
    """

    def __init__(self, p, scene):
        self.p, self.scene = p, scene
        self._known, self._forces = {}, {}

    @cached_property
    def kappa(self):
        """Nodes of κ, shape (nodes, n)."""
        return _nodes(self.p, self.scene)

    def line_force(self, segment):
        """λ of a segment at κ = 0, shape (n,); NaN where it has none before its fold."""
        if segment not in self._forces:
            self._forces[segment] = line_force(segment, self.p, self.scene)
        return self._forces[segment]

    def of(self, segment):
        """Lengths of a segment, up to its first node past 90°."""
        if segment not in self._known:
            if segment.kind.springs:
                self._known[segment] = Lengths.of(*follow(segment, self.p, self.scene, np.pi / 2))
            else:
                self._known[segment] = self._interpolate(segment)
        return self._known[segment]

    def _interpolate(self, segment):
        """A segment without a spring scales with 1/√p: its lengths depend on H√p alone."""
        root_p = np.sqrt(self.p)
        scaled = self.scene._replace(H=self.scene.H * root_p)
        lam, length, D = _scaled_table(segment)(scaled.H)
        past = ~below_right_angle(segment.kind, 1.0, self.kappa / root_p, lam)
        past = np.logical_or.accumulate(past & ~np.isnan(lam), axis=0)
        length[1:][past[:-1]] = np.nan
        # Next to its end the scaled table has gaps: there the segment is followed itself.
        gap = np.isnan(length[0]) & (
            scaled.rise(segment) <= LARGEST_RISE * (segment.kind.first + segment.kind.second)
        )
        gap |= (np.isnan(length[1:]) & ~past[:-1] & ~np.isnan(length[:-1])).any(axis=0)
        lam, length, D = lam * self.p, length / root_p, D / self.p
        points = np.flatnonzero(gap)
        if points.size:
            exact = follow(segment, self.p[points], self.scene.at(points), np.pi / 2)
            lam[:, points], length[:, points], D[:, points] = exact
        return Lengths.of(lam, length, D)


def _nodes(p, scene):
    grade = 0.25 * p * scene.H
    return grade * np.sinh(SHARES[:, None] * np.arcsinh(1.001 * np.sqrt(2 * p) / grade))


@cache
def _scaled_table(segment):
    """Interpolant of λ, length and D at the nodes for p = 1 over ln H, by cubics through four neighbours."""
    H = np.exp(SCALED_GRID)
    lam, length, D = follow(segment, np.ones_like(H), Scene(None, H), BEYOND)
    # In these units all three stay finite as H → 0.
    table = np.stack([lam / H, length, D * H])
    table[:, np.isnan(length)] = np.nan
    table = np.ascontiguousarray(table.transpose(2, 1, 0))

    def interpolate(H):
        place = np.interp(np.log(H), SCALED_GRID, np.arange(SCALED_GRID.size))
        cell = np.clip(place.astype(int), 1, SCALED_GRID.size - 3)
        x = np.log(H)
        values = 0.0
        for i in range(-1, 3):
            weight = np.ones_like(H)
            for j in range(-1, 3):
                if i != j:
                    weight *= (x - SCALED_GRID[cell + j]) / (SCALED_GRID[cell + i] - SCALED_GRID[cell + j])
            values = values + weight[:, None, None] * table[cell + i]
        lam, length, D = values.transpose(2, 1, 0)
        outside = (x < SCALED_GRID[0]) | (x > SCALED_GRID[-1])
        length[:, outside] = np.nan
        return lam * H, length, D / H

    return interpolate


def follow(segment, p, scene, steepest_angle):
    """λ, length and D of a segment at the nodes, shape (nodes, n), up to the first past an angle."""
    nodes = _nodes(p, scene)
    lam, length, D = np.full((3, *nodes.shape), np.nan)
    force = line_force(segment, p, scene)
    alive = np.flatnonzero(np.isfinite(force))
    force = force[alive]
    for node, kappa in enumerate(nodes):
        here = _settle(segment, p[alive], scene.at(alive), kappa[alive], force)
        lam[node, alive], length[node, alive], D[node, alive] = here[:3]
        if node + 1 == NODES:
            break
        force, along, swing = here[0], here[3], here[4]
        goes_on = np.isfinite(here[1]) & (swing < steepest_angle)
        force = (force + along * (nodes[node + 1, alive] - kappa[alive]))[goes_on]
        alive = alive[goes_on]
    return lam, length, D


def _settle(segment, p, scene, kappa, lam):
    """λ, length, D, dλ/dκ and the steepest angle of a segment at fixed κ."""
    rise, lam = scene.rise(segment), lam.copy()
    length, D, along = np.full((3, p.size), np.nan)
    live = np.arange(p.size)
    for _ in range(NODE_STEPS):
        g = geometry(arc(segment.kind, pendulum(p[live], kappa[live], lam[live])))
        step = (rise[live] - g.rise) / g.rise_lam
        lam[live] += step
        length[live], D[live] = g.length + g.length_lam * step, g.D
        along[live] = -g.rise_kappa / g.rise_lam
        live = live[np.abs(step) > GOOD_STEP * p[live]]
        if not live.size:
            break
    length[live] = np.nan
    return lam, length, D, along, steepest(segment.kind, pendulum(p, kappa, lam))


class Sweep(NamedTuple):
    """What the sweep of one set of segments finds below 90°, and where it ends at 90° too early to tell.

    Attributes
    ----------
    points : ndarray of int, shape (roots,)
    roots : Roots
        κ (roots,) and λ (distinct segments, roots), in no particular order.
    cut_points : ndarray of int, shape (cuts,)
    cut : Roots
        Where Σnℓ = 1 beyond 90°, or at 90° if Σnℓ − 1 still goes to zero there; NaN if a segment is steeper
        from κ = 0 on.
    """

    points: np.ndarray
    roots: Roots
    cut_points: np.ndarray
    cut: Roots


def every_root(segments, table):
    """All roots of Σnℓ = 1 below 90° for one set of segments, and where there may be more beyond.

    Parameters
    ----------
    segments : Mapping of Segment to int
    table : Table

    Returns
    -------
    Sweep
    """
    rows = [(table.of(segment), count) for segment, count in segments.items()]
    cut_points, cut = _cut(segments, table, rows)
    shortest = sum(count * row.shortest for row, count in rows)
    longest = sum(count * row.longest for row, count in rows)
    near = np.flatnonzero((shortest < 1 + NEARLY) & (longest > 1 - NEARLY))
    if not near.size:
        return Sweep(near, Roots.none(segments, 0), cut_points, cut)
    excess = sum(count * row.length[:, near] for row, count in rows) - 1
    pivot = sum(count * row.D[:, near] for row, count in rows)
    kappa = table.kappa[:, near]
    _sharpen_start(segments, table, near, excess)
    lam = np.stack([row.lam[:, near] for row, _ in rows])
    _sharpen(segments, table.p[near], table.scene.at(near), kappa, lam, excess, pivot)
    sign = np.where(excess < 0, -1.0, np.where(excess >= 0, 1.0, np.nan))

    def edges(node, point):
        """Both sides of intervals: κ, λ and Σnℓ − 1."""
        return (
            _Edge(
                kappa[place, point],
                lam[:, place, point],
                excess[place, point],
            )
            for place in (node, node + 1)
        )

    node, point = np.nonzero(sign[:-1] * sign[1:] < 0)
    brackets = [(near[point], *edges(node, point))]
    node, point = _turns(kappa, excess, pivot)
    if point.size:
        left, right = edges(node, point)
        slopes = pivot[node, point], pivot[node + 1, point]
        top = _extremum(segments, table.p[near[point]], table.scene.at(near[point]), left, right, slopes)
        crosses = np.flatnonzero(top.excess * left.excess < 0)
        left, top, right = (edge.at(crosses) for edge in (left, top, right))
        brackets += [(near[point[crosses]], left, top), (near[point[crosses]], top, right)]

    points = np.concatenate([bracket[0] for bracket in brackets])
    low, high = (
        _Edge(*(np.concatenate(values, axis=-1) for values in zip(*sides, strict=True)))
        for sides in zip(*(bracket[1:] for bracket in brackets), strict=True)
    )
    roots = _refine(segments, table.p[points], table.scene.at(points), low, high)
    below = below_right_angles(segments, table.p[points], roots)
    good, steep = roots.found & below, np.flatnonzero(roots.found & ~below)
    cut_points, cut = _together((cut_points, cut), (points[steep], roots.at(steep)))
    return Sweep(points[good], roots.at(good), cut_points, cut)


def _together(*parts):
    """Points with their roots, side by side."""
    points, roots = zip(*parts, strict=True)
    return np.concatenate(points), Roots(*(np.concatenate(f, axis=-1) for f in zip(*roots, strict=True)))


def _cut(segments, table, rows):
    """Points at which Σnℓ − 1 goes to zero at the last node, and the state there."""
    last = np.min([row.last for row, _ in rows], axis=0)
    never = np.flatnonzero(last < 0)
    some = np.flatnonzero(last >= 0)
    place = last[some], some
    excess = sum(count * row.length[place] for row, count in rows) - 1
    pivot = sum(count * row.D[place] for row, count in rows)
    going = np.flatnonzero(excess * pivot < 0)
    node, points = last[some[going]], some[going]
    lam = np.stack([row.lam[node, points] for row, _ in rows])
    at_last = Roots(np.ones(points.size, bool), table.kappa[node, points], lam)
    return _together((never, Roots.none(segments, never.size)), (points, at_last))


def _sharpen_start(segments, table, near, excess):
    """Replace Σnℓ − 1 at κ = 0 by its exact value where the table cannot tell its sign."""
    unsure = np.flatnonzero(np.abs(excess[0]) < NEARLY)
    points = near[unsure]
    lam = np.stack([table.line_force(segment)[points] for segment in segments])
    line = Roots(np.isfinite(lam).all(axis=0), np.zeros(points.size), lam)
    excess[0, unsure] = total_length(segments, table.p[points], line) - 1


def _sharpen(segments, p, scene, kappa, lam, excess, pivot):
    """Replace λ, Σnℓ − 1 and ΣnD at nodes beyond κ = 0 where the table may have the wrong sign.

    Next to a fold a node lies between two roots, or beside both, by less than the table knows.
    """
    node, point = np.nonzero(np.abs(excess[1:]) < UNSURE)
    node, p, scene = node + 1, p[point], scene.at(point)
    there = newton(segments, p, scene, kappa[node, point], lam[:, node, point], fixed_kappa=True)
    arrow = arrow_system(segments, p, scene, there.kappa, there.lam)
    good = there.found & np.isfinite(arrow.pivot)
    node, point = node[good], point[good]
    lam[:, node, point] = there.lam[:, good]
    excess[node, point], pivot[node, point] = arrow.excess[good], arrow.pivot[good]


class _Edge(NamedTuple):
    """One side of a bracket: κ (n,), λ (distinct segments, n), Σnℓ − 1 (n,)."""

    kappa: np.ndarray
    lam: np.ndarray
    excess: np.ndarray

    def at(self, where):
        return _Edge(self.kappa[where], self.lam[:, where], self.excess[where])


def _turns(kappa, excess, pivot):
    """Intervals in which Σnℓ − 1 may turn round beyond zero although its ends have the same sign."""
    a, b, slope_a, slope_b = excess[:-1], excess[1:], pivot[:-1], pivot[1:]
    node, point = np.nonzero((a * b > 0) & (slope_a * a < 0) & (slope_b * b > 0))
    width = kappa[node + 1, point] - kappa[node, point]
    a, b = a[node, point], b[node, point]
    slope_a, slope_b = slope_a[node, point] * width, slope_b[node, point] * width
    t = slope_a / (slope_a - slope_b)
    u = 1 - t
    middle = u * u * ((1 + 2 * t) * a + t * slope_a) + t * t * ((3 - 2 * t) * b - u * slope_b)
    sign = np.sign(a)
    dips = sign * middle < DIP * (np.minimum(sign * a, sign * b) - sign * middle) + DIP_ERROR
    return node[dips], point[dips]


def _extremum(segments, p, scene, left, right, slopes):
    """A point beyond zero between two nodes, if Σnℓ − 1 turns round there: false position on ΣnD."""
    a, b, (slope_a, slope_b) = left.kappa.copy(), right.kappa.copy(), (slope.copy() for slope in slopes)
    best = _Edge(left.kappa.copy(), left.lam.copy(), left.excess.copy())
    live = np.arange(a.size)
    for _ in range(EXTREMUM_STEPS):
        kappa = a[live] + (b[live] - a[live]) * slope_a[live] / (slope_a[live] - slope_b[live])
        here = scene.at(live)
        there = newton(
            segments, p[live], here, kappa, best.lam[:, live], fixed_kappa=True, most_steps=NODE_STEPS
        )
        arrow = arrow_system(segments, p[live], here, kappa, there.lam)
        best.kappa[live], best.lam[:, live], best.excess[live] = kappa, there.lam, arrow.excess
        before = arrow.pivot * slope_a[live] > 0
        first, second = live[before], live[~before]
        a[first], slope_a[first] = kappa[before], arrow.pivot[before]
        b[second], slope_b[second] = kappa[~before], arrow.pivot[~before]
        live = live[(arrow.excess * left.excess[live] > 0) & np.isfinite(arrow.pivot)]
        if not live.size:
            break
    return best


def _refine(segments, p, scene, low, high):
    """Newton from the secant between two sides of a bracket, kept between them but for the table's error."""
    share = low.excess / (low.excess - high.excess)
    width = high.kappa - low.kappa
    return newton(
        segments,
        p,
        scene,
        low.kappa + width * share,
        low.lam + (high.lam - low.lam) * share,
        bracket=Bracket(
            np.maximum(low.kappa - NEARLY * width, 0), high.kappa + NEARLY * width, np.sign(low.excess)
        ),
    )
