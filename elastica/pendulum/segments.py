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

An end held by a spring c lies between a crossing and the turning point next to it (`held_end`).
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from elastica.pendulum.elliptic import integrals
from elastica.pendulum.spring_end import hold

HALF = Fraction(1, 2)
TINY = np.finfo(float).tiny


class Kind(NamedTuple):
    """Ends of a segment as positions k along the pendulum's phase, and the springs that hold them.

    `Kind(0, 1)` is S between clamps or walls, `Kind(-1, 1)` is A, `Kind(1/2, 1)` and `Kind(-1/2, 1)`
    are S and A from a pin, `Kind(0, 1, c)` and `Kind(-1, 1, c)` from a spring. The springs are those of
    strip ends in units of EI/L; infinite at a contact or clamp (integer k) and at a pin (half-integer).
    """

    start: Fraction | int
    end: Fraction | int
    start_spring: float = np.inf
    end_spring: float = np.inf

    @property
    def first(self):
        """Multiple of K and E in the segment's ΔF and ΔE."""
        return int(2 * (self.end - self.start))

    @property
    def second(self):
        """Multiple of F(φ₀|m) and E(φ₀|m) in ΔF and ΔE; also (κ_start − κ_end)/κ, springs apart."""
        end = _sign(self.end) if np.isinf(self.end_spring) else 0
        return end - (_sign(self.start) if np.isinf(self.start_spring) else 0)

    @property
    def springs(self):
        """Springs c of the held ends, each with its sign σ."""
        start = [(self.start_spring, -_sign(self.start))] if np.isfinite(self.start_spring) else []
        return start + ([(self.end_spring, _sign(self.end))] if np.isfinite(self.end_spring) else [])

    @property
    def turning_points(self):
        """Number of places with θ' = 0, pinned ends included."""
        half_odd = -(-(self.start - HALF) // 1), (self.end - HALF) // 1
        return int(half_odd[1] - half_odd[0] + 1)

    @property
    def crossings(self):
        """Parts of the segment from its start to each interior point with θ = 0, as kinds."""
        inner = range(int(self.start // 1) + 1, int(-(-self.end // 1)))
        return tuple(Kind(self.start, k, self.start_spring) for k in inner)

    def extended(self, periods):
        """The same kind with this many extra full periods at its start."""
        return self._replace(start=self.start - 2 * periods)


def _sign(k):
    """−1, +1 or 0: coefficient of φ₀ in the phase at k."""
    if k != int(k):
        return 0
    return 1 if int(k) % 2 else -1


class Pendulum(NamedTuple):
    """The pendulum that passes θ = 0 with curvature ±κ under p and λ, and its partial derivatives.

    All fields are arrays of one shape. `K, DK, f, Df` are the integrals of `elliptic.integrals` at φ₀.
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


class Arc(NamedTuple):
    """A segment of `kind` on the pendulum `q`: ΔF, ΔD = Δ(F − E)/m and κ_start − κ_end, arrays."""

    kind: Kind
    q: Pendulum
    F: np.ndarray
    D: np.ndarray
    jump: np.ndarray
    held: list

    @property
    def W(self):
        """Change of 2E − F along the segment."""
        return self.F - 2 * self.q.m * self.D


def arc(kind, q):
    """The piece of the pendulum `q` that a segment of `kind` covers."""
    first, second = kind.first, kind.second
    F, D, jump = first * q.K, first * q.DK, second * q.kappa
    if second:
        F, D = F + second * q.f, D + second * q.Df
    held = [hold(c, sigma, q) for c, sigma in kind.springs]
    for end in held:
        F, D = F - end.F, D - end.D
        jump = jump + 2 * end.sigma * q.r * np.sqrt(q.m) * end.cos
    return Arc(kind, q, F, D, jump, held)


def start_phase(kind, q):
    """F(φ|m) at the start of a segment, so that sin(ψ/2) = √m sn(start_phase + √F s | m) along it."""
    if np.isfinite(kind.start_spring):
        return 2 * float(kind.start) * q.K + hold(*kind.springs[0], q).F
    return 2 * float(kind.start) * q.K + _sign(kind.start) * q.f


def swing_at(q, sn, cn):
    """Angle ψ = θ − α where the Jacobi functions have the values `sn`, `cn` (n, samples)."""
    m, m1 = q.m[:, None], q.m1[:, None]
    return 2 * np.arctan2(np.sqrt(m) * sn, np.sqrt(m1 + m * cn * cn))


def length(segment):
    """Length ℓ = ΔF/√F of an arc."""
    return segment.F / segment.q.r


def rise(segment):
    """Height gained, d = Δκ cos α/F + sin α (2ΔE/√F − ℓ), written without cancellation."""
    q = segment.q
    return segment.jump * q.p / q.F**2 + q.lam * segment.W / (q.F * q.r)


class Geometry(NamedTuple):
    """Length and rise of a segment with their partial derivatives, arrays of one shape.

    `length_load` and `rise_load` are derivatives with respect to ln p at fixed κ/√p and λ/p, `shorter_…`
    those of the shortening; None unless asked for.
    """

    length: np.ndarray
    rise: np.ndarray
    length_kappa: np.ndarray
    length_lam: np.ndarray
    rise_kappa: np.ndarray
    rise_lam: np.ndarray
    length_load: np.ndarray | None = None
    rise_load: np.ndarray | None = None
    shorter_kappa: np.ndarray | None = None
    shorter_lam: np.ndarray | None = None
    shorter_load: np.ndarray | None = None

    @property
    def D(self):
        """Change of length with κ at fixed rise, D = ℓ_κ − ℓ_λ d_κ/d_λ."""
        return self.length_kappa - self.length_lam * self.rise_kappa / self.rise_lam


def geometry(segment, load=False):
    """Length, rise and derivatives of an arc, with `load` also those that a change of p needs.

    At fixed m, ∂F/∂φ = 1/cos(α/2) and ∂E/∂φ = cos(α/2) at φ₀; ∂K/∂m = (K − D)/(2m₁),
    ∂F/∂m = (F − D − sin φ₀ cos φ₀/cos(α/2))/(2m₁) and ∂E/∂m = −D/2 are regular as m → 0. At a held end
    η changes with κ and λ by the implicit function theorem.
    """
    kind, q, G, D, jump, held = segment
    second = kind.second
    p, kappa, F, r, m = q.p, q.kappa, q.F, q.r, q.m
    cos_alpha, sin_alpha = p / F, q.lam / F
    sin_half, cos_half = q.sin_half_alpha, q.cos_half_alpha

    G_m = kind.first * (q.K - q.DK)
    if second:
        four_F_m = 4 * F * m
        G_m = G_m + second * (q.f - q.Df - 2 * r * kappa * sin_half / (four_F_m * cos_half))
        phi_kappa = (-2 * second) * r * sin_half / four_F_m
        phi_lam = second * kappa * cos_half / (four_F_m * r)
    for end in held:
        G_m = G_m - (end.F - end.D - end.sin * end.cos / end.delta)
    G_m = G_m / (2 * q.m1)
    W = segment.W
    W_m = -D - G_m

    m_kappa = kappa / (2 * F)
    m_lam = sin_alpha * (2 * p - kappa * kappa) / (4 * F * F)
    G_kappa, G_lam = G_m * m_kappa, G_m * m_lam
    W_kappa, W_lam = W_m * m_kappa, W_m * m_lam
    jump_kappa, jump_lam = second, 0.0
    if second:
        W_phi = 2 * cos_half - 1 / cos_half
        G_kappa = G_kappa + phi_kappa / cos_half
        G_lam = G_lam + phi_lam / cos_half
        W_kappa = W_kappa + W_phi * phi_kappa
        W_lam = W_lam + W_phi * phi_lam
    half_slope = sin_alpha / (2 * F)
    tilt = cos_alpha / F
    for end in held:
        # One factor √m is taken out of the condition for η.
        by_m = (r * end.cos - end.c * end.sin / end.delta) / m
        by_eta = 2 * (r * end.sin + end.c * end.cos / end.delta)
        by_lam = 2 * end.cos * half_slope * r - end.c * end.sigma * tilt / np.sqrt(m)
        eta_kappa = by_m * m_kappa / by_eta
        eta_lam = (by_m * m_lam + by_lam) / by_eta
        W_eta = 2 * end.delta - 1 / end.delta
        bend = 2 * end.sigma * r * np.sqrt(m)
        G_kappa, G_lam = G_kappa - eta_kappa / end.delta, G_lam - eta_lam / end.delta
        W_kappa, W_lam = W_kappa - W_eta * eta_kappa, W_lam - W_eta * eta_lam
        jump_kappa = jump_kappa + bend * (end.cos * m_kappa / (2 * m) - end.sin * eta_kappa)
        jump_lam = jump_lam + bend * (end.cos * (m_lam / (2 * m) + half_slope) - end.sin * eta_lam)

    slopes = Geometry(
        length=G / r,
        rise=jump * tilt + sin_alpha * W / r,
        length_kappa=G_kappa / r,
        length_lam=(G_lam - half_slope * G) / r,
        rise_kappa=jump_kappa * tilt + sin_alpha * W_kappa / r,
        rise_lam=(
            jump_lam * tilt
            - 2 * jump * tilt * sin_alpha / F
            + (cos_alpha * tilt * W + sin_alpha * (W_lam - half_slope * W)) / r
        ),
    )
    # Where the ends of a free shape meet, it turns with the force at no cost: 0/0 is to be 0.
    slopes.rise_lam[slopes.rise_lam == 0] = TINY
    if not load:
        return slopes
    advance_kappa = -sin_alpha * jump_kappa / F + cos_alpha * W_kappa / r
    advance_lam = (
        -sin_alpha * jump_lam / F
        - jump * (cos_alpha**2 - sin_alpha**2) / F**2
        + (-sin_alpha * tilt * W + cos_alpha * (W_lam - half_slope * W)) / r
    )
    shorter = shortening(segment)
    length_load, rise_load, advance_load = -0.5 * slopes.length, -0.5 * slopes.rise, 0.0
    for end in held:
        # All lengths scale with 1/√p but for c/√p, which changes.
        eta_c = -end.angle / (2 * np.sqrt(m) * (r * end.sin + end.c * end.cos / end.delta))
        eta_load = -0.5 * end.c * eta_c
        W_load = -(2 * end.delta - 1 / end.delta) * eta_load
        jump_load = -2 * end.sigma * r * np.sqrt(m) * end.sin * eta_load
        length_load = length_load - eta_load / end.delta / r
        rise_load = rise_load + jump_load * tilt + sin_alpha * W_load / r
        advance_load = advance_load - sin_alpha * jump_load / F + cos_alpha * W_load / r
    return slopes._replace(
        length_load=length_load,
        rise_load=rise_load,
        shorter_kappa=slopes.length_kappa - advance_kappa,
        shorter_lam=slopes.length_lam - advance_lam,
        shorter_load=-0.5 * shorter + (length_load + 0.5 * slopes.length) - advance_load,
    )


def bending_energy(segment):
    """½∫θ'² ds over an arc in units of EI/L, 2√F m (ΔF − ΔD), and the energy ½cθ² of its springs."""
    q = segment.q
    springs = sum(0.5 * end.c * end.angle**2 for end in segment.held)
    return 2 * q.r * q.m * (segment.F - segment.D) + springs


def shortening(segment):
    """∫(1 − cos θ) ds over an arc, as a sum of terms of the order θ²."""
    q = segment.q
    bow = 2 * q.sin_half_alpha**2 * segment.F + 2 * q.m * (q.p / q.F) * segment.D
    return bow / q.r + segment.jump * q.lam / q.F**2


def below_right_angle(kind, p, kappa, lam):
    """Whether |θ| < 90° all along a segment that rises: θ'² = κ² − 2p + 2λ sin θ is negative there.

    One turning point is the upper one, two see both sides.
    """
    pull = lam if kind.turning_points == 1 else np.abs(lam)
    return 0.5 * kappa * kappa < p - pull


def steepest(kind, q):
    """Largest |θ| on a segment that rises: one turning point is the upper one, two see both."""
    if kind.turning_points == 1:
        return np.abs(q.alpha + q.swing)
    return np.abs(q.alpha) + q.swing
