"""Jacobi's functions by theta series, and the strip's direction from them, against 40 digits."""

import mpmath as mp
import numpy as np
import pytest

from elastica.pendulum.segments import Pendulum, pendulum
from elastica.pendulum.swing import directions
from elastica.pendulum.theta import SHORT_FROM, nome, series

BORDER = (SHORT_FROM, np.nextafter(SHORT_FROM, 0), np.nextafter(SHORT_FROM, 1))
SMALL_M = 1e-18, 1e-9, 1e-3


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


def pendulums(seed, number):
    """Random pendulums with 1 − m on both sides of the border, next to it, next to 0 and next to 1."""
    rng = np.random.default_rng(seed)
    m1 = np.r_[BORDER, 1 - np.array(SMALL_M), rng.uniform(0, 1, number), 10 ** rng.uniform(-12, -1, number)]
    p, turn = 10 ** rng.uniform(0, 3, m1.size), rng.uniform(-1, 1, m1.size)
    m = np.r_[1 - m1[:3], SMALL_M, 1 - m1[6:]]
    half = np.sqrt(m) * turn
    lam = p * 2 * half * np.sqrt(1 - half**2) / (1 - 2 * half**2)
    lam, turn = np.where(half**2 < 0.45, lam, 0), np.where(half**2 < 0.45, turn, 0)
    kappa = 2 * np.sqrt(np.hypot(p, lam) * m * (1 - turn**2))
    return pendulum(p, kappa, lam, m1)


def parameter(q, i):
    """Parameter m of one pendulum as it is known best."""
    return mp.mpf(q.m[i]) if q.m[i] < 0.5 else 1 - mp.mpf(q.m1[i])


def test_nome_has_all_its_digits():
    m1 = np.r_[SHORT_FROM, np.linspace(0.04, 1, 50)[:-1]]
    m = np.r_[1 - m1, SMALL_M]
    exact = [mp.exp(-mp.pi * mp.ellipk(1 - mp.mpf(each)) / mp.ellipk(mp.mpf(each))) for each in m]
    assert np.allclose(nome(m, 1 - m), np.array(exact, float), rtol=4e-15, atol=0)
    assert exact[0] < 0.2


def test_series_leave_out_less_than_rounding():
    m1 = np.array([SHORT_FROM])
    own, q = series(1 - m1, m1), nome(1 - m1, m1)[0]
    for t in np.linspace(-1, 1, 9):
        z, w = mp.acos(t) / 2, t * t
        even, odd = sum(own.e[k][0] * w**k for k in range(3)), t * (own.o[0][0] + own.o[1][0] * w)
        assert abs(even + odd - mp.jtheta(3, z, q)) < 4e-16
        assert abs(even - odd - mp.jtheta(4, z, q)) < 4e-16


@pytest.mark.parametrize("seed", range(2))
def test_directions_against_mpmath(seed):
    q = pendulums(seed, 30)
    u = np.random.default_rng(seed).uniform(-3, 5, (7, q.m.size)) * q.K
    cos_psi, sin_psi = directions(q, u)
    for i in range(q.m.size):
        m = parameter(q, i)
        for j in range(len(u)):
            sin = mp.sqrt(m) * mp.ellipfun("sn", mp.mpf(u[j, i]), m)
            # The phase is known to its rounding only.
            tolerance = 4e-15 + 4e-16 * abs(u[j, i])
            if q.m1[i] < SHORT_FROM:
                # SciPy's functions are given m, which tells less of 1 − m the nearer it is to 1.
                tolerance += 1e-16 / np.sqrt(q.m1[i])
            assert abs(cos_psi[j, i] - (1 - 2 * sin**2)) < tolerance
            assert abs(sin_psi[j, i] - 2 * sin * mp.sqrt(1 - sin**2)) < tolerance * np.sqrt(q.m[i])


def test_directions_know_nothing_of_their_neighbours():
    q = pendulums(2, 30)
    u = np.random.default_rng(2).uniform(-3, 5, (7, q.m.size)) * q.K
    together = directions(q, u)
    turned = directions(Pendulum(*(field[:, None] for field in q)), u.T)
    alone = [directions(Pendulum(*(field[i] for field in q)), u[:, i]) for i in range(q.m.size)]
    for k in range(2):
        assert np.array_equal(together[k], turned[k].T)
        assert np.array_equal(together[k], np.stack([each[k] for each in alone], axis=1))
