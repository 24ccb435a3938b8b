"""A peer: SciPy's collocation solver on half of the strip, which is symmetric."""

import time

import numpy as np
from scipy.integrate import solve_bvp

from elastica.scales import FOUR_PI_SQUARED
from studies.accuracy.cases import SAMPLES, Answer

NODES = 21
MOST_NODES = 100_000
STEEPEST = 1.0
"""Radians of the bow that free shapes start from."""


def collocation(case, tolerance):
    """One state by `solve_bvp`; unknowns θ, θ', y and at a contact the force λ.

    The start is a cosine of the right height. Energy and shortening are integrated over the solution's own
    polynomials by three Gauss points each, outside of the time.
    """
    p = FOUR_PI_SQUARED * case.P
    touches = case.state != "B1"

    def strip(s, z, force=(0.0,)):
        theta, curvature, _ = z
        return np.stack([curvature, -p * np.sin(theta) + force[0] * np.cos(theta), np.sin(theta)])

    def ends(a, b, force=(0.0,)):
        held = [a[0], a[2], b[0]]
        return np.array([*held, b[2] - case.H] if touches else held)

    height = case.H if touches else STEEPEST / np.pi
    s = np.linspace(0, 0.5, NODES)
    start = np.stack(
        [
            height * np.pi * np.sin(2 * np.pi * s),
            2 * height * np.pi**2 * np.cos(2 * np.pi * s),
            height / 2 * (1 - np.cos(2 * np.pi * s)),
        ]
    )
    begin = time.perf_counter()
    found = solve_bvp(
        strip, ends, s, start, p=[0.0] if touches else None, tol=tolerance, max_nodes=MOST_NODES
    )
    solving = time.perf_counter() - begin
    half = found.sol(np.linspace(0, 0.5, SAMPLES // 2 + 1))
    y = np.concatenate([half[2], half[2, -2::-1]])
    sampling = time.perf_counter() - begin - solving
    points, weights = np.polynomial.legendre.leggauss(3)
    widths = np.diff(found.x)[:, None]
    theta, curvature, _ = found.sol(found.x[:-1, None] + widths * (points + 1) / 2)
    # Both halves together: twice the weights of one, which add up to the widths.
    shorter, bent = (
        float((widths * weights * density).sum())
        for density in (2 * np.sin(theta / 2) ** 2, 0.5 * curvature**2)
    )
    return Answer(
        {"equilibrium": solving, "shape": solving + sampling},
        (bent - p * shorter) / FOUR_PI_SQUARED,
        shorter,
        None,
        None,
        y,
    )
