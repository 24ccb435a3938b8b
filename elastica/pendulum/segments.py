"""One free segment of the strip in closed form: length, rise, derivatives, energy.

      y ↑                         _.--''''  wall, θ = 0, curvature −κ        p  thrust
        |                      .-'                                           λ  force across
        |                   _-'                                              F  their resultant √(p² + λ²),
    rise|                .-'                                                    at the angle α to the walls
        |           _.-''                                                    ℓ  length along the segment
        |____...--''          clamp, θ = 0, curvature +κ
        +----- advance --------------→ x

Between contacts the strip obeys θ'' = −p sin θ + λ cos θ: the elastica (A. E. H. Love, A Treatise on the
Mathematical Theory of Elasticity, 4th edition, art. 262). With F = √(p² + λ²), α = atan2(λ, p) and
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

An end held by a spring c lies between a crossing and the turning point next to it (`spring_end`).
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from elastica.pendulum.elliptic import integrals
from elastica.pendulum.spring_end import eta_load, eta_slopes, spring_end

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
        end = crossing_sign(self.end) if np.isinf(self.end_spring) else 0
        return end - (crossing_sign(self.start) if np.isinf(self.start_spring) else 0)

    @property
    def springs(self):
        """Springs c at the ends, each with its sign σ."""
        start = [(self.start_spring, -crossing_sign(self.start))] if np.isfinite(self.start_spring) else []
        return start + ([(self.end_spring, crossing_sign(self.end))] if np.isfinite(self.end_spring) else [])

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

    def on_spring(self, c):
        """The same kind with another spring in the place of the one that it has."""
        held = "start_spring" if np.isfinite(self.start_spring) else "end_spring"
        return self._replace(**{held: c})

    def extended(self, periods):
        """The same kind with this many extra full periods at its start."""
        return self._replace(start=self.start - 2 * periods)


def crossing_sign(k):
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
    def sin_alpha(self):
        """The part λ/F of the resultant force across the walls' direction."""
        return self.lam / self.F

    @property
    def cos_alpha(self):
        """The part p/F of the resultant force along the walls."""
        return self.p / self.F

    @property
    def alpha_lam(self):
        """Derivative ∂α/∂λ = cos α/F."""
        return self.cos_alpha / self.F

    @property
    def ln_r_lam(self):
        """Derivative ∂ln √F/∂λ = sin α/2F."""
        return self.sin_alpha / (2 * self.F)

    @property
    def m_kappa(self):
        """Derivative ∂m/∂κ of m = κ²/4F + sin²(α/2)."""
        return self.kappa / (2 * self.F)

    @property
    def m_lam(self):
        """Derivative ∂m/∂λ of m = κ²/4F + sin²(α/2)."""
        return self.sin_alpha * (2 * self.p - self.kappa * self.kappa) / (4 * self.F * self.F)

    @property
    def swing(self):
        """Amplitude 2 asin √m of ψ."""
        return 2 * np.arctan2(np.sqrt(self.m), np.sqrt(self.m1))


def resultant(p, lam):
    """F = √(p² + λ²); NumPy's hypot, which minds the range of numbers, takes as long as twenty additions."""
    return np.sqrt(p * p + lam * lam)


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
    F = resultant(p, lam)
    r = np.sqrt(F)
    sum_of_both = F + p
    root = np.sqrt(2 * F * sum_of_both)
    sin_half, cos_half = lam / root, sum_of_both / root
    swing = kappa / (2 * r)
    quarter = swing * swing
    m = np.minimum(quarter + sin_half * sin_half, 1.0)
    by_kappa = cos_half * cos_half - quarter
    m1 = by_kappa if m1 is None else np.where(np.isnan(m1), by_kappa, m1)
    sqrt_m = np.sqrt(np.maximum(m, TINY))
    K, DK, f, Df = integrals(m1, sin_half / sqrt_m, swing / sqrt_m)
    return Pendulum(p, kappa, lam, F, r, m, m1, sin_half, cos_half, K, DK, f, Df)


class Arc(NamedTuple):
    """A segment of `kind` on the pendulum `q`: ΔF, ΔD = Δ(F − E)/m and κ_start − κ_end, arrays.

    `spring_ends` has a `SpringEnd` for each of its ends that a spring of the strip holds.
    """

    kind: Kind
    q: Pendulum
    F: np.ndarray
    D: np.ndarray
    jump: np.ndarray
    spring_ends: list

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
    spring_ends = [spring_end(c, sigma, q) for c, sigma in kind.springs]
    for end in spring_ends:
        F, D = F - end.F, D - end.D
        jump = jump + 2 * end.sigma * q.r * np.sqrt(q.m) * end.cos
    return Arc(kind, q, F, D, jump, spring_ends)


