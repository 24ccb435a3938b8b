"""What everything that can be asked of a state costs, beside the floor and beside dense algebra.

The floor is how long the special functions take that a perfect solver of a state needs: four evaluations of
K, E, F(φ₀|m), E(φ₀|m) for each distinct segment. Three are Newton steps from the closed form of small
deflections, which square its error of some H² to below rounding, the last is for its properties.
All else (derivatives, steps, energies, verdict) would be free.

The functions are timed in two ways: SciPy's four, and this package's one pass for all four, which the solver
uses and which is several times faster. Eigenvalues and frequencies are found segment by segment; the dense
procedure puts all segments into one matrix. All times are those of the processor.
"""

import time
from statistics import median
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc
from threadpoolctl import threadpool_limits

import elastica
from elastica.codes import Status
from elastica.pendulum.elliptic import integrals
from elastica.pendulum.segments import pendulum
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability import dense

EVALUATIONS = 4


class Row(NamedTuple):
    """A state, loads and gaps at which it exists, and its number of distinct segments."""

    title: str
    state: str
    loads: tuple[float, float]
    gaps: tuple[float, float]
    segments: int
    ends: str = "clamped-clamped"


def alternating(contacts):
    """The word U, UD, UDU … with so many contacts between clamps, where it does not lie flat yet.

    In narrow gaps it does from P = (contacts + 1)² on, in wider ones earlier.
    """
    loads = (contacts + 0.05) ** 2, (contacts + 0.9) ** 2
    widest = min(0.05, 0.3 / (contacts * (contacts + 1) ** 0.5))
    title = f"{contacts} contacts"
    return Row(title, ("UD" * contacts)[:contacts], loads, (0.1 * widest, widest), min(contacts, 2))


STATES = [
    alternating(1)._replace(title="U"),
    alternating(2)._replace(title="UD"),
    alternating(3)._replace(title="UDU"),
    alternating(20)._replace(title="(UD)×10"),
    Row("U, springs 0.3/2.5", "U", (1.05, 3.0), (0.005, 0.05), 2, "0.3/2.5"),
]
CONTACTS = 1, 2, 5, 10, 20, 50
SIZES = 4_000, 100_000
"""Points of a block that is solved."""
SOLVED, DENSE = 4_000, 20
"""Points over contacts at which the other quantities are asked for, and points at which dense matrices give
them too."""
OF_CONTACTS = 500
"""Points of each number of contacts at which they are."""
REPEATS, QUICK_REPEATS = 5, 3
ON_DEMAND = {
    "eigenvalues": lambda s: s.eigenvalues(4),
    "frequencies": lambda s: s.frequencies(4),
    "shape": lambda s: s.shape(101),
}
"""What is asked of solved states."""
PEERS = {"eigenvalues": dense.eigenvalues, "frequencies": dense.frequencies}
"""The same with all segments in one matrix."""


