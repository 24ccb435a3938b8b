"""How long segments are: the length of each kind along κ once its rise is met, at n points.

A word's length is a sum of these (`sweep`). They are tabulated, with their derivatives D, at nodes of κ that
all kinds share; those of segments without springs are interpolated from one table at p = 1.

Every kind begins at κ = 0 with its line shape, and the rise at which it reaches 90° falls with κ: below 90°
its range is one interval from κ = 0.
"""

from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from elastica.equilibria.newton import Roots
from elastica.pendulum.line import line_force
from elastica.pendulum.segments import arc, below, geometry, pendulum
from elastica.scene import Scene

NODES = 32
SHARES = np.linspace(0, 1, NODES)
NODE_STEPS = 8
GOOD_STEP = 1e-3
"""Relative step of λ after which a node's length, corrected to first order, is good to 1e-6."""
NEARLY = 1e-2
"""Relative error that lengths interpolated in the table, or their nodes, certainly keep."""
SCALED_GRID = np.concatenate([np.arange(-23.0, -1.4, 0.1), np.arange(-1.3, 3.5, 0.02)])
"""Values of ln(H√p) of the table at p = 1."""
BEYOND = 2.0
"""Angle in radians up to which that table goes, so that it can be interpolated at 90°."""
LARGEST_RISE = 3.3054 / 4
"""√p times the rise at κ = 0 and 90°, a quarter of a period's."""


class SegmentLengths(NamedTuple):
    """One kind of segment at the nodes of κ: λ, length and D, shape (nodes, n); NaN out of range.

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


class LengthTable:
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

    def line_roots(self, segments):
        """The segments at κ = 0, wherever all exist: Roots."""
        for segment in segments:
            if segment not in self._forces:
                self._forces[segment] = line_force(segment.kind, self.p, self.scene.rise(segment))
        return Roots.of_lines([self._forces[segment] for segment in segments])

    def of(self, segment, begin=0):
        """Lengths of a segment at the points from `begin` on, up to its first node past 90°."""
        known_from, lengths = self._known.get(segment, (self.p.size + 1, None))
        if begin < known_from:
            p, scene = self.p[begin:], self.scene.at(slice(begin, None))
            if segment.kind.springs:
                lengths = SegmentLengths.of(*_follow(segment, p, scene, np.pi / 2))
            else:
                lengths = self._interpolate(segment, p, scene, self.kappa[:, begin:])
            known_from, self._known[segment] = begin, (begin, lengths)
        return SegmentLengths(*(field[..., begin - known_from :] for field in lengths))

    @staticmethod
    def _interpolate(segment, p, scene, kappa):
        """A segment without a spring scales with 1/√p: its lengths depend on H√p alone."""
        root_p = np.sqrt(p)
        scaled = scene.scaled(root_p)
        lam, length, D = _at_unit_load(segment)(scaled.H)
        past = ~below(segment.kind, 1.0, kappa / root_p, lam)
        past = np.logical_or.accumulate(past & ~np.isnan(lam), axis=0)
        length[1:][past[:-1]] = np.nan
        # Next to its end the scaled table has gaps: there the segment is followed itself.
        gap = np.isnan(length[0]) & (
            scaled.rise(segment) <= LARGEST_RISE * (segment.kind.first + segment.kind.second)
        )
        gap |= (np.isnan(length[1:]) & ~past[:-1] & ~np.isnan(length[:-1])).any(axis=0)
        lam, length, D = lam * p, length / root_p, D / p
        points = np.flatnonzero(gap)
        if points.size:
            exact = _follow(segment, p[points], scene.at(points), np.pi / 2)
            lam[:, points], length[:, points], D[:, points] = exact
        return SegmentLengths.of(lam, length, D)


def _nodes(p, scene):
    grade = 0.25 * p * scene.H
    return grade * np.sinh(SHARES[:, None] * np.arcsinh(1.001 * np.sqrt(2 * p) / grade))


@cache
def _at_unit_load(segment):
    """Interpolant of λ, length and D at the nodes for p = 1 over ln H, by cubics through four neighbours."""
    H = np.exp(SCALED_GRID)
    lam, length, D = _follow(segment, np.ones_like(H), Scene(None, H), BEYOND)
    # In these units all three stay finite as H → 0.
    table = np.stack([lam / H, length, D * H])
    table[:, np.isnan(length)] = np.nan
    table = np.ascontiguousarray(table.transpose(2, 1, 0))

    def interpolate(H):
        place = np.interp(np.log(H), SCALED_GRID, np.arange(SCALED_GRID.size))
        cell = np.clip(place.astype(int), 1, SCALED_GRID.size - 3)
        x = np.log(H)
        values: Any = 0.0
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


def _follow(segment, p, scene, steepest_angle):
    """λ, length and D of a segment at the nodes, shape (nodes, n), up to the first past an angle."""
    nodes = _nodes(p, scene)
    lam, length, D = np.full((3, *nodes.shape), np.nan)
    force = line_force(segment.kind, p, scene.rise(segment))
    alive = np.flatnonzero(np.isfinite(force))
    force, before = force[alive], None
    for node, kappa in enumerate(nodes):
        kappa, own = kappa[alive], p[alive]
        force, ell, pivot, along = _at_node(segment, own, scene.at(alive), kappa, force)
        lam[node, alive], length[node, alive], D[node, alive] = force, ell, pivot
        if node + 1 == NODES:
            break
        goes_on = np.isfinite(ell) & below(segment.kind, own, kappa, force, steepest_angle)
        alive = alive[goes_on]
        last = np.stack([kappa, force, along])[:, goes_on]
        force = _ahead(last, None if before is None else before[:, goes_on], nodes[node + 1, alive])
        before = last
    return lam, length, D


def _ahead(last, before, kappa):
    """λ at the next node κ, by the cubic through the last node and the one before: κ, λ and dλ/dκ of each."""
    x = kappa - last[0]
    if before is None:
        return last[1] + last[2] * x
    h = last[0] - before[0]
    mean = (last[1] - before[1]) / h
    bend, twist = last[2] - mean, last[2] - 2 * mean + before[2]
    s = x / h
    return last[1] + x * (last[2] + s * (bend + (s + 1) * twist))


def _at_node(segment, p, scene, kappa, lam):
    """λ, length, D and dλ/dκ of a segment at fixed κ."""
    rise, lam = scene.rise(segment), lam.copy()
    length, D, along = np.full((3, p.size), np.nan)
    live = np.arange(p.size)
    for _ in range(NODE_STEPS):
        g = geometry(arc(segment.kind, pendulum(p[live], kappa[live], lam[live])))
        step = (rise[live] - g.rise) / g.rise_lam
        lam[live] += step
        length[live], D[live] = g.length + g.length_lam * step, g.D
        along[live] = -g.rise_kappa / g.rise_lam
        live = live[np.abs(step) > GOOD_STEP * (np.abs(lam[live]) + kappa[live] * np.sqrt(p[live]))]
        if not live.size:
            break
    length[live] = np.nan
    return lam, length, D, along
