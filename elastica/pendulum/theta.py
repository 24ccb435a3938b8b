"""Jacobi's functions along one pendulum by theta functions: short polynomials in cos 2z.

With the nome q(m) and z = πu/2K (DLMF 20.2, 22.2, 22.16(ii)), θ_j = θ_j(z, q) and θ_j(0) without argument,

    √m sn u = (θ₂/θ₃) θ₁(z)/θ₄(z),      dn u = (θ₄/θ₃) θ₃(z)/θ₄(z),
    √m cn u = (θ₂θ₄/θ₃²) θ₂(z)/θ₄(z),   Z(u) = E(u) − uE/K = (π/2K) θ₄'(z)/θ₄(z).

The parameter enters the coefficients alone, so that a phase costs a sine, a cosine and some products.

Not here: m next to 1, where the series are long (`elliptic.jacobi`); what the functions mean (`swing`).
"""

from typing import NamedTuple

import numpy as np

SHORT_FROM = 0.035
"""1 − m from which on the nome is below 0.2: what the series leave out is below rounding."""
NOME = 1, 2, 15, 150, 1707, 20910, 268616, 3567400, 48555069, 673458874, 9481557398
"""Of q = ε + 2ε⁵ + 15ε⁹ + …, ε = ½(1 − √k')/(1 + √k') (DLMF 19.5(iii), OEIS A002103)."""


class Series(NamedTuple):
    """Theta functions of one nome as polynomials in t = cos 2z, arrays of one shape.

    With w = t², a common factor apart,

        θ₃(z), θ₄(z) = e₀ + e₁w + e₂w² ± t(o₀ + o₁w)
        θ₁(z), θ₂(z) = sin z, cos z · [c₀ + c₁w + c₂w² ± t(d₀ + d₁w)]

    scaled so that tan(ψ/2) = √m sn/dn = θ₁(z)/θ₃(z); √m cn = √m₁ θ₂(z)/θ₄(z).
    """

    e: tuple[np.ndarray, np.ndarray, np.ndarray]
    o: tuple[np.ndarray, np.ndarray]
    c: tuple[np.ndarray, np.ndarray, np.ndarray]
    d: tuple[np.ndarray, np.ndarray]


def nome(m, m1):
    """The nome q = exp(−πK'/K) of m = 1 − m1 ≥ `SHORT_FROM`, with all its digits as m → 0."""
    kp = np.sqrt(m1)
    root = np.sqrt(kp)
    epsilon = 0.5 * m / ((1 + kp) * (1 + root) ** 2)
    fourth = epsilon**2 * epsilon**2
    tail = np.zeros_like(epsilon)
    for coefficient in reversed(NOME):
        tail = tail * fourth + coefficient
    return epsilon * tail


def series(m, m1):
    """Coefficients for parameters m = 1 − m1, shape (...,); those with m1 < `SHORT_FROM` mean nothing."""
    q = nome(m, m1)
    q2 = q * q
    q4 = q2 * q2
    q6, q8 = q4 * q2, q4 * q4
    q9, q12, q16, q20 = q8 * q, q8 * q4, q8 * q8, q8 * q8 * q4
    e = 1 - 2 * q4 + 2 * q16, 4 * q4 - 16 * q16, 16 * q16
    o = 2 * q - 6 * q9, 8 * q9
    c = 1 - q2 - q6 + q12 + q20, 4 * (q6 - q12 - 3 * q20), 16 * q20
    d = 2 * (q6 - q2 + 2 * (q12 - q20)), 8 * (q20 - q12)
    theta_2, theta_3 = sum(c) - sum(d), sum(e) + sum(o)
    scale = np.sqrt(m) * theta_3 / (theta_2 * np.sqrt(np.sqrt(m1)))
    return Series(e, o, tuple(scale * each for each in c), tuple(scale * each for each in d))


def sine_and_level(own, z):
    """√m sn and dn but for a common factor at z, which broadcasts against the coefficients."""
    sin = np.sin(z)
    t = 1 - 2 * sin * sin
    w = t * t
    e, o, c, d = own.e, own.o, own.c, own.d
    level = (e[2] * w + e[1]) * w + e[0] + t * (o[1] * w + o[0])
    return sin * ((c[2] * w + c[1]) * w + c[0] + t * (d[1] * w + d[0])), level
