"""The floor: how long the special functions take that a perfect solver of a state needs.

Four evaluations of K, E, F(φ₀|m), E(φ₀|m) for each distinct segment: three Newton steps from the closed form
of small deflections, which squares its error of some H² three times to below rounding, and one for the
state's properties at the end. Everything else (derivatives, steps, energies, verdict) would be free.

The functions are timed in two ways: SciPy's four, and this package's one pass for all four, which the solver
uses and which is several times faster.
"""

import time
from statistics import median

import numpy as np
import xarray as xr
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc
from threadpoolctl import threadpool_limits

import elastica
from elastica.pendulum.elliptic import integrals
from elastica.pendulum.segments import pendulum
from elastica.scales import FOUR_PI_SQUARED

EVALUATIONS = 4
STATES = {"U": (1.05, 3.9, 1), "UD": (4.2, 8.8, 2), "UDU": (9.5, 15.5, 2)}
"""Loads between which the state exists at small gaps, and its number of distinct segments."""
GAPS = 0.005, 0.05
SIZES = 10_000, 100_000
REPEATS, QUICK_REPEATS = 9, 3


def floor(quick=False):
    """Time of equilibrium + index beside that of the special functions alone, medians of interleaved repeats.

    Returns
    -------
    xarray.Dataset
        Seconds per state: `solve_seconds` (floor_state, block), `floor_seconds` (functions, floor_state,
        block).
    """
    sizes, repeats = (SIZES[:1], QUICK_REPEATS) if quick else (SIZES, REPEATS)
    taken = np.full((3, len(STATES), len(sizes)), np.nan)
    with threadpool_limits(limits=1):
        for i, (state, limits) in enumerate(STATES.items()):
            for j, size in enumerate(sizes):
                tasks = _tasks(state, *limits, size)
                times = [[_seconds(task) for task in tasks] for _ in range(repeats)]
                taken[:, i, j] = [median(column) / size for column in zip(*times, strict=True)]
    about = {"units": "s", "long_name": "time per state"}
    return xr.Dataset(
        {
            "solve_seconds": (("floor_state", "block"), taken[0], about),
            "floor_seconds": (("functions", "floor_state", "block"), taken[1:], about),
        },
        {"floor_state": list(STATES), "block": list(sizes), "functions": ["SciPy", "one pass"]},
    )


def _tasks(state, low, high, segments, size):
    """The solver, SciPy's functions and this package's, at the parameters of random states."""
    random = np.random.default_rng(0)
    P, H = random.uniform(low, high, size), random.uniform(*GAPS, size)
    s = elastica.solve(state, P=P, H=H)
    q = pendulum(FOUR_PI_SQUARED * P, s.curvature, s.lam[:, 0])
    sin, cos = q.sin_half_alpha / np.sqrt(q.m), s.curvature / (2 * q.r * np.sqrt(q.m))
    phi = np.arctan2(sin, cos)
    count = EVALUATIONS * segments

    def scipy():
        for _ in range(count):
            ellipk(q.m), ellipe(q.m), ellipkinc(phi, q.m), ellipeinc(phi, q.m)

    def one_pass():
        for _ in range(count):
            integrals(q.m1, sin, cos)

    return lambda: elastica.solve(state, P=P, H=H), scipy, one_pass


def _seconds(task):
    begin = time.perf_counter()
    task()
    return time.perf_counter() - begin
