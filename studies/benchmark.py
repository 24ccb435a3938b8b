"""Speed against error: the exact solver beside SciPy's `solve_bvp` on the same one-point state, in one run.

Left out: other states and peers, scaling with the size of a study.
"""

import os
import platform
import time
from statistics import median
from typing import NamedTuple

import numpy as np
import scipy
from scipy.integrate import solve_bvp
from threadpoolctl import threadpool_limits

import elastica
from elastica.scales import FOUR_PI_SQUARED

HALF_GAP = 0.1
REFERENCES = {1.5: 1.7563029560307609, 2.5: 1.1736614203684513, 3.5: 0.41759145111659715}
"""κ of the clamped one-point state at these loads, from 50-digit arithmetic."""
TOLERANCES = (1e-3, 1e-6, 1e-9)


class Row(NamedTuple):
    """One method: seconds a state, and the largest relative error of κ over the references."""

    method: str
    seconds: float
    error: float


def benchmark(quick=False):
    """Time and error of every method for the clamped one-point state.

    Parameters
    ----------
    quick : bool
        Fewer repeats.

    Returns
    -------
    list of Row
        Medians over interleaved repeats on one core.
    """
    tasks = {
        f"exact, blocks of {size:,}: equilibrium + index + verdict": _exact(size) for size in (10_000, 100, 1)
    }
    tasks["exact, blocks of 10,000: the same + 4 eigenvalues"] = _exact(10_000, eigenvalues=4)
    for tolerance in TOLERANCES:
        tasks[f"solve_bvp, tolerance {tolerance:g}: equilibrium"] = _collocation(tolerance)
    times = {method: [] for method in tasks}
    errors = {}
    with threadpool_limits(limits=1):
        for _ in range(3 if quick else 9):
            for method, task in tasks.items():
                seconds, errors[method] = task()
                times[method].append(seconds)
    return [Row(method, median(times[method]), errors[method]) for method in tasks]


def _exact(size, eigenvalues=0):
    """Solve a block of random points that contains the references."""
    random = np.random.default_rng(0)
    P, H = random.uniform(1.05, 3.9, size), random.uniform(0.01, 0.1, size)
    loads = list(REFERENCES)[:size]
    P[: len(loads)], H[: len(loads)] = loads, HALF_GAP

    def task():
        start = time.perf_counter()
        s = elastica.solve("U", P=P, H=H)
        if eigenvalues:
            s.eigenvalues(eigenvalues)
        seconds = (time.perf_counter() - start) / size
        kappa = s.curvature[: len(loads)]
        return seconds, _error(loads, kappa)

    return task


def _collocation(tolerance):
    """The same boundary value problem on half of the strip: θ, θ', y and the unknown force λ."""

    def task():
        seconds, kappa = [], []
        for P in REFERENCES:
            p = FOUR_PI_SQUARED * P

            def strip(s, z, force, p=p):
                theta, curvature, _ = z
                bend = -p * np.sin(theta) + force[0] * np.cos(theta)
                return np.stack([curvature, bend, np.sin(theta)])

            def ends(a, b, force):
                return np.array([a[0], a[2], b[0], b[2] - HALF_GAP])

            s = np.linspace(0, 0.5, 21)
            shape = HALF_GAP / 2 * (1 - np.cos(2 * np.pi * s))
            slope = HALF_GAP * np.pi * np.sin(2 * np.pi * s)
            bend = 2 * HALF_GAP * np.pi**2 * np.cos(2 * np.pi * s)
            start = time.perf_counter()
            found = solve_bvp(
                strip, ends, s, np.stack([slope, bend, shape]), p=[0.0], tol=tolerance, max_nodes=100_000
            )
            seconds.append(time.perf_counter() - start)
            kappa.append(found.y[1, 0])
        return median(seconds), _error(REFERENCES, kappa)

    return task


def _error(loads, kappa):
    """Largest relative error against the references."""
    return max(abs(k / REFERENCES[P] - 1) for P, k in zip(loads, kappa, strict=True))


def report(rows):
    """The benchmark as Markdown, with ratios to the fastest exact row."""
    exact = rows[0]
    lines = [
        "# Speed against error",
        "",
        f"Clamped one-point state `U`, H = {HALF_GAP}, P = {', '.join(map(str, REFERENCES))}; one core.",
        f"{platform.machine()}, {_processor()}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, SciPy {scipy.__version__}.",
        "",
        "| method | µs a state | states/s | relative error of κ | time, exact = 1 |",
        "|---|---:|---:|---:|---:|",
    ]
    for row in rows:
        lines.append(
            f"| {row.method} | {row.seconds * 1e6:,.2f} | {1 / row.seconds:,.0f} | {row.error:.1e} "
            f"| {row.seconds / exact.seconds:,.0f} |"
        )
    return "\n".join([*lines, ""])


def _processor():
    """Name of the processor, where the system tells."""
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo", encoding="utf-8") as information:
            for line in information:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"
