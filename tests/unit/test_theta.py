"""Jacobi's functions by theta series, and the strip's direction from them, against 60 digits."""

import mpmath as mp
import numpy as np
import pytest

from elastica.pendulum.elliptic import integrals
from elastica.pendulum.segments import Pendulum, pendulum
from elastica.pendulum.swing import directions
from elastica.pendulum.theta import SHORT_FROM, nome, series, values

BORDER = SHORT_FROM, np.nextafter(SHORT_FROM, 0), np.nextafter(SHORT_FROM, 1)
SMALL = 1e-30, 1e-18, 1e-9, 1e-3
PHASES = 8


@pytest.fixture(autouse=True)
def sixty_digits():
    with mp.workdps(60):
        yield


def parameters(seed):
    """Pairs m, 1 − m, at the border of the two kinds of series, next to 0, next to 1, and at random."""
    rng = np.random.default_rng(seed)
    m1 = np.r_[BORDER, SMALL, rng.uniform(0, 1, 15), 10 ** rng.uniform(-12, -1, 10)]
    return np.r_[1 - m1, SMALL], np.r_[m1, 1 - np.array(SMALL)]


def exact_parameter(m, m1):
    """The m that both numbers tell, the smaller of which has more digits."""
    return mp.mpf(m) if m < m1 else 1 - mp.mpf(m1)


def exact(u, m):
    """√m sn, dn, √m cn and E(u|m) with all digits."""
    K, u = mp.ellipk(m), mp.mpf(u)
    turns = mp.nint(u / (2 * K))
    sn, cn, dn = (mp.ellipfun(name, u - 2 * turns * K, m) for name in ("sn", "cn", "dn"))
    sign = (-1) ** int(turns)
    E = 2 * turns * mp.ellipe(m) + mp.ellipe(mp.atan2(sn, cn), m)
    return sign * mp.sqrt(m) * sn, dn, sign * mp.sqrt(m) * cn, E


def tolerance_at(u):
    """The phase is known to a few of its roundings, and the angle changes at most twice as fast as it."""
    return 4e-15 + 8 * np.finfo(float).eps / 2 * np.abs(u)


def test_nome_has_all_its_digits():
    m1 = np.linspace(SHORT_FROM, 1, 50)[:-1]
    m = np.r_[1 - m1, SMALL]
    wanted = [mp.exp(-mp.pi * mp.ellipk(1 - mp.mpf(each)) / mp.ellipk(mp.mpf(each))) for each in m]
    assert np.allclose(nome(m, 1 - m), np.array(wanted, float), rtol=4e-15, atol=0)
    assert wanted[0] < 0.2


@pytest.mark.parametrize("seed", range(2))
def test_functions_against_mpmath(seed):
    m, m1 = parameters(seed)
    K, DK, *_ = integrals(m1, np.zeros_like(m), np.ones_like(m))
    u = np.random.default_rng(seed).uniform(-7, 7, (PHASES, m.size)) * K
    own = series(m, m1, K, DK)
    sine, level, bend, zeta = values(own, own.rate * u)
    found = 2 * np.arctan2(sine, level), own.bend * bend, own.steady * u + own.rate * zeta
    tolerance = tolerance_at(u)
    for i in range(m.size):
        for j in range(PHASES):
            sn, dn, cn, E = exact(u[j, i], exact_parameter(m[i], m1[i]))
            sizes = np.sqrt(m[i]), np.sqrt(m[i]), 1
            for got, wanted, size in zip(found, (2 * mp.atan2(sn, dn), cn, E), sizes, strict=True):
                assert abs(got[j, i] - wanted) < tolerance[j, i] * size


def some_pendulums(seed):
    """Pendulums with such parameters that pass θ = 0 anywhere in their swing."""
    m, m1 = parameters(seed)
    rng = np.random.default_rng(seed)
    p = 10 ** rng.uniform(0, 3, m.size)
    half = np.sqrt(np.minimum(m, 0.45)) * rng.uniform(-1, 1, m.size)
    lam = p * np.tan(2 * np.arcsin(half))
    return pendulum(p, 2 * np.sqrt(np.hypot(p, lam) * (m - half**2)), lam, m1)


def test_directions_against_mpmath():
    q = some_pendulums(2)
    u = np.random.default_rng(2).uniform(-3, 5, (PHASES, q.m.size)) * q.K
    cos_psi, sin_psi = directions(q, u)
    tolerance = tolerance_at(u)
    for i in range(q.m.size):
        for j in range(PHASES):
            sn, dn, *_ = exact(u[j, i], exact_parameter(q.m[i], q.m1[i]))
            assert abs(cos_psi[j, i] - (1 - 2 * sn**2)) < tolerance[j, i]
            assert abs(sin_psi[j, i] - 2 * sn * dn) < tolerance[j, i] * np.sqrt(q.m[i])


def test_directions_know_nothing_of_their_neighbours():
    q = some_pendulums(3)
    u = np.random.default_rng(3).uniform(-3, 5, (PHASES, q.m.size)) * q.K
    together = directions(q, u)
    turned = directions(Pendulum(*(field[:, None] for field in q)), u.T)
    alone = [directions(Pendulum(*(field[i] for field in q)), u[:, i]) for i in range(q.m.size)]
    for k in range(2):
        assert np.array_equal(together[k], turned[k].T)
        assert np.array_equal(together[k], np.stack([each[k] for each in alone], axis=1))
