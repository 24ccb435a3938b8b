"""Every root of many words at once: sum the lengths of their segments along κ, and refine where they make 1.

At a point a word is a sum of lengths of few kinds of segment, each a function of κ alone once its rise is
met. The roots of any sum are bracketed from the table of lengths (`lengths`) and refined on the exact
functions (`newton`). Two roots next to a fold may lie between two nodes: there the sum is followed to its
extreme.

Not here: what is steeper than 90° (`alternating`).
"""

from typing import NamedTuple

import numpy as np

from elastica.equilibria.lengths import NEARLY, NODE_STEPS
from elastica.equilibria.line import line_roots
from elastica.equilibria.newton import (
    Bracket,
    Roots,
    arrow_system,
    below_right_angles,
    newton,
    newton_at,
    total_length,
)

EXTREMUM_STEPS = 8
DIP = 0.25
"""An extremum is looked at when the estimate of its height misses zero by no more than this part of its
distance from the nodes."""
UNSURE, DIP_ERROR = 1e-4, 3e-6
"""|Σnℓ − 1| of nodes below which the table is not relied on; error of the height of an extremum between."""


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


def every_root(segments, table, begin=0):
    """All roots of Σnℓ = 1 below 90° for one set of segments, and where there may be more beyond.

    Parameters
    ----------
    segments : Mapping of Segment to int
    table : LengthTable
    begin : int
        First of its points that is looked at.

    Returns
    -------
    Sweep
    """
    rows = [(table.of(segment, begin), count) for segment, count in segments.items()]
    kappa, p, scene = table.kappa[:, begin:], table.p[begin:], table.scene.at(slice(begin, None))
    cut_points, cut = _cut(segments, kappa, rows)
    shortest = sum(count * row.shortest for row, count in rows)
    longest = sum(count * row.longest for row, count in rows)
    near = np.flatnonzero((shortest < 1 + NEARLY) & (longest > 1 - NEARLY))
    if not near.size:
        return Sweep(near, Roots.none(segments, 0), begin + cut_points, cut)
    p, scene = p[near], scene.at(near)
    nodes = _Nodes(
        kappa[:, near],
        np.stack([row.lam[:, near] for row, _ in rows]),
        sum(count * row.length[:, near] for row, count in rows) - 1,
        sum(count * row.D[:, near] for row, count in rows),
    )
    _sharpen_start(segments, p, scene, nodes.excess)
    _sharpen(segments, p, scene, nodes)
    point, low, high = _brackets(segments, p, scene, nodes)
    points, p, scene = near[point], p[point], scene.at(point)
    roots = _refine(segments, p, scene, low, high)
    below = below_right_angles(segments, p, roots)
    good, steep = roots.found & below, np.flatnonzero(roots.found & ~below)
    cut_points, cut = _together((cut_points, cut), (points[steep], roots.at(steep)))
    return Sweep(begin + points[good], roots.at(good), begin + cut_points, cut)


class _Nodes(NamedTuple):
    """Words at the nodes: κ, Σnℓ − 1 and ΣnD (nodes, n), λ (distinct segments, nodes, n)."""

    kappa: np.ndarray
    lam: np.ndarray
    excess: np.ndarray
    pivot: np.ndarray

    def at(self, node, point):
        """One side of intervals between nodes."""
        return _Side(self.kappa[node, point], self.lam[:, node, point], self.excess[node, point])


class _Side(NamedTuple):
    """One side of a bracket: κ (n,), λ (distinct segments, n), Σnℓ − 1 (n,)."""

    kappa: np.ndarray
    lam: np.ndarray
    excess: np.ndarray

    def at(self, where):
        """Some of the points."""
        return _Side(self.kappa[where], self.lam[:, where], self.excess[where])

    @classmethod
    def joined(cls, sides):
        """Several of them side by side."""
        return cls(*(np.concatenate(fields, axis=-1) for fields in zip(*sides, strict=True)))


def _together(*parts):
    """Points with their roots, side by side."""
    points, roots = zip(*parts, strict=True)
    return np.concatenate(points), Roots(*(np.concatenate(f, axis=-1) for f in zip(*roots, strict=True)))


def _cut(segments, kappa, rows):
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
    at_last = Roots(np.ones(points.size, bool), kappa[node, points], lam)
    return _together((never, Roots.none(segments, never.size)), (points, at_last))


def _sharpen_start(segments, p, scene, excess):
    """Replace Σnℓ − 1 at κ = 0 by its exact value where the table cannot tell its sign."""
    unsure = np.flatnonzero(np.abs(excess[0]) < NEARLY)
    line = line_roots(segments, p[unsure], scene.at(unsure))
    excess[0, unsure] = total_length(segments, p[unsure], line) - 1


def _sharpen(segments, p, scene, nodes):
    """Replace λ, Σnℓ − 1 and ΣnD at nodes beyond κ = 0 where the table may have the wrong sign.

    Next to a fold a node lies between two roots, or beside both, by less than the table knows.
    """
    kappa, lam, excess, pivot = nodes
    node, point = np.nonzero(np.abs(excess[1:]) < UNSURE)
    node, p, scene = node + 1, p[point], scene.at(point)
    there = newton_at(segments, p, scene, kappa[node, point], lam[:, node, point])
    arrow = arrow_system(segments, p, scene, there.kappa, there.lam)
    good = there.found & np.isfinite(arrow.pivot)
    node, point = node[good], point[good]
    lam[:, node, point] = there.lam[:, good]
    excess[node, point], pivot[node, point] = arrow.excess[good], arrow.pivot[good]


def _brackets(segments, p, scene, nodes):
    """Intervals in which Σnℓ − 1 changes its sign: between two nodes, or on both sides of an extremum.

    Returns
    -------
    point : ndarray of int, shape (brackets,)
    low, high : _Side
    """
    sign = np.where(nodes.excess < 0, -1.0, np.where(nodes.excess >= 0, 1.0, np.nan))
    node, point = np.nonzero(sign[:-1] * sign[1:] < 0)
    brackets = [(point, nodes.at(node, point), nodes.at(node + 1, point))]
    node, point = _turns(nodes)
    if point.size:
        left, right = nodes.at(node, point), nodes.at(node + 1, point)
        slopes = nodes.pivot[node, point], nodes.pivot[node + 1, point]
        top = _extremum(segments, p[point], scene.at(point), left, right, slopes)
        crosses = np.flatnonzero(top.excess * left.excess < 0)
        point = point[crosses]
        left, top, right = (side.at(crosses) for side in (left, top, right))
        brackets += [(point, left, top), (point, top, right)]
    points, low, high = zip(*brackets, strict=True)
    return np.concatenate(points), _Side.joined(low), _Side.joined(high)


def _turns(nodes):
    """Intervals in which Σnℓ − 1 may turn round beyond zero although its ends have the same sign."""
    kappa, _, excess, pivot = nodes
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
    best = _Side(left.kappa.copy(), left.lam.copy(), left.excess.copy())
    live = np.arange(a.size)
    for _ in range(EXTREMUM_STEPS):
        kappa = a[live] + (b[live] - a[live]) * slope_a[live] / (slope_a[live] - slope_b[live])
        here = scene.at(live)
        there = newton_at(segments, p[live], here, kappa, best.lam[:, live], most_steps=NODE_STEPS)
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
