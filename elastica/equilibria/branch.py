"""The equilibria of one set of segments at one gap as a curve with the parameter k = κ/√p.

At fixed k every length scales with 1/√p, and below 90° a segment's length grows with its rise less than in
proportion (its elasticity is at most 0.634). So Σnℓ(p) falls with p at fixed k: there is one load for each
k, and the whole branch, with all its folds, is a single curve p(k), 0 ≤ k < √2. Under any control an
equilibrium is a point where a function along that curve has a given value.

The arrow of load control (`newton`) gets a border: k and ln p are unknown, and there are two more rows,

       λ_1/p       λ_2/p         k          ln p
    [ ∂d_1/∂λ_1               ∂d_1/∂k    ∂d_1/∂ln p ]   d_1  = rise_1
    [             ∂d_2/∂λ_2   ∂d_2/∂k    ∂d_2/∂ln p ]   d_2  = rise_2
    [ n_1 ∂ℓ_1    n_2 ∂ℓ_2    Σn ∂ℓ/∂k   Σn ∂ℓ/∂ln p]   Σnℓ  = 1
    [ n_1 ∂ΔL_1   n_2 ∂ΔL_2   Σn ∂ΔL/∂k  Σn ∂ΔL/∂ln p]  ΣnΔL = the shortening, if it is prescribed

of which the λ_j are eliminated first: what remains is a 2 × 2 matrix, or one number where k is given.

Not here: which points a branch has (`tracing`).
"""

from typing import NamedTuple

import numpy as np

from elastica.convergence import diverged, small, stagnated
from elastica.equilibria.newton import Roots, sign_known
from elastica.pendulum.segments import arc, load_slopes, pendulum, shortening, steepest

MOST_STEPS = 40
LONGEST_STEP = 0.5
"""Change of k, ln p or λ/p at one step."""
NOISE = 1e-6
"""Size below which steps that no longer shrink are noise."""
MET = 1e-10
"""Relative error of a shortening that is met as well as the worst conditioned points allow."""


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

    def following(self, step_k):
        """Changes of ln p (n,) and of λ/p (distinct segments, n) that meet the length and the rises."""
        step_load = -(self.excess + self.excess_k * step_k) / self.excess_load
        return step_load, self.across + self.along_k * step_k + self.along_load * step_load

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
        slopes = load_slopes(piece)
        g = slopes.geometry
        across[j] = (scene.rise(segment) - g.rise) / g.rise_lam
        along_k[j] = -g.rise_kappa * root_p / g.rise_lam
        along_load[j] = -slopes.rise_load / g.rise_lam
        totals += count * np.stack(
            [
                g.length + g.length_lam * across[j],
                g.length_kappa * root_p + g.length_lam * along_k[j],
                slopes.length_load + g.length_lam * along_load[j],
                shortening(piece) + slopes.shorter_lam * across[j],
                slopes.shorter_kappa * root_p + slopes.shorter_lam * along_k[j],
                slopes.shorter_load + slopes.shorter_lam * along_load[j],
            ]
        )
    excess, excess_k, excess_load, shorter, shorter_k, shorter_load = totals
    return Bordered(
        excess,
        excess_k,
        excess_load,
        shorter,
        shorter_k,
        shorter_load,
        across / p,
        along_k / p,
        along_load / p,
    )


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


def settle(segments, scene, k, p, lam):
    """The load at given k: Newton from a start.

    Parameters
    ----------
    segments : Mapping of Segment to int
    scene : Scene
        Of n points.
    k, p : ndarray, shape (n,)
    lam : ndarray, shape (distinct segments, n)

    Returns
    -------
    Points
    """

    def stay(linear, live, k):
        return np.zeros(live.size), True

    return _newton(segments, scene, k, p, lam, stay)


def settle_at_shortening(segments, scene, k, p, lam, target, bracket):
    """The load and k at given shortening: Newton from a start, k kept in its bracket.

    Parameters
    ----------
    segments, scene, k, p, lam
        As for `settle`.
    target : ndarray, shape (n,)
        Shortening.
    bracket : Bracket
        Interval of k in which the shortening crosses its target.

    Returns
    -------
    Points
    """

    def approach(linear, live, k):
        missing = linear.shorter - target[live] - linear.shorter_load / linear.excess_load * linear.excess
        aside = np.maximum(np.abs(linear.across).max(axis=0), np.abs(linear.excess / linear.excess_load))
        step, replaced = bracket.confine(
            live, k, missing, sign_known(missing, aside), -missing / linear.shortening_k
        )
        # A step to the middle is small when the interval is, whatever is in it.
        return step, ~replaced | (np.abs(missing) <= MET * target[live])

    return _newton(segments, scene, k, p, lam, approach)


def _newton(segments, scene, k, p, lam, move):
    """Newton along branches: `move` gives the steps of k, and whether they may be the last ones.

    Parameters
    ----------
    move : callable
        Of `Bordered`, positions (m,) and k (m,) of points; gives the steps (m,) and bool (m,).
    """
    k, p, lam = k.copy(), p.copy(), lam.copy()
    found = np.zeros(p.size, bool)
    live = np.flatnonzero(np.isfinite(p) & np.isfinite(lam).all(axis=0))
    previous = np.full(p.size, np.inf)
    for _ in range(MOST_STEPS):
        if not live.size:
            break
        linear = bordered(segments, p[live], scene.at(live), k[live], lam[:, live])
        step_k, trusted = move(linear, live, k[live])
        step_load, step_lam = linear.following(step_k)
        size = np.maximum(np.abs(step_lam).max(axis=0), np.abs(step_load))
        size = np.maximum(size, np.abs(step_k))
        shrink = np.minimum(1, LONGEST_STEP / np.maximum(size, 1e-300))
        k[live] += shrink * step_k
        lam[:, live] = (lam[:, live] / p[live] + shrink * step_lam) * p[live]
        grow = np.exp(shrink * step_load)
        p[live] *= grow
        lam[:, live] *= grow
        found[live] = (small(size) | stagnated(size, previous[live], NOISE)) & trusted
        previous[live] = size
        live = live[~found[live] & ~diverged(size)]
    return Points(found, k, p, lam)


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
