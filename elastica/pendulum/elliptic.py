"""Elliptic integrals of the first and second kind, complete and incomplete, in one vectorised pass.

A free segment of the strip needs K, E, F(φ|m) and E(φ|m) at the same parameter. The descending Gauss
transformation gives all four from one chain of arithmetic-geometric means, without a branch in φ and without
the cancellation that 1 − E/K suffers as m → 0: the second kind is carried as D = (first − second)/m.
Every operation is element-wise, so a value never depends on its neighbours in the array.

Not here: m ≥ 1 (a segment that ends at θ = 0 has a turning point, hence m < 1).
"""

import numpy as np

STEPS = {4: 0.4, 5: 0.015, 12: 0.0}
"""Transformations, and the 1 − m above which so many leave a relative error below 1e-17: almost every strip
below 90° needs four, twelve are enough for the smallest positive number."""
INVERSION_STEPS = 8
ROUNDING, TINY = np.finfo(float).eps, np.finfo(float).tiny


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
    Gauss's transformation (DLMF 19.8(iii)) in terms of the means a, b of 1 and k' = √m₁ and of lengths
    t : sa : u : sb : v = cos φ : sin φ : 1 : k' sin φ : Δ, with s the first sin φ:

        a₁ = (a + b)/2,  b₁ = √(ab),  c₁ = (a − b)/2,  k₁ = c₁/a₁
        u₁ = (u + v)/2,  v₁ = √(u₁v + s²bc₁),  t₁ = t u₁/v₁
        F(φ|m)/a = F(φ₁|k₁²)/a₁,  D(φ|m)/a = ½ [F₁/a₁ + k₁ D₁/a₁ − s t/(u u₁)]

    (the last one is the relation for E, solved for D, which removes the division by m). All terms of a sum
    have one sign. Once k₁² is below rounding F₁ = φ₁ = atan2(s a₁, t₁), and t₁ = t.
    """
    m1, sin_phi, cos_phi = np.broadcast_arrays(
        np.asarray(m1, float), np.asarray(sin_phi, float), np.asarray(cos_phi, float)
    )
    (few, enough), *more = STEPS.items()
    result = _descend(m1, sin_phi, cos_phi, few)
    for steps, above in more:
        hard = m1 < enough
        if not hard.any():
            break
        hard &= m1 >= above
        precise = _descend(m1[hard], sin_phi[hard], cos_phi[hard], steps)
        for value, better in zip(result, precise, strict=True):
            value[hard] = better
        enough = above
    return result


def _descend(m1, sin_phi, cos_phi, steps):
    s2 = sin_phi * sin_phi
    a, b = 1.0, np.sqrt(m1)
    t, u, v = cos_phi, 1.0, np.sqrt(cos_phi * cos_phi + m1 * s2)
    weight, share, boundary = 0.5, 0.5, 0.0
    for step in range(steps):
        last = step + 1 == steps
        mean, half = 0.5 * (a + b), 0.5 * (a - b)
        middle = 0.5 * (u + v)
        boundary = boundary + weight * t / (u * middle)
        if not last:
            weight = weight * (0.5 * half / mean)
            share = share + weight
            v = np.sqrt(middle * v + s2 * b * half)
            t = t * middle / v
            b = np.sqrt(a * b)
        a, u = mean, middle
    K = 0.5 * np.pi / a
    F = np.arctan2(sin_phi * a, t) / a
    return K, share * K, F, share * F - sin_phi * boundary
