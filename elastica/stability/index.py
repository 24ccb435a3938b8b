"""Exact index, nullity and verdict of an equilibrium whose contacts are free to move.

The second variation with moving contacts

    Q(φ) = ∫ φ'² − (p cos θ + λ sin θ) φ² ds + Σ_contacts (μ/κ) φ(s_c)²

on the φ that vanish at clamps and keep each contact's height to first order couples the segments only
through φ at the contacts. Its index is therefore the sum of the segments' indices with both ends held
plus the index of a small matrix of end-rotation stiffnesses. With D_j = dℓ_j/dκ at fixed rise that matrix
is −(1/κ) Σ v_j v_jᵀ/D_j (the reactions cancel), which leaves

    index = Σ_j (held_j + [D_j > 0]) − [ΣD > 0].

Held ends: between consecutive turning points, a pin counting as one, the rotation field has exactly one
conjugate point; the sign of ℓ_κ decides about one more, and the height constraint takes one away where the
height grows with λ at fixed length:

    held_j = T_j − 1 + [ℓ_κ < 0] − [d_λ D_j ℓ_κ > 0]        (T_j turning points, pinned ends included).

For |θ| < 90° this makes held_j + [D_j > 0] = T_j − 1: 0 for S, 1 for A and 0, 2 more for each period.
"""

from typing import NamedTuple

import numpy as np

from elastica.codes import Stability
from elastica.equilibria.buckled import periodic
from elastica.equilibria.newton import ROUNDING

FOLD_TOLERANCE = 1e-7
"""|ΣD| relative to its terms below which the count at a fold is not trusted. At a fold two roots merge as
√(δP), so rounding of 1e-16 in P moves κ, and with it ΣD, by about 1e-8 of its scale."""
MARGIN = 4.0
"""κ, a flat length and the distance of √p ℓ_f from 2π are taken for zero, where the index is about to change,
within this multiple of their own error bound."""


class Verdict(NamedTuple):
    """Index, nullity and `Stability` code, integers or arrays of them."""

    index: np.ndarray | int  # type: ignore[assignment]  # hides tuple.index
    nullity: np.ndarray | int
    stability: np.ndarray | int


def verdict_of_points(segments, arcs, geometries, steep, vanishing, linear=None):
    """The verdict in the point regime and of free buckling.

    Parameters
    ----------
    segments : Mapping of Segment to int
    arcs, geometries : sequence of Arc, Geometry
        One for each distinct segment, arrays of shape (n,).
    steep, vanishing : ndarray of bool, shape (n,)
        Where |θ| passes 90°, and where κ is zero to rounding: at the transition to a line.
    linear : Bordered, optional
        The equations there, linearised, where the shortening is prescribed.

    Returns
    -------
    Verdict
    """
    index, critical = index_of_points(segments, geometries, steep)
    if linear:
        index, critical = index_at_shortening(index, linear)
    segment = next(iter(segments))
    if segment.start == segment.end == 0 and periodic(segment.kind):
        meet, passed = ends_meet(arcs[0], geometries[0])
        index, critical = index - (meet & passed), critical | meet
    critical = critical | vanishing
    return Verdict(index, critical, verdict(index, critical))


def verdict_of_lines(segments, flat_length, delta, p, ends, linear=None):
    """The verdict in the line regime.

    Parameters
    ----------
    segments : Mapping of Segment to int
    flat_length, delta, p : ndarray, shape (n,)
        The length that lies flat, a bound of its error, and the thrust.
    ends : Ends
    linear : Bordered, optional
        The equations there, linearised, where the shortening is prescribed.

    Returns
    -------
    Verdict
    """
    index, critical = index_of_lines(segments, flat_length, delta, p)
    if linear:
        # Where ΔL falls as the load grows, prescribing it takes one negative direction away.
        index = index - ((index > 0) & (linear.shorter_load < 0))
    at_clamps, between_lines = sliding_segments(segments, ends)
    nullity = at_clamps + between_lines + critical
    stability = verdict(index, critical, third_order=at_clamps > 0, family=between_lines > 0)
    return Verdict(index, nullity, stability)