def floor(quick=False):
    """Processor time of everything of a state, medians of interleaved repeats.

    Returns
    -------
    xarray.Dataset
        Seconds per state: `solve_seconds` (floor_state, block), `floor_seconds` (functions, floor_state,
        block), `quantity_seconds` and `dense_seconds` (floor_state, quantity), `contact_seconds` (contacts,
        quantity). `difference` (floor_state, quantity) is the largest one between the two ways, relative to
        the value or to π², whichever is larger.
    """
    sizes, repeats = (SIZES[:1], QUICK_REPEATS) if quick else (SIZES, REPEATS)
    rows = [(row, SOLVED // len(row.state)) for row in STATES]
    rows += [(alternating(contacts), OF_CONTACTS) for contacts in CONTACTS]
    taken = np.full((3, len(STATES), len(sizes)), np.nan)
    quantities = np.full((len(rows), len(ON_DEMAND)), np.nan)
    peers, difference = np.full((2, len(STATES), len(ON_DEMAND)), np.nan)
    with threadpool_limits(limits=1):
        for i, row in enumerate(STATES):
            for j, size in enumerate(sizes):
                taken[:, i, j] = _medians(_tasks(row, size), repeats, size)
            peers[i], difference[i] = _beside_dense(_solved(row, DENSE))
        for i, (row, size) in enumerate(rows):
            solved = _solved(row, size)
            tasks = [lambda ask=ask, s=solved: ask(s) for ask in ON_DEMAND.values()]
            quantities[i] = _medians(tasks, repeats, solved.P.size)
        contacts = [_medians(_tasks(alternating(n), SIZES[0])[:1], repeats, SIZES[0]) for n in CONTACTS]
    about = {"units": "s", "long_name": "processor time per state"}
    by_state, by_contacts = np.split(quantities, [len(STATES)])
    return xr.Dataset(
        {
            "solve_seconds": (("floor_state", "block"), taken[0], about),
            "floor_seconds": (("functions", "floor_state", "block"), taken[1:], about),
            "quantity_seconds": (("floor_state", "quantity"), by_state, about),
            "dense_seconds": (("floor_state", "quantity"), peers, about),
            "difference": (("floor_state", "quantity"), difference, {"long_name": "relative difference"}),
            "contact_solve_seconds": (("contacts",), np.ravel(contacts), about),
            "contact_seconds": (("contacts", "quantity"), by_contacts, about),
        },
        {
            "floor_state": [row.title for row in STATES],
            "block": list(sizes),
            "functions": ["SciPy", "one pass"],
            "quantity": list(ON_DEMAND),
            "contacts": list(CONTACTS),
        },
    )


def _points(row, size):
    """Random loads and gaps of a state."""
    random = np.random.default_rng(0)
    (least, most), (narrow, wide) = row.loads, row.gaps
    return random.uniform(least, most, size), random.uniform(narrow, wide, size)


def _solved(row, size):
    """The state at so many points at which it is there."""
    P, H = _points(row, 2 * size)
    s = elastica.solve(row.state, P=P, H=H, ends=row.ends)
    there = np.flatnonzero(s.status == Status.SOLVED)[:size]
    return elastica.solve(row.state, P=P[there], H=H[there], ends=row.ends)


def _tasks(row, size):
    """The solver, SciPy's functions and this package's, at the parameters of random states."""
    P, H = _points(row, size)
    s = elastica.solve(row.state, P=P, H=H, ends=row.ends)
    q = pendulum(FOUR_PI_SQUARED * P, s.curvature, s.lam[:, 0])
    sin, cos = q.sin_half_alpha / np.sqrt(q.m), s.curvature / (2 * q.r * np.sqrt(q.m))
    phi = np.arctan2(sin, cos)
    count = EVALUATIONS * row.segments

    def scipy():
        for _ in range(count):
            ellipk(q.m), ellipe(q.m), ellipkinc(phi, q.m), ellipeinc(phi, q.m)

    def one_pass():
        for _ in range(count):
            integrals(q.m1, sin, cos)

    return lambda: elastica.solve(row.state, P=P, H=H, ends=row.ends), scipy, one_pass


def _beside_dense(solved):
    """Seconds a state of the dense procedure, and how far its values are from those by segments."""
    seconds, difference = np.full((2, len(ON_DEMAND)), np.nan)
    for i, name in enumerate(ON_DEMAND):
        if name in PEERS:
            values = ON_DEMAND[name](solved)
            begin = time.process_time()
            others = PEERS[name](solved, values.shape[-1])
            seconds[i] = (time.process_time() - begin) / solved.P.size
            scale = np.maximum(np.abs(others), np.pi**2)
            difference[i] = np.max(np.abs(values - others) / scale)
    return seconds, difference


def _medians(tasks, repeats, size):
    """Seconds a state of each task."""
    times = [[_seconds(task) for task in tasks] for _ in range(repeats)]
    return [median(column) / size for column in zip(*times, strict=True)]


def _seconds(task):
    begin = time.process_time()
    task()
    return time.process_time() - begin
