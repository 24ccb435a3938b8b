"""One free segment of the strip in closed form: length, rise, derivatives, energy.

Between contacts the strip obeys θ'' = −p sin θ + λ cos θ. With F = √(p² + λ²), α = atan2(λ, p) and
ψ = θ − α this is the pendulum ψ'' = −F sin ψ. A phase φ = atan2(2√F sin(ψ/2), θ') runs along it; the
places that matter are

    θ = 0 (contact, clamp)      φ = πk − φ₀ (k even, curvature +κ)   or   πk + φ₀ (k odd, curvature −κ)
    θ' = 0 (pin, turning point)  φ = πk, k half an odd number

           θ' ↑        k = 1/2
              |      .-"-.                   crossings have an integer k,
        k = 0 +.---'       '---. k = 1       turning points an integer plus one half
     ---------+-----------------+-------→ φ
           −φ₀ |               π + φ₀

so a segment is named by the k of its two ends (`Kind`) and everything else follows from that pair.
Segments are written in their rising convention and end at k = 1 wherever they end on a wall.
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from elastica.elliptic import integrals

HALF = Fraction(1, 2)
TINY = np.finfo(float).tiny


class Kind(NamedTuple):
    """Ends of a segment as positions k along the pendulum's phase.

    `Kind(0, 1)` is S between clamps or walls, `Kind(-1, 1)` is A, `Kind(1/2, 1)` and `Kind(-1/2, 1)`
    are S and A from a pin.
    """

    start: Fraction | int
    end: Fraction | int

    @property
    def first(self):
        """Multiple of K and E in the segment's ΔF and ΔE."""
        return int(2 * (self.end - self.start))

    @property
    def second(self):
        """Multiple of F(φ₀|m) and E(φ₀|m) in ΔF and ΔE; also (κ_start − κ_end)/κ."""
        return _sign(self.end) - _sign(self.start)

    @property
    def turning_points(self):
        """Number of places with θ' = 0, pinned ends included."""
        half_odd = -(-(self.start - HALF) // 1), (self.end - HALF) // 1
        return int(half_odd[1] - half_odd[0] + 1)

    @property
    def crossings(self):
        """Parts of the segment from its start to each interior point with θ = 0, as kinds."""
        inner = range(int(self.start // 1) + 1, int(-(-self.end // 1)))
        return tuple(Kind(self.start, k) for k in inner)


def _sign(k):
    """−1, +1 or 0: coefficient of φ₀ in the phase at k."""
    if k != int(k):
        return 0
    return 1 if int(k) % 2 else -1


class Pendulum(NamedTuple):
    """The pendulum that passes θ = 0 with curvature ±κ under p and λ, and its partial derivatives.

    All fields are arrays of one shape. `K, DK, f, Df` are the integrals of `elliptic.integrals` at φ₀;
    a suffix `_kappa` or `_lam` marks a derivative.
    """

    p: np.ndarray
    kappa: np.ndarray
    lam: np.ndarray
    F: np.ndarray
    r: np.ndarray
    m: np.ndarray
    m1: np.ndarray
    sin_half_alpha: np.ndarray
    cos_half_alpha: np.ndarray
    K: np.ndarray
    DK: np.ndarray
    f: np.ndarray
    Df: np.ndarray

    @property
    def alpha(self):
        """Direction of the resultant force, α = atan2(λ, p)."""
        return 2 * np.arctan2(self.sin_half_alpha, self.cos_half_alpha)

    @property
    def swing(self):
        """Amplitude 2 asin √m of ψ."""
        return 2 * np.arctan2(np.sqrt(self.m), np.sqrt(self.m1))


def pendulum(p, kappa, lam, m1=None):
    """Set up the pendulum for thrust p, shared curvature κ ≥ 0 and force λ.

    Parameters
    ----------
    p, kappa, lam : ndarray, shape (...,)
        In units with EI = L = 1. p ≥ 0, κ² < 2(F + p); not both κ and λ zero.
    m1 : ndarray, optional
        1 − m where it is known better than κ tells, NaN elsewhere: near the separatrix κ² = 2(F + p)
        rounding of κ leaves no digit of it.

    Returns
    -------
    Pendulum
    """
    F = np.hypot(p, lam)
    r = np.sqrt(F)
    root = np.sqrt(2 * F * (F + p))
    sin_half = lam / root
    cos_half = (F + p) / root
    quarter = kappa * kappa / (4 * F)
    m = np.minimum(quarter + sin_half * sin_half, 1.0)
    by_kappa = cos_half * cos_half - quarter
    m1 = by_kappa if m1 is None else np.where(np.isnan(m1), by_kappa, m1)
    sqrt_m = np.sqrt(np.maximum(m, TINY))
    K, DK, f, Df = integrals(m1, sin_half / sqrt_m, kappa / (2 * r * sqrt_m))
    return Pendulum(p, kappa, lam, F, r, m, m1, sin_half, cos_half, K, DK, f, Df)


def start_phase(kind, q):
    """F(φ|m) at the start of a segment, so that sin(ψ/2) = √m sn(start_phase + √F s | m) along it."""
    return 2 * float(kind.start) * q.K + _sign(kind.start) * q.f


def swing_at(q, sn, cn):
    """Angle ψ = θ − α where the Jacobi functions have the values `sn`, `cn` (n, samples)."""
    m, m1 = q.m[:, None], q.m1[:, None]
    return 2 * np.arctan2(np.sqrt(m) * sn, np.sqrt(m1 + m * cn * cn))


def length(kind, q):
    """Length ℓ = ΔF/√F of a segment of `kind` on the pendulum `q`."""
    return (kind.first * q.K + kind.second * q.f) / q.r


def rise(kind, q):
    """Height gained, d = Δκ cos α/F + sin α (2ΔE/√F − ℓ), written without cancellation."""
    first, second = kind.first, kind.second
    W = first * (q.K - 2 * q.m * q.DK) + second * (q.f - 2 * q.m * q.Df)
    return second * q.kappa * q.p / q.F**2 + q.lam * W / (q.F * q.r)


class Geometry(NamedTuple):
    """Length and rise of a segment with their partial derivatives, arrays of one shape."""

    length: np.ndarray
    rise: np.ndarray
    length_kappa: np.ndarray
    length_lam: np.ndarray
    rise_kappa: np.ndarray
    rise_lam: np.ndarray

    @property
    def D(self):
        """Change of length with κ at fixed rise, D = ℓ_κ − ℓ_λ d_κ/d_λ."""
        return self.length_kappa - self.length_lam * self.rise_kappa / self.rise_lam


def geometry(kind, q):
    """Length, rise and derivatives of a segment of `kind` on the pendulum `q`.

    At fixed m, ∂F/∂φ = 1/cos(α/2) and ∂E/∂φ = cos(α/2) at φ₀; ∂K/∂m = (K − D)/(2m₁),
    ∂F/∂m = (F − D − sin φ₀ cos φ₀/cos(α/2))/(2m₁) and ∂E/∂m = −D/2 are regular as m → 0.
    """
    first, second = kind.first, kind.second
    p, kappa, F, r, m = q.p, q.kappa, q.F, q.r, q.m
    cos_alpha, sin_alpha = p / F, q.lam / F
    sin_half, cos_half = q.sin_half_alpha, q.cos_half_alpha

    G = first * q.K
    D = first * q.DK
    G_m = first * (q.K - q.DK)
    if second:
        four_F_m = 4 * F * m
        G = G + second * q.f
        D = D + second * q.Df
        G_m = G_m + second * (q.f - q.Df - 2 * r * kappa * sin_half / (four_F_m * cos_half))
        phi_kappa = (-2 * second) * r * sin_half / four_F_m
        phi_lam = second * kappa * cos_half / (four_F_m * r)
    G_m = G_m / (2 * q.m1)
    W = G - 2 * m * D
    W_m = -D - G_m

    m_kappa = kappa / (2 * F)
    m_lam = sin_alpha * (2 * p - kappa * kappa) / (4 * F * F)
    G_kappa, G_lam = G_m * m_kappa, G_m * m_lam
    W_kappa, W_lam = W_m * m_kappa, W_m * m_lam
    if second:
        W_phi = 2 * cos_half - 1 / cos_half
        G_kappa = G_kappa + phi_kappa / cos_half
        G_lam = G_lam + phi_lam / cos_half
        W_kappa = W_kappa + W_phi * phi_kappa
        W_lam = W_lam + W_phi * phi_lam

    half_slope = sin_alpha / (2 * F)
    tilt = cos_alpha / F
    return Geometry(
        length=G / r,
        rise=second * kappa * tilt + sin_alpha * W / r,
        length_kappa=G_kappa / r,
        length_lam=(G_lam - half_slope * G) / r,
        rise_kappa=second * tilt + sin_alpha * W_kappa / r,
        rise_lam=(
            -2 * second * kappa * tilt * sin_alpha / F
            + (cos_alpha * tilt * W + sin_alpha * (W_lam - half_slope * W)) / r
        ),
    )


def bending_energy(kind, q):
    """½∫θ'² ds over the segment, in units of EI/L: 2√F m (ΔF − ΔD)."""
    return 2 * q.r * q.m * (kind.first * (q.K - q.DK) + kind.second * (q.f - q.Df))


def shortening(kind, q):
    """∫(1 − cos θ) ds over the segment, as a sum of terms of the order θ²."""
    cos_alpha = q.p / q.F
    G = kind.first * q.K + kind.second * q.f
    D = kind.first * q.DK + kind.second * q.Df
    bow = 2 * q.sin_half_alpha**2 * G + 2 * q.m * cos_alpha * D
    return bow / q.r + kind.second * q.kappa * q.lam / q.F**2


def steepest(kind, q):
    """Largest |θ| on a segment that rises: one turning point is the upper one, two see both."""
    if kind.turning_points == 1:
        return np.abs(q.alpha + q.swing)
    return np.abs(q.alpha) + q.swing