def index_of_points(segments, geometries, steep):
    """Index in the point regime and of free buckling, and whether it is about to change at a fold.

    Parameters
    ----------
    segments : Mapping of Segment to int
    geometries : sequence of Geometry
        One for each distinct segment, arrays of shape (n,).
    steep : ndarray of bool, shape (n,)
        Where |θ| passes 90° and the general formula is needed.

    Returns
    -------
    index : ndarray of int, shape (n,)
    at_fold : ndarray of bool, shape (n,)
    """
    index, pivot, scale = 0, 0.0, 0.0
    for (segment, count), g in zip(segments.items(), geometries, strict=True):
        D = g.D
        longer = g.length_kappa > 0
        turning = segment.kind.turning_points - 1
        general = turning + ~longer + (D > 0) - (g.rise_lam * D * g.length_kappa > 0)
        index = index + count * np.where(steep, general, turning)
        pivot = pivot + count * D
        scale = scale + count * (np.abs(g.length_kappa) + np.abs(D - g.length_kappa))
    return index - (pivot > 0), np.abs(pivot) <= FOLD_TOLERANCE * scale


def index_at_shortening(index, linear):
    """Index where the shortening is prescribed, and whether it is about to change.

    One less where dΔL/dP < 0 along the branch; it changes where ΔL has an extreme along it.

    Parameters
    ----------
    index : ndarray of int, shape (n,)
        At prescribed load.
    linear : Bordered

    Returns
    -------
    index : ndarray of int, shape (n,)
    at_extreme : ndarray of bool, shape (n,)
    """
    scale = np.abs(linear.shorter_k) + np.abs(linear.shortening_k - linear.shorter_k)
    at_extreme = np.abs(linear.shortening_k) <= FOLD_TOLERANCE * scale
    return index - (linear.shortening_k * linear.load_k < 0), at_extreme


def ends_meet(piece, slopes):
    """Whether the ends of a free shape with λ = 0 lie on each other, so that it turns at no cost.

    There 2E = K, and one more direction begins to lose energy.

    Parameters
    ----------
    piece : Arc
    slopes : Geometry

    Returns
    -------
    meet, passed : ndarray of bool, shape (n,)
        Whether they do to rounding, and whether by rounding that direction is counted already.
    """
    return np.abs(piece.W) <= 4 * MARGIN * ROUNDING * piece.F, slopes.rise_lam < 0


def index_of_lines(segments, flat_length, delta, p):
    """Index in the line regime, where φ = 0 at the ends of the contacts and the segments decouple.

    A segment of kind S has none, one of kind A at a pin has one; a flat stretch buckles off the wall
    when p ℓ_f² > 4π², with the wall on one side, which adds one. Of several lines the pooled length
    counts: the family of states contains the one that has it all in one piece. `delta` bounds the error
    of ℓ_f.

    Returns
    -------
    index : ndarray of int, shape (n,)
    critical : ndarray of bool, shape (n,)
        At the buckling load of the flat stretch, or where the flat length vanishes.
    """
    turning = sum(count * (kind.turning_points - 1) for (kind, *_), count in segments.items())
    beyond = flat_length - 2 * np.pi / np.sqrt(p)
    critical = np.minimum(np.abs(flat_length), np.abs(beyond)) <= MARGIN * delta
    return turning + (beyond > 0), critical


def sliding_segments(segments, ends):
    """Segments of a line state that can slide along the strip at no cost to second order.

    A full period of the pendulum between two places with θ = θ' = 0 has φ = θ' for an exact zero. Next
    to a clamp the sliding lowers the energy at third order, −λ²u³/6: the clamp's side loses its support.
    Between two lines it is neutral at every order: a family of states of equal energy.

    Returns
    -------
    at_clamps, between_lines : int
    """
    at_clamps = sum(end.clamped for end in ends)
    between_lines = sum(count for segment, count in segments.items() if segment.start == -1)
    return at_clamps, between_lines


def verdict(index, critical, third_order=False, family=False):
    """Stability code: the last that applies, in the order written here, otherwise stable.

    Returns
    -------
    ndarray of int8, shape (n,)
    """
    code = np.full(index.shape, Stability.STABLE, np.int8)
    for where, value in (
        (family, Stability.NEUTRAL_FAMILY),
        (critical, Stability.CRITICAL),
        (third_order, Stability.UNSTABLE_THIRD_ORDER),
        (index > 0, Stability.UNSTABLE),
    ):
        np.copyto(code, value, where=where)
    return code
