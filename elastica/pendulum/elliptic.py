"""Elliptic integrals of the first and second kind, complete and incomplete, in one vectorised pass.

A free segment of the strip needs K, E, F(φ|m) and E(φ|m) at the same parameter. The descending Gauss
transformation gives all four from one chain of square roots, without a branch in φ and without the
cancellation that 1 − E/K suffers as m → 0: the second kind is carried as D = (first − second)/m.
Every operation is element-wise, so a value never depends on its neighbours in the array.

Not here: m ≥ 1 (a segment that ends at θ = 0 has a turning point, hence m < 1).
"""

import numpy as np
from scipy.special import ellipj

FEW_STEPS = 5
FEW_STEPS_SUFFICE_ABOVE = 0.05
"""m₁ = 1 − m above which five transformations leave a relative error below 1e-17."""
INVERSION_STEPS = 8
ROUNDING, TINY = np.finfo(float).eps, np.finfo(float).tiny
MANY_STEPS = 12
"""Enough for the smallest positive m₁ of double precision."""


def complementary_parameter(K):
    """1 − m for which the complete integral is K(m) ≥ π/2.

    Newton for x = ln(1 − m), in which K is nearly linear: dK/dx = −(K − D)/2. It starts from the limit
    K = ln 4 − x/2 of m → 1 and keeps all digits of 1 − m there.
    """
    x = np.minimum(np.log(16) - 2 * K, -ROUNDING)
    for _ in range(INVERSION_STEPS):
        trial, DK, _, _ = integrals(np.exp(x), np.zeros_like(x), np.ones_like(x))
        x = np.minimum(x + 2 * (trial - K) / (trial - DK), -ROUNDING)
    return np.exp(x)


def parameter_of_shortening(shortening):
    """Parameter of the free shape with λ = 0 whose shortening is 2(1 − E/K), between 0 and 2.

    Newton for x = ln(1 − m), in which K/E − 1 is nearly linear: its slope is −½ at both ends, m → 0 and
    m → 1. So neither loses a digit.

    Returns
    -------
    m, m1 : ndarray, shape (...,)
    """
    wanted = shortening / (2 - shortening)
    x = -2 * wanted
    for _ in range(INVERSION_STEPS):
        m, m1 = -np.expm1(x), np.exp(x)
        K, DK, _, _ = integrals(m1, np.zeros_like(x), np.ones_like(x))
        E = K - m * DK
        slope = -0.5 * ((K - DK) + m1 * K * DK / E) / E
        x = np.minimum(x - (m * DK / E - wanted) / slope, -TINY)
    return -np.expm1(x), np.exp(x)


def jacobi(u, K, m):
    """Functions sn, cn(u|m) and the number of half periods that the amplitude of u is away from 0.

    The argument is brought to |u| ≤ K first: for m → 1 the functions of SciPy are right only there.

    Returns
    -------
    sn, cn : ndarray
    turns : ndarray
        am u = turns·π + an angle in [−π/2, π/2].
    """
    turns = np.rint(u / (2 * K))
    sn, cn = ellipj(u - 2 * turns * K, m)[:2]
    sign = 1 - 2 * (turns % 2)
    return sign * sn, sign * np.abs(cn), turns


def integrals(m1, sin_phi, cos_phi):
    """Complete and incomplete elliptic integrals for 1 − m = `m1` and an amplitude |φ| ≤ π/2.

    Parameters
    ----------
    m1 : array_like, shape (...,)
        Complementary parameter 1 − m in (0, 1].
    sin_phi, cos_phi : array_like, shape (...,)
        Sine and cosine of the amplitude, cos φ ≥ 0. Both are needed: near φ = π/2 the sine alone does
        not determine φ, near 0 the cosine alone does not.

    Returns
    -------
    K, DK, F, DF : ndarray, shape (...,)
        K(m), D(m) = (K − E)/m, F(φ|m) and D(φ|m) = (F(φ|m) − E(φ|m))/m.

    Notes
    -----
    Gauss's transformation with k₀ = (1 − k')/(1 + k'), Δ = √(1 − m sin²φ):

        tan φ₀ = tan φ √((1 + k')(Δ + k') / (2 (1 + Δ)))
        F(φ|m) = (1 + k₀) F(φ₀|k₀²)
        D(φ|m) = ½ (1 + k₀) [F₀ + k₀ D₀ − sin φ₀ cos φ₀ Δ₀ / (1 + k₀ sin²φ₀)]

    (DLMF 19.8(iii); the last line is the relation for E, solved for D, which removes the division by
    m.) Once k₀² is below rounding F₀ = φ₀.
    """
    m1, sin_phi, cos_phi = np.broadcast_arrays(
        np.asarray(m1, float), np.asarray(sin_phi, float), np.asarray(cos_phi, float)
    )
    result = _descend(m1, sin_phi, cos_phi, FEW_STEPS)
    hard = m1 < FEW_STEPS_SUFFICE_ABOVE
    if hard.any():
        precise = _descend(m1[hard], sin_phi[hard], cos_phi[hard], MANY_STEPS)
        for value, better in zip(result, precise, strict=True):
            value[hard] = better
    return result


def _descend(m1, sin_phi, cos_phi, steps):
    kp = np.sqrt(m1)
    s, c = sin_phi, cos_phi
    delta = np.sqrt(c * c + m1 * s * s)
    levels = []
    for _ in range(steps):
        k0 = (1 - kp) / (1 + kp)
        scale = 1 + delta
        s = (1 + kp) * s / scale
        c = c * np.sqrt(2 * (1 + kp) * scale / (delta + kp)) / scale
        kp = 2 * np.sqrt(kp) / (1 + kp)
        delta = np.sqrt(c * c + kp * kp * s * s)
        levels.append((k0, s * c * delta / (1 + k0 * s * s)))
    K = np.full_like(s, np.pi / 2)
    F = np.arctan2(s, c)
    DK = 0.5 * K
    DF = 0.5 * (F - s * c)
    for k0, boundary in reversed(levels):
        half = 0.5 * (1 + k0)
        DK = half * (K + k0 * DK)
        DF = half * (F + k0 * DF - boundary)
        K = (1 + k0) * K
        F = (1 + k0) * F
    return K, DK, F, DF
