"""Eigenvalues and frequencies by segments beside those of the whole strip in one matrix."""

import numpy as np
import pytest
from scipy.linalg import eigvalsh

import elastica
from elastica.control import LOAD, SHORTENING
from elastica.stability import dense, spectrum, vibration
from elastica.stability.elements import batches

CC, PP = "clamped-clamped", "pinned-pinned"


def _solve(name, ends, P):
    return elastica.solve(name, P=P, H=0.05, ends=ends)


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