def length(segment):
    """Length ℓ = ΔF/√F of an arc."""
    return segment.F / segment.q.r


def rise(segment):
    """Height gained, d = Δκ cos α/F + sin α (2ΔE/√F − ℓ), written without cancellation."""
    q = segment.q
    return segment.jump * q.p / q.F**2 + q.lam * segment.W / (q.F * q.r)


class Geometry(NamedTuple):
    """Length ℓ and rise d of a segment with their partial derivatives, arrays of one shape."""

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


def geometry(piece):
    """Length ℓ = ΔF/√F and rise d = Δκ cos α/F + sin α (2ΔE/√F − ℓ) of an arc, with their derivatives."""
    return _geometry(piece, _phase_slopes(piece))


class LoadSlopes(NamedTuple):
    """What else changes with the load, arrays of one shape.

    `length_load`, `rise_load` and `shorter_load` are derivatives with respect to ln p at fixed κ/√p and λ/p;
    `shorter_kappa` and `shorter_lam` those of the shortening at fixed p.
    """

    geometry: Geometry
    length_load: np.ndarray
    rise_load: np.ndarray
    shorter_kappa: np.ndarray
    shorter_lam: np.ndarray
    shorter_load: np.ndarray


def load_slopes(piece):
    """The geometry of an arc, and how its length, rise and shortening change where the load does.

    All lengths scale with 1/√p but for c/√p of a spring. The shortening is ℓ less the advance in x,
    −sin α Δκ/F + cos α (2ΔE/√F − ℓ).
    """
    q, W, jump = piece.q, piece.W, piece.jump
    slopes = _phase_slopes(piece)
    g = _geometry(piece, slopes)
    F, r, cos_alpha, sin_alpha = q.F, q.r, q.cos_alpha, q.sin_alpha
    alpha_lam, ln_r_lam = cos_alpha / F, sin_alpha / (2 * F)
    advance_kappa = -sin_alpha * slopes.jump_kappa / F + cos_alpha * slopes.W_kappa / r
    advance_lam = (
        -sin_alpha * slopes.jump_lam / F
        - jump * (cos_alpha**2 - sin_alpha**2) / F**2
        + (-sin_alpha * alpha_lam * W + cos_alpha * (slopes.W_lam - ln_r_lam * W)) / r
    )
    length_load, rise_load, advance_load = -0.5 * g.length, -0.5 * g.rise, 0.0
    for end in piece.spring_ends:
        eta = eta_load(end, q)
        W_load = -end.W_eta * eta
        jump_load = -2 * end.sigma * r * np.sqrt(q.m) * end.sin * eta
        length_load = length_load - eta / end.delta / r
        rise_load = rise_load + jump_load * alpha_lam + sin_alpha * W_load / r
        advance_load = advance_load - sin_alpha * jump_load / F + cos_alpha * W_load / r
    return LoadSlopes(
        g,
        length_load=length_load,
        rise_load=rise_load,
        shorter_kappa=g.length_kappa - advance_kappa,
        shorter_lam=g.length_lam - advance_lam,
        shorter_load=-0.5 * shortening(piece) + (length_load + 0.5 * g.length) - advance_load,
    )


class _PhaseSlopes(NamedTuple):
    """Derivatives of ΔF, of W = Δ(2E − F) and of the jump κ_start − κ_end with respect to κ and λ."""

    F_kappa: np.ndarray
    F_lam: np.ndarray
    W_kappa: np.ndarray
    W_lam: np.ndarray
    jump_kappa: np.ndarray | float
    jump_lam: np.ndarray | float


