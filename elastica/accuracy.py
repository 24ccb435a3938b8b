"""How far rounding can have moved a solution: a first-order bound, carried along with every state.

Left out: errors of the model (friction, thickness, self-contact) and wrong branches, which are excluded
by construction (`equilibrium`).
"""

import numpy as np

from elastica.newton import ROUNDING

SAFETY = 4.0
"""Roundings that the longest chain of operations adds up, found by comparison with 50-digit solutions."""


def rounding_bounds(segments, arcs, geometries, p, line):
    """Bounds for κ, for each length, for their sum and for the energy's first variation.

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
    delta_kappa, delta_length, delta_total, delta_energy : ndarray, shape (n,)
        In units with EI = L = 1.
    """
    slack, pivot, work = 0.0, 0.0, 0.0
    delta_lengths, Ds = [], []
    for (segment, count), piece, g in zip(segments.items(), arcs, geometries, strict=True):
        kind, q = piece.kind, piece.q
        G = kind.first * q.K + abs(kind.second * q.f) + sum(np.abs(end.F) for end in piece.held)
        kappa, lam = q.kappa, np.abs(q.lam)
        delta_length = ROUNDING * (G / q.r + np.abs(lam * g.length_lam))
        if segment.rise or kind.second or kind.springs:
            # Otherwise m is known from K(m), not from κ.
            delta_length = delta_length + ROUNDING * np.abs(kappa * g.length_kappa)
        tilt = np.abs(piece.jump) * p / q.F**2
        delta_rise = ROUNDING * (
            tilt + lam * G / (q.F * q.r) + np.abs(kappa * g.rise_kappa) + np.abs(lam * g.rise_lam)
        )
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
    return delta_kappa, np.max(moved, axis=0), SAFETY * slack, delta_energy
