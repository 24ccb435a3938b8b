"""Jacobi's functions along one pendulum by theta functions: short polynomials in cos 2z.

With the nome q(m) and z = πu/2K (DLMF 20.2, 22.2, 22.16(ii)), θ_j without argument for its value at 0,

    √m sn u = (θ₂/θ₃) θ₁(z)/θ₄(z),      dn u = (θ₄/θ₃) θ₃(z)/θ₄(z),
    √m cn u = (θ₂θ₄/θ₃²) θ₂(z)/θ₄(z),   E(u) = uE/K + (π/2K) θ₄'(z)/θ₄(z).

Next to m = 1 q is not small, but the nome q' of m₁ = 1 − m is. There Jacobi's imaginary transformation
(DLMF 20.7(viii), 22.6(iv)) gives the same functions at z = πu/2K' by the polynomials of q' in cosh 2z:

    √m sn u/dn u ~ θ₁(iz)/iθ₃(iz),  √m cn u ~ θ₄(iz)/θ₂(iz),
    E(u) = u(1 − E'/K') + (π/2K') d ln θ₂(iz)/dz.

The parameter enters the coefficients alone, so that a phase costs a tangent and some products.

Not here: what the functions mean for the strip (`swing`).
"""

from typing import NamedTuple

import numpy as np

SHORT_FROM = 0.035
"""1 − m from which on q is below 0.2, elsewhere q' is: what the series leave out is below rounding."""
NOME = 1, 2, 15, 150, 1707, 20910, 268616, 3567400, 48555069, 673458874, 9481557398
"""Of q = ε + 2ε⁵ + 15ε⁹ + …, ε = ½(1 − √k')/(1 + √k') (DLMF 19.5(iii), OEIS A002103)."""
SQUARABLE = 1e150
"""The higher terms of a series have vanished before its cosh 2z is as large as that."""


class Series(NamedTuple):
    """Theta functions of one nome as polynomials in t = cos 2z, arrays of one shape.

    A common factor apart, with w = t²,

        θ₃(z), θ₄(z) = e₀ + e₁w + e₂w² ± t(o₀ + o₁w)
        θ₁(z), θ₂(z) = sin z, cos z · [c₀ + c₁w + c₂w² ± t(d₀ + d₁w)],

    scaled so that √m sn u/dn u = θ₁/θ₃ and √m cn u = `bend` times the quotient of θ₂ and θ₄. The argument is
    z = `rate`·u and `steady` the mean of E(u)/u along it. Next to m = 1 the series are those in
    cosh 2z, which hold for half a `period` on both sides of 0; elsewhere that is infinite.
    """

    e0: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    o0: np.ndarray
    o1: np.ndarray
    c0: np.ndarray
    c1: np.ndarray
    c2: np.ndarray
    d0: np.ndarray
    d1: np.ndarray
    bend: np.ndarray
    rate: np.ndarray
    steady: np.ndarray
    period: np.ndarray


class Values(NamedTuple):
    """√m sn u and dn u but for a common factor, √m cn u/`bend`, (E(u) − `steady`·u)/`rate`."""

    sine: np.ndarray
    level: np.ndarray
    bend: np.ndarray
    zeta: np.ndarray


def nome(m, m1):
    """The nome q = exp(−πK'/K) of m = 1 − m1, with all its digits as m → 0; right below 0.2."""
    kp = np.sqrt(m1)
    epsilon = 0.5 * m / ((1 + kp) * (1 + np.sqrt(kp)) ** 2)
    fourth = (epsilon * epsilon) ** 2
    tail = np.zeros_like(epsilon)
    for coefficient in reversed(NOME):
        tail = tail * fourth + coefficient
    return epsilon * tail


def series(m, m1, K, DK):
    """The series for parameters m = 1 − m1 with the integrals K and (K − E)/m, all of shape (...,)."""
    steep = m1 < SHORT_FROM
    kp_square = np.where(steep, m, m1)
    q = nome(np.where(steep, m1, m), kp_square)
    q2 = q * q
    q4 = q2 * q2
    q6, q8 = q4 * q2, q4 * q4
    q9, q12, q16, q20 = q8 * q, q8 * q4, q8 * q8, q8 * q8 * q4
    e = 1 - 2 * q4 + 2 * q16, 4 * q4 - 16 * q16, 16 * q16
    o = 2 * q - 6 * q9, 8 * q9
    c = 1 - q2 - q6 + q12 + q20, 4 * (q6 - q12 - 3 * q20), 16 * q20
    d = 2 * (q6 - q2 + 2 * (q12 - q20)), 8 * (q20 - q12)
    theta_2, theta_3 = sum(c) - sum(d), sum(e) + sum(o)
    kp = np.sqrt(kp_square)
    scale = np.sqrt(m) * theta_3 / (theta_2 * np.sqrt(kp))
    rate = np.where(steep, 1 / (theta_3 * theta_3), 0.5 * np.pi / K)
    steady = 1 - (m * DK + np.where(steep, rate, 0.0)) / K
    period = np.where(steep, 2 * K * rate, np.inf)
    return Series._make((*e, *o, *(scale * each for each in (*c, *d)), kp, rate, steady, period))


def values(own, z):
    """Jacobi's functions at z = `rate`·u of the result's shape, against which the series broadcasts."""
    result = _circular(own, z)
    steep = np.broadcast_to(np.isfinite(own.period), z.shape)
    if steep.any():
        part = Series(*(np.broadcast_to(field, z.shape)[steep] for field in own))
        for value, better in zip(result, _hyperbolic(part, z[steep]), strict=True):
            value[steep] = better
    return result


def _circular(own, z):
    # One tangent costs less than a sine and a cosine.
    half = np.tan(0.5 * z)
    square = half * half
    scale = 1 / (1 + square)
    sin, cos = 2 * half * scale, (1 - square) * scale
    t = 1 - 2 * sin * sin
    w = t * t
    even, odd, inner, outer = _parts(own, t, w)
    over_theta_4 = cos / (even - odd)
    slope = own.o0 + 3 * own.o1 * w - 2 * t * (own.e1 + 2 * own.e2 * w)
    return Values(
        sin * (inner + outer), even + odd, (inner - outer) * over_theta_4, 4 * sin * slope * over_theta_4
    )


def _hyperbolic(own, z):
    turns = np.rint(z / own.period)
    sinh, cosh = np.sinh(z - turns * own.period), np.cosh(z - turns * own.period)
    t = 1 + 2 * sinh * sinh
    w = np.minimum(t, SQUARABLE) ** 2
    even, odd, inner, outer = _parts(own, t, w)
    sign, theta_2 = 1 - 2 * (turns % 2), inner - outer
    slope = 2 * t * (own.c1 + 2 * own.c2 * w) - own.d0 - 3 * own.d1 * w
    zeta = sinh * (1 / cosh + 4 * cosh * slope / theta_2) + 2 * turns
    return Values(sign * sinh * (inner + outer), even + odd, sign * (even - odd) / (cosh * theta_2), zeta)


def _parts(own, t, w):
    """Even and odd part in t of θ₃, and of θ₁ but for its sine."""
    return (
        (own.e2 * w + own.e1) * w + own.e0,
        (own.o1 * w + own.o0) * t,
        (own.c2 * w + own.c1) * w + own.c0,
        (own.d1 * w + own.d0) * t,
    )
