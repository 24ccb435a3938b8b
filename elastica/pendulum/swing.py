"""Angle and position along one free segment, by Jacobi functions.

Along the phase u = u₀ + √F s, with ψ = θ − α,

    sin(ψ/2) = √m sn(u|m),      ψ' = 2√(Fm) cn(u|m),      ∫ cos ψ ds = s − 2m ΔD/√F,

where D(u) = (u − E(am u|m))/m (DLMF 22.16(iii)); sin ψ = −ψ''/F integrates to the change of ψ'.

Not here: where the segment lies in the strip (`shapes`).
"""

import numpy as np

from elastica.pendulum.elliptic import integrals, jacobi
from elastica.pendulum.segments import crossing_sign
from elastica.pendulum.spring_end import spring_end
from elastica.pendulum.theta import SHORT_FROM, series, sine_and_level


def start_phase(kind, q):
    """Phase u₀ = F(φ|m) at the start of a segment, shape (n,)."""
    if np.isfinite(kind.start_spring):
        c, sigma = kind.springs[0]
        return 2 * float(kind.start) * q.K + spring_end(c, sigma, q).F
    return 2 * float(kind.start) * q.K + crossing_sign(kind.start) * q.f


def swing(q, u):
    """Angle ψ = θ − α at phases u, shape (n, samples)."""
    sn, cn, _ = jacobi(u, q.K[:, None], q.m[:, None])
    return _angle(q, sn, cn)


def directions(q, u):
    """Cosine and sine of the angle ψ = θ − α.

    Parameters
    ----------
    q : Pendulum
        Arrays that broadcast with u.
    u : ndarray
        Phases, of the shape of the result.

    Returns
    -------
    cos_psi, sin_psi : ndarray
        With all their relative digits where ψ is small.
    """
    sin, cos = sine_and_level(series(q.m, q.m1), 0.5 * np.pi / q.K * u)
    steep = np.broadcast_to(q.m1 < SHORT_FROM, u.shape)
    if steep.any():
        m, m1, K = (np.broadcast_to(field, u.shape)[steep] for field in (q.m, q.m1, q.K))
        sn, cn, _ = jacobi(u[steep], K, m)
        sin[steep], cos[steep] = np.sqrt(m) * sn, np.sqrt(m1 + m * cn * cn)
    sin_square, cos_square = sin * sin, cos * cos
    scale = 1 / (sin_square + cos_square)
    return (cos_square - sin_square) * scale, 2 * sin * cos * scale


def course(kind, q, along):
    """A segment, in its rising convention, at arc lengths from its start.

    Parameters
    ----------
    kind : Kind
    q : Pendulum
        Arrays of shape (n,).
    along : ndarray, shape (n, samples)

    Returns
    -------
    theta, advance, rise : ndarray, shape (n, samples)
        Angle, and how far it has come in x and in y.
    """
    m, r, F = (field[:, None] for field in (q.m, q.r, q.F))
    sin_alpha, cos_alpha = q.sin_alpha[:, None], q.cos_alpha[:, None]
    start = start_phase(kind, q)[:, None]
    _, cn_start, D_start = _functions(q, start)
    sn, cn, D = _functions(q, start + r * along)
    bent = 2 * r * np.sqrt(m) * (cn_start - cn) / F
    stretch = along - 2 * m * (D - D_start) / r
    theta = q.alpha[:, None] + _angle(q, sn, cn)
    return theta, cos_alpha * stretch - sin_alpha * bent, cos_alpha * bent + sin_alpha * stretch


def _functions(q, u):
    """sn, cn and D at phases u, shape (n, samples)."""
    m1, K, DK = (field[:, None] for field in (q.m1, q.K, q.DK))
    sn, cn, turns = jacobi(u, K, q.m[:, None])
    D = integrals(m1, sn * (1 - 2 * (turns % 2)), np.abs(cn))[3]
    return sn, cn, 2 * turns * DK + D


def _angle(q, sn, cn):
    """ψ where the Jacobi functions have the values `sn`, `cn` (n, samples)."""
    m, m1 = q.m[:, None], q.m1[:, None]
    return 2 * np.arctan2(np.sqrt(m) * sn, np.sqrt(m1 + m * cn * cn))
