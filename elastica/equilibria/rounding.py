"""How far rounding can have moved a solution: a first-order bound, carried along with every state.

Not here: errors of the model (friction, thickness, self-contact) and wrong branches, which are excluded
by construction (`newton`).
"""

from typing import Any, NamedTuple

import numpy as np

from elastica.equilibria.newton import ROUNDING
from elastica.equilibria.small_deflections import TINY_THRUST
from elastica.pendulum.segments import load_slopes, shortening

SAFETY = 4.0
"""Roundings that the longest chain of operations adds up, found by comparison with 50-digit solutions."""


class Bounds(NamedTuple):
    """Bounds of what rounding makes of κ, of each length, of their sum and of the energy, shape (n,).

    In units with EI = L = 1; that of the energy is its first variation.
    """

    kappa: np.ndarray
    length: np.ndarray
    total: np.ndarray
    energy: np.ndarray


class BoundsAlong(NamedTuple):
    """What is added where the load is found too: bounds of κ/√p, of each length and of ln p, shape (n,)."""

    k: np.ndarray
    length: np.ndarray
    load: np.ndarray


def rounding_bounds(segments, arcs, geometries, p, line):
    """What rounding makes of a state at a given load.

    A length is rounded by ε times its terms and by what the rounding of κ and λ makes of it (much near
    the separatrix), a rise likewise; through the arrow system they move the total length by
    Σ n (δℓ + |ℓ_λ/d_λ| δd), hence κ by that over |ΣD|.

    Parameters
    ----------
    segments : Mapping of Segment to int
    arcs, geometries : sequence of Arc, Geometry
        One for each distinct segment, arrays of shape (n,).
    p : ndarray, shape (n,)
    line : bool
        κ = 0 is exact.

    Returns
    -------
    Bounds
    """
    slack: Any = 0.0
    pivot, work = 0.0, 0.0
    delta_lengths, Ds = [], []
    for (segment, count), piece, g in zip(segments.items(), arcs, geometries, strict=True):
        q = piece.q
        G = _terms(piece)
        kappa, lam = q.kappa, np.abs(q.lam)
        delta_length = ROUNDING * (G / q.r + np.abs(lam * g.length_lam))
        if not _exact_parameter(segment):
            delta_length = delta_length + ROUNDING * np.abs(kappa * g.length_kappa)
        delta_rise = _of_rise(piece, g, G)
        delta_length = delta_length + np.abs(g.length_lam / g.rise_lam) * delta_rise
        delta_lengths.append(delta_length)
        Ds.append(np.abs(g.D))
        slack = slack + count * delta_length
        pivot = pivot + count * g.D
        work = work + count * lam * delta_rise
    kappa = arcs[0].q.kappa
    delta_kappa = np.zeros_like(p) if line else SAFETY * slack / np.abs(pivot)
    moved = [SAFETY * d + D * delta_kappa for d, D in zip(delta_lengths, Ds, strict=True)]
    delta_energy = SAFETY * (work + 0.5 * kappa**2 * slack)
    return Bounds(delta_kappa, np.max(moved, axis=0), SAFETY * slack, delta_energy)


def bounds_at_shortening(segments, arcs, p, linear, delta_total, line):
    """What rounding makes of a state at prescribed shortening, where the load is found too.

    Rounding of the total length (`delta_total`) and of the shortening moves k = κ/√p and ln p along and
    across the branch: near an extreme of the shortening by as much as the extreme is flat.

    Parameters
    ----------
    segments : Mapping of Segment to int
    arcs : sequence of Arc
        One for each distinct segment, arrays of shape (n,).
    p, delta_total : ndarray, shape (n,)
    linear : Bordered
        The equations there, linearised.
    line : bool
        κ = 0 is exact.

    Returns
    -------
    BoundsAlong
    """
    k = arcs[0].q.kappa / np.sqrt(p)
    slopes = [load_slopes(piece) for piece in arcs]
    delta_shorter = 0.0
    for (segment, count), piece, of in zip(segments.items(), arcs, slopes, strict=True):
        own = shortening(piece) + np.abs(piece.q.lam * of.shorter_lam)
        if not _exact_parameter(segment):
            own = own + np.abs(piece.q.kappa * of.shorter_kappa)
        g = of.geometry
        across = np.abs(of.shorter_lam / g.rise_lam) * _of_rise(piece, g, _terms(piece))
        delta_shorter = delta_shorter + count * SAFETY * (ROUNDING * own + across)
    if line:
        delta_k, delta_load = np.zeros_like(p), delta_shorter / np.abs(linear.shorter_load)
    else:
        moved = delta_shorter + np.abs(linear.shorter_load / linear.excess_load) * delta_total
        delta_k = moved / np.abs(linear.shortening_k)
        delta_load = (delta_total + np.abs(linear.excess_k) * delta_k) / np.abs(linear.excess_load)
    lengths = [
        np.abs(of.geometry.length_kappa * np.sqrt(p) + of.geometry.length_lam * along_k * p) * delta_k
        + np.abs(of.length_load + of.geometry.length_lam * along_load * p) * delta_load
        for of, along_k, along_load in zip(slopes, linear.along_k, linear.along_load, strict=True)
    ]
    return BoundsAlong(delta_k + 0.5 * k * delta_load, np.max(lengths, axis=0), delta_load)


def relative_error(bounds, along, p, bending, shorter):
    """Bound of max(|δκ|/√p, |δℓ|, |δV|/|V|), shape (n,), which datasets call `error`.

    Parameters
    ----------
    bounds : Bounds
    along : BoundsAlong or None
        At prescribed shortening.
    p, bending, shorter : ndarray, shape (n,)
        Thrust, bending energy and shortening: V = bending − p · shorter.
    """
    terms = bending + p * shorter
    delta_k, delta_length = bounds.kappa / np.sqrt(np.maximum(p, TINY_THRUST)), bounds.length
    delta_energy = bounds.energy + SAFETY * ROUNDING * terms
    if along:
        delta_k, delta_length = np.maximum(delta_k, along.k), delta_length + along.length
        delta_energy = delta_energy + p * shorter * along.load
    relative = delta_energy / np.maximum(np.abs(bending - p * shorter), ROUNDING * terms)
    return np.max([delta_k, delta_length, relative], axis=0)


def _exact_parameter(segment):
    """Whether m is known from K(m), not from κ: of free shapes with λ = 0."""
    return not (segment.rise or segment.kind.second or segment.kind.springs)


def _terms(piece):
    """Terms of ΔF, which are rounded each."""
    kind, q = piece.kind, piece.q
    return kind.first * q.K + abs(kind.second * q.f) + sum(np.abs(end.F) for end in piece.spring_ends)


def _of_rise(piece, g, G):
    """Rounding of a rise, from its terms and from that of κ and λ."""
    q = piece.q
    lam = np.abs(q.lam)
    tilt = np.abs(piece.jump) * q.p / q.F**2
    return ROUNDING * (
        tilt + lam * G / (q.F * q.r) + np.abs(q.kappa * g.rise_kappa) + np.abs(lam * g.rise_lam)
    )
