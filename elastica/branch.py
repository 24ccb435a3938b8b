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

from elastica.newton import Roots
from elastica.segments import arc, geometry, pendulum, shortening, steepest
from elastica.states import Segment
from elastica.sweep import Table, every_root

NODES = 96
SEEDS = 48
LONGEST_FREE_PERIOD = 7.6
"""√p times the longest period below 90°, a little more than 4K(½)."""
MOST_STEPS = 40
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


def bordered(segments, p, H, k, lam):
    """Linearise at k (n,), p (n,) and λ (distinct segments, n)."""
    root_p = np.sqrt(p)
    totals = np.zeros((6, p.size))
    totals[0] = -1.0
    across, along_k, along_load = np.empty((3, *lam.shape))
    for j, (segment, count) in enumerate(segments.items()):
        piece = arc(segment.kind, pendulum(p, k * root_p, lam[j]))
        g = geometry(piece, load=True)
        across[j] = (segment.rise * H - g.rise) / g.rise_lam
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


def settle(segments, H, k, p, lam, target=None, bracket=None):
    """Newton for the load at fixed k; with a `target` shortening for k too, kept in its bracket.

    Parameters
    ----------
    segments : Mapping of Segment to int
    H, k, p : ndarray, shape (n,)
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
        b = bordered(segments, p[live], H[live], k[live], lam[:, live])
        step_k = np.zeros(live.size)
        if target is not None:
            missing = b.shorter - target[live] - b.shorter_load / b.excess_load * b.excess
            step_k = -missing / b.shortening_k
            step_k = bracket.confine(live, k[live], missing, step_k)
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
        converged = (size < 1e-9) | ((size < 1e-6) & (size > 0.5 * previous[live]))
        found[live] = converged
        previous[live] = size
        live = live[~converged & np.isfinite(size)]
    return Points(found, k, p, lam)


class Curve(NamedTuple):
    """Branches at n gaps, traced through nodes of k: arrays (nodes, n), λ (nodes, distinct segments, n).

    `found` is False where the branch has no point below 90°.
    """

    H: np.ndarray
    k: np.ndarray
    p: np.ndarray
    lam: np.ndarray
    found: np.ndarray


def trace(segments, H):
    """Trace the branch of a set of segments at each gap.

    Parameters
    ----------
    segments : Mapping of Segment to int
    H : ndarray, shape (n,)

    Returns
    -------
    Curve
    """
    turns = sum(count * (kind.first + abs(kind.second)) / 4 for (kind, *_), count in segments.items())
    root_p = np.linspace(0.4, LONGEST_FREE_PERIOD * turns, SEEDS)
    p, gap = (grid.ravel() for grid in np.meshgrid(root_p**2, H, indexing="ij"))
    points, roots = every_root(segments, Table(p, gap))
    seed_k, seed_gap = roots.kappa / np.sqrt(p[points]), points % H.size
    grade = 0.25 * np.pi * H
    k = grade * np.sinh(np.linspace(0, 1, NODES)[:, None] * np.arcsinh(np.sqrt(2) / grade))
    k[-1] = np.sqrt(2)
    nearest = np.full(k.shape, -1)
    for i in range(H.size):
        own = np.flatnonzero(seed_gap == i)
        if own.size:
            distance = np.abs(np.arcsinh(k[:, i, None] / grade[i]) - np.arcsinh(seed_k[own] / grade[i]))
            nearest[:, i] = own[distance.argmin(axis=1)]
    seeded = np.nonzero(nearest >= 0)
    seed = nearest[seeded]
    start_p = p[points[seed]]
    there = settle(segments, H[seeded[1]], k[seeded], start_p, roots.lam[:, seed])
    good = there.found & below_right_angle(segments, there)
    curve = Curve(
        H,
        k,
        np.full(k.shape, np.nan),
        np.full((NODES, len(segments), H.size), np.nan),
        np.zeros(k.shape, bool),
    )
    node, gap = (place[good] for place in seeded)
    curve.found[node, gap] = True
    curve.p[node, gap] = there.p[good]
    curve.lam[node, :, gap] = there.lam[:, good].T
    return curve


def below_right_angle(segments, points):
    """Whether |θ| < 90° on every segment, shape (n,)."""
    angles = [
        steepest(segment.kind, pendulum(points.p, points.k * np.sqrt(points.p), lam))
        for segment, lam in zip(segments, points.lam, strict=True)
    ]
    return np.max(angles, axis=0) < np.pi / 2


@cache
def free_branch(kind, onset):
    """The branch of a free mode from its Euler load √p = `onset` to just beyond its fold, if it has one.

    Returns
    -------
    k, p, ratio : ndarray, shape (nodes,)
        κ/√p, thrust and λ/(κ√p). The largest p is that of the fold, to rounding.
    """
    segments = {Segment(kind, 0, 0): 1}
    nothing = np.zeros(1)

    def at(k, p, ratio):
        start = np.array([k]), np.array([p]), np.array([[ratio * k * p]])
        point = settle(segments, nothing, *start)
        slope = bordered(segments, point.p, nothing, point.k, point.lam).load_k[0]
        return float(point.p[0]), float(point.lam[0, 0] / (k * point.p[0])), slope, bool(point.found[0])

    k, p, ratio = [0.0], [onset**2], [_onset_ratio(kind, onset)]
    for ahead in FREE_NODES:
        load, tilt, slope, found = at(ahead, p[-1], ratio[-1])
        if not found:
            break
        if slope < 0:
            near = p[-1], ratio[-1]
            fold = brentq(lambda k, near=near: at(k, *near)[2], k[-1] or 1e-3, ahead, xtol=1e-12)
            top = at(fold, *near)
            k, p, ratio = [*k, fold, ahead], [*p, top[0], load], [*ratio, top[1], tilt]
            break
        k, p, ratio = [*k, ahead], [*p, load], [*ratio, tilt]
    return np.array(k), np.array(p), np.array(ratio)


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
