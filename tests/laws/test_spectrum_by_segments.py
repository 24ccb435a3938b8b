"""Eigenvalues and frequencies by segments beside those of the whole strip in one matrix."""

from functools import partial

import numpy as np
import pytest
from laws.test_audits import random_end
from scipy.linalg import eigvalsh

import elastica
from elastica import Event, Stability, Status
from elastica.control import LOAD, SHORTENING
from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root
from elastica.stability import dense, spectrum, vibration
from elastica.stability.assembly import SPARE, strip_of
from elastica.stability.elements import batches
from elastica.state import parse_state

CC, PP = "clamped-clamped", "pinned-pinned"
FOUR_PI_SQUARED = 4 * np.pi**2
BESIDE = 0, 1e-15, -1e-15, 1e-13, -1e-13, 1e-12, -1e-11, 1e-10, -1e-9, 1e-8, -1e-7, 1e-6
"""Relative distances in P from where something coincides."""


def eigenvalues(solution, count, control, by=spectrum):
    return by.eigenvalues(solution, count, control)


def squared_frequencies(solution, count, control, by=vibration):
    """Signed ω²: near zero they keep the digits that ω has not."""
    omega = by.frequencies(solution, count, control)
    return omega * np.abs(omega)


ALLOWED = {eigenvalues: 1e-10, squared_frequencies: 1e-9}


class Differences:
    """Between segments and the whole strip, relative to the value or to π², by what was asked for."""

    def __init__(self, compared):
        self.compared = compared
        self.found = {of: [] for of in ALLOWED}
        self.wrong = []

    def take(self, solution, count, control, of):
        """Compare at all points."""
        by_segments, whole = of(solution, count, control), of(solution, count, control, dense)
        assert np.array_equal(np.isnan(by_segments), np.isnan(whole))
        error = (np.abs(by_segments - whole) / np.maximum(np.abs(whole), np.pi**2)).max(axis=1)
        known = np.isfinite(error)
        self.compared(known)
        self.found[of] += error[known].tolist()
        for i in np.flatnonzero(known & (error > ALLOWED[of])):
            name, ends = solution.state.name, str(solution.ends)
            place = name, ends, float(solution.P[i]), float(solution.H[i])
            self.wrong.append((float(error[i]), of.__name__, control.name, count, place))

    def take_all(self, solution, count):
        for control in (LOAD, SHORTENING):
            for of in ALLOWED:
                if not (solution.state.straight and of == eigenvalues):
                    self.take(solution, count, control, of)

    def check(self, median=1e-13):
        assert not self.wrong, f"{len(self.wrong)}: {sorted(self.wrong)[::-1][:8]}"
        for error in self.found.values():
            assert np.median(error) <= median


def random_solution(rng, points=12):
    """A state with up to four contacts, of whatever kind, at points anywhere in its plane."""
    ends, contacts = f"{random_end(rng)}/{random_end(rng)}", int(rng.integers(0, 5))
    names = [
        name for name in elastica.states(ends, contacts) if len(parse_state(name, ends).word) == contacts
    ]
    lines = [name for name in names if name.endswith("-")]
    name = str(rng.choice(lines if lines and rng.random() < 0.2 else names))
    P = np.exp(rng.uniform(np.log(0.3), np.log(100), points))
    H = np.exp(rng.uniform(np.log(0.005), np.log(0.45), points)) / max(1, 0.8 * contacts)
    if name.startswith("B"):
        euler = float(euler_root(int(name[1:]), parse_ends(ends))) ** 2 / FOUR_PI_SQUARED
        P, H = euler * (1 + 10 ** rng.uniform(-4, 0.3, points)), 0.5
    return elastica.solve(name, P=P, H=H, ends=ends)


@pytest.mark.at_least(200)
def test_random_states(compared, full, rng):
    differences, wanted = Differences(compared), 2_000 if full else 60
    while wanted > 0:
        s = random_solution(rng)
        wanted -= np.count_nonzero(s.status == Status.SOLVED)
        differences.take_all(s, int(rng.integers(1, 9)))
        check_index(s)
    differences.check()


