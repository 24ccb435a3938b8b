"""Where on its pendulum a spring holds the end of a segment.

An end held by a spring c lies between a crossing and the turning point next to it, inside the segment: at
φ = πk + η from a start, πk − η from an end, where (σ = ±1 for a start at even or odd k, or an end at odd
or even k) the strip is at the angle ϑ to the walls, counted in the sense of σ, with the curvature cϑ:

    2√(Fm) cos η = cϑ,      ϑ = σα + 2 asin(√m sin η),      −σφ₀ ≤ η ≤ π/2.

So by the pendulum's energy, with τ = ϑ/2,

    c²τ² + p sin²τ − σλ sin τ cos τ = κ²/4.

The curvature that the pendulum has at ϑ is a concave function of it, and cϑ passes it once.
"""

from typing import NamedTuple

import numpy as np

from elastica.pendulum.elliptic import TINY, integrals

STEPS, MORE_STEPS = 2, 20
"""Steps of Halley's method: for all; at most for those next to the separatrix and for taut strings."""
CONVERGED = 4e-6
"""A relative step below this leaves an error of its cube."""


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
    """Where on the pendulum `q` the spring holds the strip.

    Halley's method for τ, in which all keep their digits next to a clamp and next to a pin.
    """
    curve = _Curve(c, q.p, sigma * q.lam, q.kappa)
    tau, step = curve.start(), np.zeros_like(q.p)
    for _ in range(STEPS):
        step = curve.step(tau)
        tau = tau + step
    for _ in range(MORE_STEPS):
        far = np.flatnonzero(np.abs(step) > CONVERGED * tau)
        if not far.size:
            break
        step[far] = curve.at(far).step(tau[far])
        tau[far] += step[far]
    sin_half = sigma * q.sin_half_alpha
    sin, cos = np.sin(tau) * q.cos_half_alpha - np.cos(tau) * sin_half, c * tau / q.r
    delta = np.sqrt(cos * cos + q.m1)
    root_m = np.sqrt(q.m)
    sin, cos = sin / root_m, cos / root_m
    _, _, F, D = integrals(q.m1, sin, cos)
    return SpringEnd(c, sigma, sin, cos, delta, F, D, 2 * tau)


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


class _Curve(NamedTuple):
    """The function c²τ² + p sin²τ − σλ sin τ cos τ − κ²/4 of τ at n points, negative before its root."""

    c: float
    p: np.ndarray
    pull: np.ndarray
    kappa: np.ndarray

    def at(self, where):
        """The function at some of the points."""
        return _Curve(self.c, self.p[where], self.pull[where], self.kappa[where])

    def start(self):
        """Its root where sin τ = τ or c = 0: then its product with 1 + tan²τ is quadratic in tan τ."""
        pull, square = 0.5 * self.pull, 0.25 * self.kappa * self.kappa
        stiffness = np.maximum(self.c * self.c + self.p - square, TINY)
        root, pushes = np.sqrt(pull * pull + stiffness * square), pull > 0
        return np.arctan(np.where(pushes, pull + root, square) / np.where(pushes, stiffness, root - pull))

    def step(self, tau):
        """Halley's step from τ."""
        sin, cos = np.sin(tau), np.cos(tau)
        sin_cos, cos_double = sin * cos, (cos - sin) * (cos + sin)
        square = self.c * self.c
        bent = 0.5 * self.kappa
        value = square * tau * tau + self.p * sin * sin - self.pull * sin_cos - bent * bent
        half_slope = square * tau + self.p * sin_cos - 0.5 * self.pull * cos_double
        half_bend = square + self.p * cos_double + 2 * self.pull * sin_cos
        return -value * half_slope / (2 * half_slope * half_slope - 0.5 * value * half_bend)
