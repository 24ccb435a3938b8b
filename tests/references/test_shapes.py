"""Shapes with 30 digits: contact words by Taylor series of their equation, free loops in closed form."""

from decimal import Decimal, localcontext
from itertools import accumulate
from operator import mul

import mpmath as mp
import numpy as np
import pytest

from elastica import Status, solve
from elastica.scales import FOUR_PI_SQUARED

TERMS, REACH = 30, Decimal("0.25")
"""Of a Taylor series, and how far √F·s it is trusted: what it leaves out is below 1e-20."""
NARROW = 1e-8, 1e-5
WORDS = [
    ("U", "clamped-clamped", (1.2, 8), (*NARROW, 0.01, 0.2)),
    ("aU", "clamped-clamped", (9.5, 20), (*NARROW, 0.05)),
    ("UD", "clamped-clamped", (5, 20), (*NARROW, 0.1)),
    ("UDU", "clamped-clamped", (12, 40), (0.01, 0.1)),
    ("UDDU", "clamped-clamped", (30, 60), (0.01, 0.03)),
    ("U:2", "clamped-clamped", (30, 90), (0.01, 0.1)),
    ("U", "pinned-pinned", (0.5, 2), (*NARROW, 0.2)),
    ("UDa", "pinned-clamped", (12, 20), (0.01, 0.1)),
    ("UD", "clamped-pinned", (5, 12), (0.01, 0.1)),
    ("U", "0.3/2.5", (1, 4), (1e-3, 0.2)),
    ("UDU", "20/pinned", (12, 20), (0.01, 0.08)),
    ("U-", "clamped-clamped", (4.1, 12), (*NARROW, 0.05)),
    ("UD-", "pinned/5", (6, 16), (0.01, 0.05)),
    ("UDUD-", "clamped-pinned", (24, 50), (1e-3, 0.01)),
    ("UDUDUDUDUD", "clamped-clamped", (90, 200), (1e-4, 0.01)),
]
LOOPS = [("B1", "pinned-pinned", -1, 2), ("B2", "pinned-pinned", -3, 4), ("B1", "clamped-clamped", -2, 4)]
"""Free shapes without a force across: phase at the start and length of the strip, in units of K."""
SAMPLES = 15


@pytest.fixture(autouse=True)
def thirty_digits():
    with localcontext() as context, mp.workdps(30):
        context.prec = 30
        yield


def numbers(values):
    return [Decimal(float(value)) for value in np.ravel(values)]


def step(state, p, lam, h):
    """θ, θ', x, y, sin θ, cos θ an arc length h further, by Taylor series of θ'' = −p sin θ + λ cos θ."""
    theta, slopes, x, y, sin, cos = ([value] for value in state)
    for k in range(TERMS):
        slopes.append((lam * cos[k] - p * sin[k]) / (k + 1))
        theta.append(slopes[k] / (k + 1))
        x.append(cos[k] / (k + 1))
        y.append(sin[k] / (k + 1))
        sin.append(sum(map(mul, slopes, cos[k::-1])) / (k + 1))
        cos.append(-sum(map(mul, slopes, sin[k::-1])) / (k + 1))
    powers = list(accumulate([h] * TERMS, mul, initial=Decimal(1)))
    return [sum(map(mul, series, powers)) for series in (theta, slopes, x, y, sin, cos)]


def states_at(places, state, p, lam):
    """States at arc lengths of one sign, in the order of their distance from that of `state`, 0."""
    most, here = REACH / (p * p + lam * lam).sqrt().sqrt(), Decimal(0)
    for place in places:
        number = int(abs(place - here) / most) + 1
        for _ in range(number):
            state = step(state, p, lam, (place - here) / number)
        here = place
        yield state


def by_taylor_series(s, i):
    """θ, x, y of a contact word at the arc lengths of its shape, with its κ, λ and lengths, shape (3, n).

    Each segment starts from a wall, where θ = 0 and the curvature is known: the first one backwards.
    """
    (p,), (kappa,), (H,) = (numbers(each[i]) for each in (FOUR_PI_SQUARED * s.P, s.curvature, s.H))
    lam, lengths, samples = numbers(s.lam[i]), numbers(s.lengths[i]), numbers(s.shape(SAMPLES).s)
    walls = s.state.walls
    (flat,) = numbers(s.flat_length[i] / len(walls))
    touching = [[Decimal(0), -wall * kappa, Decimal(0), wall * H, Decimal(0), Decimal(1)] for wall in walls]

    before = [sample - lengths[0] for sample in samples if sample <= lengths[0]]
    *first, start = states_at([*before[::-1], -lengths[0]], touching[0], p, walls[0] * lam[0])
    shape = [(state[0], state[2] - start[2], state[3]) for state in first[::-1]]
    begin, x = lengths[0], -start[2]
    for k, wall in enumerate(walls):
        lies = [sample - begin for sample in samples if begin < sample <= begin + flat]
        shape += [(Decimal(0), x + place, wall * H) for place in lies]
        begin, x = begin + flat, x + flat
        last = k == len(walls) - 1
        # The last segment is written towards its wall.
        across = lam[k + 1] * (-wall if last else walls[k + 1])
        until = 2 if last else begin + lengths[k + 1]
        places = [sample - begin for sample in samples if begin < sample <= until]
        *inside, end = states_at([*places, lengths[k + 1]], touching[k], p, across)
        shape += [(state[0], x + state[2], state[3]) for state in inside]
        begin, x = begin + lengths[k + 1], x + end[2]
    return np.array(shape, dtype=object).T


