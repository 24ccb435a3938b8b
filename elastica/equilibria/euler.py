"""The straight strip: its Euler loads, hence its index and eigenvalues.

With δy = 0 at both ends the perturbation obeys −φ'' = νφ + const, ∫φ ds = 0; the eigenvalues of Q are
ν − p with ν the Euler thrusts:

    clamped–clamped  √ν = nπ (n even) and 2r_k      pinned–pinned  √ν = nπ
    clamped–pinned   √ν = r_k                       with tan r_k = r_k, kπ < r_k < (k + ½)π

With springs φ = a cos qs + b sin qs + const, q = √ν, and the conditions φ'(0) = c_A φ(0),
φ'(1) = −c_B φ(1), ∫φ ds = 0 have a determinant whose n-th zero lies between those of the pinned and the
clamped strip.
"""

from functools import cache

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.ends import CLAMPED, PINNED, Ends


def tangent_root(k):
    """Roots r_k of tan r = r, k ≥ 1, to rounding.

    r = (k + ½)π − atan(1/r) contracts by 1/(1 + r²) < 0.05 at each step.
    """
    asymptote = (np.asarray(k) + 0.5) * np.pi
    r = asymptote
    for _ in range(14):
        r = asymptote - np.arctan(1 / r)
    return r


def euler_root(mode, ends):
    """Square root √ν of the Euler thrust of buckling mode n = 1, 2, … (EI = L = 1)."""
    n = np.asarray(mode)
    if all(end.pinned for end in ends):
        return n * np.pi
    if all(end.clamped for end in ends):
        return np.where(n % 2, (n + 1) * np.pi, 2 * tangent_root(np.maximum(n // 2, 1)))
    if all(end.clamped or end.pinned for end in ends):
        return tangent_root(n)
    # In steps, so that a table once computed serves again.
    known = _spring_roots(ends, 1 << int(np.max(n, initial=1)).bit_length())
    return known[n - 1]


@cache
def _spring_roots(ends, count):
    """The first `count` roots where an end is held by a spring."""
    n = np.arange(1, count + 1)
    low = euler_root(n, Ends(PINNED, PINNED))
    high = euler_root(n, Ends(CLAMPED, CLAMPED))

    def determinant(q):
        return _determinant(q, *ends)

    # Next to pinned or clamped ends the determinant vanishes to rounding at both ends of an interval, since
    # the zero beside is no farther: its sign in the middle, (−1)^(n+1) up to the root, tells the half.
    before, middle = np.where(n % 2, 1, -1), 0.5 * (low + high)
    below = determinant(middle) * before <= 0
    roots = np.where(below, low, high)
    inside = (determinant(roots) * before > 0) == below
    half = np.where(below, low, middle)[inside], np.where(below, middle, high)[inside]
    found = find_root(determinant, half)
    # A spring that moves the root by less than rounding leaves it where it is without one.
    roots[inside] = found.x
    return roots


def _determinant(q, end_a, end_b):
    """Determinant of the end conditions, each divided by c + q so that no spring is too stiff."""
    (hold_a, turn_a), (hold_b, turn_b) = (
        (1.0, 0.0) if end.clamped else (end.stiffness / (end.stiffness + q), q / (end.stiffness + q))
        for end in (end_a, end_b)
    )
    sin, cos = np.sin(q), np.cos(q)
    mean_cos, mean_sin = sin / q, (1 - cos) / q
    at_a = -hold_a * (1 - mean_cos), turn_a + hold_a * mean_sin
    at_b = -turn_b * sin + hold_b * (cos - mean_cos), turn_b * cos + hold_b * (sin - mean_sin)
    return at_a[0] * at_b[1] - at_a[1] * at_b[0]


def euler_modes_below(p, ends):
    """Number of Euler thrusts strictly below p, shape of `p`.

    Loads of consecutive modes are less than 2π apart in √ν, so counting through a table of them is
    exact.
    """
    root = np.sqrt(p)
    table = euler_root(np.arange(1, int(np.max(root, initial=0.0) / np.pi) + 3), ends)
    return np.searchsorted(table * table, p, side="left")
