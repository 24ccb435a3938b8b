"""Chains of 10² to 10⁵ links beside Euler loads and transitions: right, or critical where in doubt."""

import warnings

import numpy as np
import pytest
from mpmath import mp, mpf
from references.onsets import loads

import elastica
from elastica import Stability, Status

CC, CP, PP = "clamped-clamped", "clamped-pinned", "pinned-pinned"
DISTANCES = [1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12]


def beside(load):
    """Doubles below and above a load."""
    return np.array([float(load * (1 + side * mpf(d))) for d in DISTANCES for side in (-1, 1)])


@pytest.mark.parametrize(
    ("ends", "clamp", "first"),
    [
        (CC, "consistent", lambda n: mp.pi / n),
        (CC, "published", lambda n: mp.pi / (n - 1)),
        (PP, "consistent", lambda n: mp.pi / (2 * n)),
    ],
)
def test_the_straight_chain_beside_its_own_euler_load(ends, clamp, first, full):
    """(n/π)² sin², in closed form; within the tolerance of its links a chain says `critical`."""
    for n in (100, 101, 1000, 10_000, *((100_000,) if full else ())):
        with mp.workdps(50):
            P = beside((n / mp.pi) ** 2 * mp.sin(first(n)) ** 2)
        s = elastica.solve("0", P=P, H=0.1, ends=ends, method="chain", links=n, clamp=clamp)
        decided = s.stability != Stability.CRITICAL
        assert (s.index[decided] == np.tile([0, 1], len(DISTANCES))[decided]).all()
        far = np.repeat(DISTANCES, 2) > (10 / n if clamp == "published" else 10 / n**2 + 1e-15 * n**2)
        assert decided[far].all()


@pytest.mark.parametrize("ends", [CC, CP, PP])
@pytest.mark.parametrize("clamp", ["consistent", "published"])
@pytest.mark.filterwarnings("ignore:links = ")
def test_the_flat_stretch_of_a_chain_beside_its_buckling(ends, clamp):
    """Index that of the strip, or with one more zero than the strip has: about to change."""
    for H, n in ((0.01, 100), (0.1, 101), (0.1, 1000)):
        P = beside(loads("flat_buckles", H, ends))
        exact, chain = (
            elastica.solve("U-", P=P, H=H, ends=ends, **method)
            for method in ({}, {"method": "chain", "links": n, "clamp": clamp})
        )
        certain = chain.nullity <= exact.nullity.min()
        assert (chain.index[certain] == exact.index[certain]).all()
        assert certain[:2].all() or n < 1000 or clamp == "published"


@pytest.mark.parametrize(
    ("state", "P", "ends"),
    [("U", 2.5, CC), ("Ua", 3.0, CC), ("UD", 4.5, CC), ("U-", 5.0, CC), ("U", 0.5, PP)],
)
def test_many_links(state, P, ends, full):
    """Error of second order up to 10⁴ links, at 10⁵ with what rounding adds; the verdict of the strip."""
    exact = elastica.solve(state, P=P, H=0.1, ends=ends)
    energies = []
    for n in (100, 1000, 10_000, *((100_000,) if full else ())):
        chain = elastica.solve(state, P=P, H=0.1, ends=ends, method="chain", links=n)
        assert (chain.status, chain.stability, chain.index) == (exact.status, exact.stability, exact.index)
        energies.append(float(chain.energy - exact.energy) * n * n)
        assert chain.error < 30 / n**2
    assert energies == pytest.approx([energies[1]] * len(energies), rel=0.06)


def test_a_chain_in_the_transition_has_the_point_or_the_line():
    """Its own load differs from the strip's by O(h²): one of the two states exists, and only there both."""
    load = float(loads("point_to_line", 0.1))
    P = beside(load)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for n in (100, 1000):
            point, line = (
                elastica.solve(name, P=P, H=0.1, method="chain", links=n).status == Status.SOLVED
                for name in ("U", "U-")
            )
            assert (point | line)[np.abs(P / load - 1) > 20 / n**2].all()