@pytest.mark.parametrize(("name", "ends", "loads", "gaps"), WORDS)
def test_contact_words_by_taylor_series(name, ends, loads, gaps):
    P, H = (each.ravel() for each in np.meshgrid(loads, gaps))
    s = solve(name, P=P, H=H, ends=ends)
    there = np.flatnonzero(np.isin(s.status, (Status.SOLVED, Status.INADMISSIBLE)))
    assert there.size >= 2
    _, *shape = s.shape(SAMPLES)
    for i in there:
        exact = by_taylor_series(s, i)
        sizes = np.abs(shape[0][i]).max(), 1, s.H[i]
        for got, wanted, size in zip(shape, exact, sizes, strict=True):
            error = max(abs(float(one - other)) for one, other in zip(numbers(got[i]), wanted, strict=True))
            assert error < 1e-13 * size


@pytest.mark.parametrize(("name", "ends", "start", "quarters"), LOOPS)
@pytest.mark.parametrize("load", [1.02, 3, 40, 1000])
def test_free_loops_in_closed_form(name, ends, start, quarters, load):
    """Up to loops so narrow that 1 − m is below the smallest rounding of m by far."""
    P = load * quarters**2 / 16
    _, theta, x, y = solve(name, P=P, H=0.3, ends=ends).shape(SAMPLES)
    with mp.workdps(240):
        root_p = mp.sqrt(mp.mpf(float(FOUR_PI_SQUARED * P)))
        K = root_p / quarters
        log = mp.findroot(lambda log: mp.ellipk(-mp.expm1(log)) - K, min(mp.log(16) - 2 * K, -0.01))
        m = -mp.expm1(log)
        _, cn, E = jacobi(start * K, K, m)
        for j, s in enumerate(np.linspace(0, 1, SAMPLES)):
            sn_s, cn_s, E_s = jacobi(start * K + root_p * mp.mpf(s), K, m)
            assert abs(theta[j] - 2 * mp.atan2(mp.sqrt(m) * sn_s, mp.sqrt(1 - m * sn_s**2))) < 5e-14
            assert abs(x[j] - (2 * (E_s - E) / root_p - mp.mpf(s))) < 1e-14
            assert abs(y[j] - 2 * mp.sqrt(m) * (cn - cn_s) / root_p) < 1e-14


def jacobi(u, K, m):
    """The functions sn, cn and E(u|m)."""
    turns = mp.nint(u / (2 * K))
    sn, cn = (mp.ellipfun(name, u - 2 * turns * K, m) for name in ("sn", "cn"))
    sign = (-1) ** int(turns)
    return sign * sn, sign * cn, 2 * turns * mp.ellipe(m) + mp.ellipe(mp.atan2(sn, cn), m)


def test_where_a_line_contact_would_be_shorter_than_nothing_its_ends_hold_all_the_same():
    """Both segments are what they are elsewhere; the second one counts where both would be."""
    state = solve("U-", P=3.5, H=0.05)
    assert state.status == Status.INADMISSIBLE and state.flat_length < -0.02
    s, theta, _, y = state.shape(101)
    second = s > state.lengths[0] + state.flat_length
    first = np.flatnonzero(~second)
    assert np.abs(theta[first] + theta[::-1][first]).max() < 1e-13
    assert np.abs(y[first] - y[::-1][first]).max() < 1e-13
    assert (theta[~second] >= 0).all() and (theta[second] <= 0).all()


def test_a_shape_knows_nothing_of_its_neighbours(rng):
    P, H = rng.uniform(1.5, 9, 120), rng.uniform(0.05, 0.25, 120)
    _, *together = solve("U", P=P, H=H).shape(101)
    for i in range(0, 120, 17):
        _, *alone = solve("U", P=P[i], H=H[i]).shape(101)
        for block, own in zip(together, alone, strict=True):
            assert np.array_equal(block[i], own, equal_nan=True)
