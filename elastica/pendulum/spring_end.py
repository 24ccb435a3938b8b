"""Where on its pendulum a spring holds the end of a segment.

An end held by a spring c lies between a crossing and the turning point next to it, inside the segment: at
φ = πk + η from a start, πk − η from an end, where (σ = ±1 for a start at even or odd k, or an end at odd
or even k)

    2√(Fm) cos η = c [σα + 2 asin(√m sin η)],      −σφ₀ ≤ η ≤ π/2.

The left side falls short of the right one at η = π/2 and exceeds it at −σφ₀, so there is a root.
"""

from typing import NamedTuple

import numpy as np

from elastica.pendulum.elliptic import integrals

MOST_STEPS = 60
CONVERGED = 1e-8
"""A relative Newton step below this leaves an error of its square."""
STIFF = 0.3
"""Distance t from a clamp's phase up to which a spring end is sought from there."""


class SpringEnd(NamedTuple):
    """An end held by a spring: c, σ, sin η, cos η, Δ = √(1 − m sin²η), F(η|m), D(η|m), its angle σθ."""

    c: float
    sigma: int
    sin: np.ndarray
    cos: np.ndarray
    delta: np.ndarray
    F: np.ndarray
    D: np.ndarray
    angle: np.ndarray

    @property
    def W_eta(self):
        """Derivative of 2E − F at η with respect to η."""
        return 2 * self.delta - 1 / self.delta


def spring_end(c, sigma, q):
    """Where on the pendulum `q` the spring holds the strip: Newton for t = η + σφ₀, kept in its bracket.

    Next to a clamp t is of the order √F/c and θ of its square: in terms of t both keep their digits.
    """
    sin_half, slope = sigma * q.sin_half_alpha, q.kappa / (2 * q.r)
    first = np.arctan2(sin_half, slope)
    low, high = np.zeros_like(first), first + np.pi / 2
    t = _start(c, sin_half, slope, first, q)
    scale = 1 / max(1.0, c)
    live = np.ones(t.shape, bool)
    for _ in range(MOST_STEPS):
        sin, cos, delta, angle = _at(t, sin_half, slope, q)
        excess = scale * (2 * q.r * cos - c * angle)
        gradient = -2 * scale * (q.r * sin + c * cos / delta)
        low, high = np.where(excess > 0, t, low), np.where(excess > 0, high, t)
        step = -excess / gradient
        outside = ~((t + step > low) & (t + step < high)) & (excess != 0)
        ahead = np.where(outside, 0.5 * (low + high), t + step)
        t = np.where(live, ahead, t)
        live = live & (outside & (high - low > 1e-15 * high) | (np.abs(step) > CONVERGED * t))
        if not live.any():
            break
    sin, cos, delta, angle = _at(t, sin_half, slope, q)
    root_m = np.sqrt(q.m)
    _, _, F, D = integrals(q.m1, sin / root_m, cos / root_m)
    return SpringEnd(c, sigma, sin / root_m, cos / root_m, delta, F, D, angle)


def eta_slopes(end, q):
    """Derivatives of η with respect to κ and λ, shape (n,) each.

    By the implicit function theorem on the condition above, from which one factor √m is taken out.
    """
    by_eta = 2 * (q.r * end.sin + end.c * end.cos / end.delta)
    by_m = (q.r * end.cos - end.c * end.sin / end.delta) / q.m
    by_lam = 2 * end.cos * q.ln_r_lam * q.r - end.c * end.sigma * q.alpha_lam / np.sqrt(q.m)
    return by_m * q.m_kappa / by_eta, (by_m * q.m_lam + by_lam) / by_eta


def eta_load(end, q):
    """Derivative of η with respect to ln p at fixed κ/√p and λ/p, shape (n,): by c/√p alone."""
    eta_c = -end.angle / (2 * np.sqrt(q.m) * (q.r * end.sin + end.c * end.cos / end.delta))
    return -0.5 * end.c * eta_c


def _start(c, sin_half, slope, first, q):
    """Start for t: next to a clamp the condition to second order, elsewhere the strip without reactions.

    A strip without load from the walls has a spring end at cot η = c/√F.
    """
    square = c * sin_half * (1 - slope * slope) / q.cos_half_alpha
    linear = 2 * (c * slope / q.cos_half_alpha - q.r * sin_half)
    root = np.sqrt(np.maximum(linear * linear + 4 * square * q.kappa, 0))
    rising, convex = linear > 0, square > 0
    below = np.where(rising, linear + root, np.where(convex, 2 * square, 1.0))
    near = np.where(rising, 2 * q.kappa, root - linear) / below
    far = np.arctan2(q.r, c) - c / (c + q.r) * np.maximum(sin_half, 0) + first
    stiff = convex & (near > 0) & (near < STIFF)
    return np.where(stiff, near, np.clip(far, 0, first + np.pi / 2))


def _at(t, sin_half, slope, q):
    """√m sin η, √m cos η, Δ and σθ at η = t − σφ₀, without cancellation as t → 0.

    The sine of θ/2 = ψ/2 + α/2 is cos(α/2)·½κ/√F·sin t + sin(α/2)(Δ − cos(α/2) cos t); where the last bracket
    is a difference it is one of squares over a sum.
    """
    sin_t, cos_t, cos_half = np.sin(t), np.cos(t), q.cos_half_alpha
    sin = slope * sin_t - sin_half * cos_t
    cos = np.maximum(slope * cos_t + sin_half * sin_t, 0)
    delta = np.sqrt(cos * cos + q.m1)
    squares = sin_t * (sin_t * (1 - slope * slope) + 2 * sin_half * slope * cos_t)
    level = cos_half * cos_t
    lifted = np.where(level > 0, squares / (delta + np.abs(level)), delta - level)
    half = cos_half * slope * sin_t + sin_half * lifted
    return sin, cos, delta, 2 * np.arctan2(half, np.sqrt(np.maximum(1 - half * half, 0)))