def _phase_slopes(piece):
    """By the parameter m, by the phase φ₀ of the crossings it ends at, and by the phase η of its springs.

    At fixed m, ∂F/∂φ = 1/cos(α/2) and ∂E/∂φ = cos(α/2) at φ₀; ∂K/∂m = (K − D)/(2m₁),
    ∂F/∂m = (F − D − sin φ₀ cos φ₀/cos(α/2))/(2m₁) and ∂E/∂m = −D/2 are regular as m → 0 (DLMF 19.4).
    """
    kind, q = piece.kind, piece.q
    second = kind.second
    kappa, F, r, m = q.kappa, q.F, q.r, q.m
    sin_half, cos_half = q.sin_half_alpha, q.cos_half_alpha

    F_m = kind.first * (q.K - q.DK)
    if second:
        four_F_m = 4 * F * m
        F_m = F_m + second * (q.f - q.Df - 2 * r * kappa * sin_half / (four_F_m * cos_half))
    for end in piece.spring_ends:
        F_m = F_m - (end.F - end.D - end.sin * end.cos / end.delta)
    F_m = F_m / (2 * q.m1)
    W_m = -piece.D - F_m
    m_kappa, m_lam = q.m_kappa, q.m_lam
    F_kappa, F_lam = F_m * m_kappa, F_m * m_lam
    W_kappa, W_lam = W_m * m_kappa, W_m * m_lam
    jump_kappa, jump_lam = second, 0.0
    if second:
        phi_kappa = (-2 * second) * r * sin_half / four_F_m
        phi_lam = second * kappa * cos_half / (four_F_m * r)
        F_phi = 1 / cos_half
        W_phi = 2 * cos_half - F_phi
        F_kappa = F_kappa + F_phi * phi_kappa
        F_lam = F_lam + F_phi * phi_lam
        W_kappa = W_kappa + W_phi * phi_kappa
        W_lam = W_lam + W_phi * phi_lam
    for end in piece.spring_ends:
        eta_kappa, eta_lam = eta_slopes(end, q)
        F_kappa, F_lam = F_kappa - eta_kappa / end.delta, F_lam - eta_lam / end.delta
        W_kappa, W_lam = W_kappa - end.W_eta * eta_kappa, W_lam - end.W_eta * eta_lam
        bend = 2 * end.sigma * r * np.sqrt(m)
        jump_kappa = jump_kappa + bend * (end.cos * m_kappa / (2 * m) - end.sin * eta_kappa)
        jump_lam = jump_lam + bend * (end.cos * (m_lam / (2 * m) + q.ln_r_lam) - end.sin * eta_lam)
    return _PhaseSlopes(F_kappa, F_lam, W_kappa, W_lam, jump_kappa, jump_lam)


def _geometry(piece, slopes):
    """Length and rise of an arc by the chain rule."""
    q, W, jump = piece.q, piece.W, piece.jump
    cos_alpha, sin_alpha = q.cos_alpha, q.sin_alpha
    per_r, alpha_lam, ln_r_lam = 1 / q.r, cos_alpha / q.F, sin_alpha / (2 * q.F)
    across = sin_alpha * per_r
    g = Geometry(
        length=piece.F * per_r,
        rise=jump * alpha_lam + across * W,
        length_kappa=slopes.F_kappa * per_r,
        length_lam=(slopes.F_lam - ln_r_lam * piece.F) * per_r,
        rise_kappa=slopes.jump_kappa * alpha_lam + across * slopes.W_kappa,
        rise_lam=(slopes.jump_lam - 4 * jump * ln_r_lam + cos_alpha * per_r * W) * alpha_lam
        + across * (slopes.W_lam - ln_r_lam * W),
    )
    # Where the ends of a free shape meet, it turns with the force at no cost: 0/0 is to be 0.
    g.rise_lam[g.rise_lam == 0] = TINY
    return g


def bending_energy(segment):
    """½∫θ'² ds over an arc in units of EI/L, 2√F m (ΔF − ΔD), and the energy ½cθ² of its springs."""
    q = segment.q
    springs = sum(0.5 * end.c * end.angle**2 for end in segment.spring_ends)
    return 2 * q.r * q.m * (segment.F - segment.D) + springs


def shortening(segment):
    """∫(1 − cos θ) ds over an arc, as a sum of terms of the order θ²."""
    q = segment.q
    bow = 2 * q.sin_half_alpha**2 * segment.F + 2 * q.m * (q.p / q.F) * segment.D
    return bow / q.r + segment.jump * q.lam / q.F**2


def below(kind, p, kappa, lam, angle=np.pi / 2):
    """Whether |θ| < `angle` all along a segment that rises: there θ'² = κ² − 2p (1 − cos θ) + 2λ sin θ < 0.

    One turning point is the upper one, two see both sides. The angle is at least 90°.
    """
    pull = lam if kind.turning_points == 1 else np.abs(lam)
    return 0.5 * kappa * kappa < p * (1 - np.cos(angle)) - pull * np.sin(angle)


def steepest(kind, q):
    """Largest |θ| on a segment that rises: one turning point is the upper one, two see both."""
    if kind.turning_points == 1:
        return np.abs(q.alpha + q.swing)
    return np.abs(q.alpha) + q.swing
