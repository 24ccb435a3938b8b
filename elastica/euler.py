"""The straight strip: its Euler loads, hence its index and eigenvalues.

With δy = 0 at both ends the perturbation obeys −φ'' = νφ + const, ∫φ ds = 0; the eigenvalues of Q are
ν − p with ν the Euler thrusts:

    clamped–clamped  √ν = nπ (n even) and 2r_k      pinned–pinned  √ν = nπ
    clamped–pinned   √ν = r_k                       with tan r_k = r_k, kπ < r_k < (k + ½)π
"""

import numpy as np

from elastica.ends import End


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
    pins = sum(end is End.PINNED for end in ends)
    if pins == 2:
        return n * np.pi
    if pins == 1:
        return tangent_root(n)
    return np.where(n % 2, (n + 1) * np.pi, 2 * tangent_root(np.maximum(n // 2, 1)))


def euler_modes_below(p, ends):
    """Number of Euler thrusts strictly below p, shape of `p`.

    Loads of consecutive modes are less than 2π apart in √ν, so counting through a table of them is
    exact.
    """
    root = np.sqrt(p)
    table = euler_root(np.arange(1, int(np.max(root, initial=0.0) / np.pi) + 3), ends)
    return np.searchsorted(table * table, p, side="left")