def check_index(s):
    """As many eigenvalues are negative as the state has unstable directions in its free segments."""
    flat = s.state.line & (s.flat_length * np.sqrt(s.P) > 1)
    nu = s.eigenvalues(int(s.index.max()) + 2)
    sure = (s.stability != Stability.CRITICAL) & np.isfinite(nu[:, 0])
    assert (nu < 0).sum(axis=1)[sure].tolist() == (s.index - flat)[sure].tolist(), (s.state.name, s.P, s.H)


def test_fifty_contacts():
    """Eigenvalues are differences of terms ∝ F, of which many contacts leave twelve digits."""
    s = elastica.solve("UD" * 25, P=[1500.0], H=0.004)
    by_segments = spectrum.eigenvalues(s, 5)
    allowed = 1e-12 * FOUR_PI_SQUARED * 1500
    assert by_segments == pytest.approx(spectrum.eigenvalues(s, 5, terms=30), abs=allowed, rel=0)
    assert by_segments == pytest.approx(dense.eigenvalues(s, 5), abs=allowed, rel=0)
    check_index(s)


def near(P):
    """Loads on both sides of each."""
    return np.outer(P, 1 + np.array(BESIDE)).ravel()


def _solve(name, ends, P):
    return elastica.solve(name, P=P, H=0.05, ends=ends)


def ways_to_held(solution, control, of):
    """From each of the lowest eigenvalues to each of the lowest ones with contacts held, shape (n, 4, 4)."""
    held = np.full((solution.status.size, 4), np.nan)
    inertia = of == squared_frequencies
    for points, elements, terms in batches(solution, 4):
        shift = np.max([q.F for q in elements.pendulums], axis=0)
        unit = np.sqrt(solution.shortening[points])
        strip = strip_of(elements, solution.ends, terms, SPARE, shift, unit, inertia, control)
        held[points] = (np.sort(strip.held[0], axis=0)[:4] - shift).T
    return of(solution, 4, control)[:, :, None] - held[:, None]


def closed_in(solve, low, high, value):
    """Loads in brackets (n,) where `value` of a solution, shape (n,), changes its sign."""
    for _ in range(17):
        P = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, 9)
        found = value(solve(P.ravel())).reshape(P.shape)
        first = (found[:, 1:] * found[:, :1] <= 0).argmax(axis=1)
        low, high = np.take_along_axis(P, np.stack([first, first + 1], axis=1), axis=1).T
    return low


MEETINGS = [
    ("U", CC, 1.1, 3.9),
    ("UD", CC, 2, 7),
    ("UDU", CC, 5, 14),
    ("U", PP, 0.3, 0.95),
    ("UD", "0.3/2.5", 1.5, 5),
    ("Ua", CC, 2.2, 3.8),
    ("UU", CC, 4.2, 9),
    ("UDUD", CC, 9, 20),
    ("UDU", PP, 2, 8),
]


@pytest.mark.at_least(100)
def test_next_to_a_held_mode(compared, full):
    """A pole of the stiffness at a contact."""
    differences = Differences(compared)
    for number, (name, ends, low, high) in enumerate(MEETINGS):
        solve = partial(_solve, name, ends)
        s = solve(np.linspace(low, high, 40))
        kinds = [(of, control) for of in ALLOWED for control in (LOAD, SHORTENING)]
        for of, control in kinds if full else [kinds[number % 4]]:
            way = ways_to_held(s, control, of)
            where = np.argwhere(way[1:] * way[:-1] < 0)
            for a, b in np.unique(where[:, 1:], axis=0)[: None if full else 1]:
                some = where[(where[:, 1:] == (a, b)).all(axis=1), 0]
                between = partial(_way, control=control, of=of, a=a, b=b)
                P = closed_in(solve, s.P[some], s.P[some + 1], between)
                differences.take(solve(near(P)), 4, control, of)
    differences.check(median=1e-12)


def _way(solution, control, of, a, b):
    return ways_to_held(solution, control, of)[:, a, b]


