"""Gauss–Legendre quadrature and the integrated Legendre polynomials that stand on it.

Tables are made without BLAS or an eigensolver: they are kept, so they must not depend on how many threads
there were when they were first asked for.
"""

from functools import cache

import numpy as np
from numpy.polynomial.legendre import legvander

NEWTON_STEPS = 6
"""Enough for every root from its asymptotic place: three reach rounding up to 1,000 nodes."""


@cache
def gauss_legendre(number):
    """Nodes and weights of Gauss–Legendre quadrature on [−1, 1], by Newton's method.

    Parameters
    ----------
    number : int

    Returns
    -------
    nodes, weights : ndarray, shape (number,)
        Nodes ascending and symmetric, exact to rounding.
    """
    k = np.arange(1, number // 2 + 1)
    # Tricomi's asymptotic roots, of the positive half from the largest.
    x = (1 - (number - 1) / (8 * number**3)) * np.cos(np.pi * (4 * k - 1) / (4 * number + 2))
    for _ in range(NEWTON_STEPS):
        value, slope = _polynomial(number, x)
        x = x - value / slope
    x = np.concatenate([-x, np.zeros(number % 2), x[::-1]])
    _, slope = _polynomial(number, x)
    return x, 2 / ((1 - x) * (1 + x) * slope**2)


def _polynomial(degree, x):
    """P_n(x) and its derivative by recurrence."""
    below, value = np.ones_like(x), x
    for n in range(2, degree + 1):
        below, value = value, ((2 * n - 1) * x * value - (n - 1) * below) / n
    return value, degree * (below - x * value) / ((1 - x) * (1 + x))


@cache
def reference_element(terms):
    """Quadrature and the basis v₀, integrated Legendre bubbles, v₁ on [0, 1].

    Returns
    -------
    points, weights : ndarray, shape (2·terms,)
    basis : ndarray, shape (2·terms, terms + 2)
    stiffness, mass : ndarray, shape (terms + 2, terms + 2)
    """
    x, weights = gauss_legendre(2 * terms)
    points, weights = (x + 1) / 2, weights / 2
    legendre = legvander(x, terms + 1)
    k = np.arange(1, terms + 1)
    bubbles = (legendre[:, 2:] - legendre[:, :-2]) / (2 * np.sqrt(2 * k + 1))
    basis = np.column_stack([1 - points, bubbles, points])
    stiffness = np.eye(terms + 2)
    stiffness[0, -1] = stiffness[-1, 0] = -1
    return points, weights, basis, stiffness, np.einsum("qi,q,qj->ij", basis, weights, basis)


@cache
def element(terms, parity=0):
    """The same basis, bubbles first, or the part of it that is even or odd about the middle.

    Parameters
    ----------
    terms : int
        Bubbles, even and odd ones together.
    parity : int
        1 for even, −1 for odd functions: points are then those of the first half, with double weight, and one
        vertex function stands for both, (v₀ + v₁)/2 or (v₁ − v₀)/2. 0 for all of them.

    Returns
    -------
    points, weights : ndarray, shape (q,)
    basis : ndarray, shape (q, b + v)
        b bubbles and v = 1 or 2 vertex functions.
    stiffness, mass : ndarray, shape (b + v, b + v)
    """
    points, weights, basis, *_ = reference_element(terms)
    bubbles, first, last = basis[:, 1:-1], basis[:, :1], basis[:, -1:]
    if parity:
        # Of the bubbles, from P₂ − P₀ on, every other one is even.
        bubbles = bubbles[:, parity < 0 :: 2]
        vertices = 0.5 * (last + parity * first)
        basis = np.hstack([bubbles, vertices])[:terms]
        points, weights = points[:terms], 2 * weights[:terms]
        stiffness = np.diag([*np.ones(bubbles.shape[1]), parity < 0])
    else:
        basis = np.hstack([bubbles, first, last])
        stiffness = np.eye(terms + 2)
        stiffness[-1, -2] = stiffness[-2, -1] = -1
    return points, weights, basis, stiffness, np.einsum("qi,q,qj->ij", basis, weights, basis)


@cache
def running_integral(terms, parity=0):
    """Matrix from values at the quadrature points to their integrals up to each of them.

    Exact for what the points interpolate, by ∫P_k = (P_{k+1} − P_{k−1})/(2k + 1).

    Parameters
    ----------
    terms : int
    parity : int
        0: from 0 on. Of what is even or odd about the middle the points of the first half are enough: 1 from
        the middle on, −1 from 0 on.

    Returns
    -------
    ndarray, shape (q, q)
    """
    x, weights = gauss_legendre(2 * terms)
    legendre = legvander(x, 2 * terms)
    inner = legendre[:, 2:] - legendre[:, :-2]
    antiderivatives = np.column_stack([1 + x, inner]) / 4
    whole = np.einsum("ik,jk,j->ij", antiderivatives, legendre[:, :-1], weights)
    if not parity:
        return whole
    half = whole[:terms, :terms] + parity * whole[:terms, : terms - 1 : -1]
    return half - 0.5 * weights[:terms] if parity > 0 else half