@pytest.mark.at_least(40)
def test_where_even_and_odd_eigenvalues_cross(compared, full):
    """Of symmetric states: the gap between two of them has a sharp minimum."""
    differences = Differences(compared)
    for name, ends, low, high in [MEETINGS[i] for i in ((0, 1, 2, 3, 6, 8) if full else (0, 2, 8))]:
        solve = partial(_solve, name, ends)
        P = np.linspace(low, high, 60)
        for of in ALLOWED:
            gap = np.diff(of(solve(P), 5, LOAD), axis=1)
            least = np.argwhere((gap[1:-1] < gap[:-2]) & (gap[1:-1] < gap[2:]))
            for i, mode in least[:: 1 if full else 3]:
                at, step = P[i + 1], P[1] - P[0]
                while step > 1e-16 * at:
                    around = at + step * np.linspace(-1, 1, 17)
                    narrow = np.diff(of(solve(around), 5, LOAD), axis=1)[:, mode]
                    at, step = around[np.nanargmin(narrow)], step / 6
                differences.take_all(solve(near(at)), 5)
    differences.check(median=1e-12)


@pytest.mark.at_least(40)
def test_beside_transitions(compared, full):
    """κ → 0 below point → line; folds, where an eigenvalue vanishes."""
    differences = Differences(compared)
    away = 10.0 ** -np.arange(2, 14, 1 if full else 3)
    for name, ends, H in [
        ("U", CC, 0.05),
        ("UD", CC, 0.05),
        ("U", PP, 0.05),
        ("UDU", CC, 0.03),
        ("UUD", CC, 0.03),
        ("Ua", "0.3/2.5", 0.05),
    ][: None if full else 3]:
        events = elastica.transitions(name, H, ends, P_max=25 if full else 10)
        for event in (Event.POINT_TO_LINE, Event.FOLD):
            for P in events.P[events.event == event][:2]:
                differences.take_all(elastica.solve(name, P=P * (1 - away), H=H, ends=ends), 4)
                differences.take_all(elastica.solve(name, P=P * (1 + away), H=H, ends=ends), 4)
    differences.check(median=1e-12)


@pytest.mark.parametrize(
    ("name", "P", "ends"),
    [("U", (1.1, 3.9), CC), ("UDU", (5, 14), CC), ("UD-", (8.5, 15), CC), ("aUDa", (2, 9), "0.3/pinned")],
)
def test_values_do_not_depend_on_neighbours(name, P, ends, rng):
    P = rng.uniform(*P, 40)
    order, whole = rng.permutation(P.size), _solve(name, ends, P)
    some = [part for size in (1, 2, 3, 37) for part in np.split(order, range(size, P.size, size))[:6]]
    blocks = [(part, _solve(name, ends, P[part])) for part in some]
    for of in (spectrum.eigenvalues, vibration.frequencies):
        for control in (LOAD, SHORTENING):
            together = of(whole, 4, control)
            for part, block in blocks:
                assert np.array_equal(of(block, 4, control), together[part], equal_nan=True)
            assert np.isfinite(together).any()


@pytest.mark.at_least(30)
@pytest.mark.parametrize(("name", "ends"), [("U", CC), ("UDU", CC), ("UDa", "0.3/pinned"), ("UUD", PP)])
def test_conventional_method_beside_the_whole_strip(compared, name, ends):
    """All its eigenvalues, with contacts held at their material points."""
    s = elastica.solve(name, P=np.linspace(1, 20, 60), H=0.04, ends=ends)
    values, index, _ = s.conventional(3)
    for points, elements, terms in batches(s, 3, contacts_move=False, joined=True):
        for point, Q, weight in zip(points, *dense.quadratic_forms(elements, terms).constrained, strict=True):
            whole = eigvalsh(Q, weight)
            assert (whole < 0).sum() == index[point]
            assert np.abs(values[point] - whole[:3]).max() <= 1e-9 * max(abs(whole[2]), s.P[point] * 40)
            compared(1)
