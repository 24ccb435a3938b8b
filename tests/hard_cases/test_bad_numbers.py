"""NaN, inf, zero, negative and huge numbers: such points fail with a reason, the others go on."""

import math

import numpy as np
import pytest

import elastica
from elastica import Status

GOOD = {"P": 2.5, "shortening": 0.02, "H": 0.1}
BAD = {
    "P": (math.nan, math.inf, -math.inf, -1.0, -1e-300, 1.0000001e6, 1e308),
    "shortening": (math.nan, math.inf, -math.inf, -1e-9, 2.0000001, 1e308),
    "H": (math.nan, math.inf, -math.inf, 0.0, -0.0, -0.1),
}
CHAIN = {"method": "chain", "links": 40}


@pytest.mark.parametrize(
    ("state", "name", "control"),
    [
        *((state, "P", "P") for state in ("0", "B1", "B2", "U", "Ua", "U-", "UD", "UU:2", "UDU-")),
        *((state, "H", "P") for state in ("0", "B1", "B2", "U", "Ua", "U-", "UD", "UU:2", "UDU-")),
        *((state, "shortening", "shortening") for state in ("0", "B1", "U", "U-")),
        ("U", "H", "shortening"),
    ],
)
def test_a_bad_number_spoils_its_point_only(state, name, control):
    good = {key: GOOD[key] for key in (control, "H")}
    alone = elastica.solve(state, **good)
    mixed = elastica.solve(state, **good | {name: [GOOD[name], *BAD[name], GOOD[name]]})
    last = len(BAD[name]) + 1
    assert set(mixed.reasons) == set(range(1, last))
    assert (mixed.status[1:last] == Status.FAILED).all()
    for point, value in enumerate(BAD[name], 1):
        assert mixed.reasons[point].startswith(f"{name} = {value:g} is not possible; give ")
    for here in (0, last):
        assert mixed.status[here] == alone.status
        assert np.array_equal(mixed.energy[here], alone.energy, equal_nan=True)
    assert np.isnan(mixed.energy[1:last]).all() and (mixed.index[1:last] == -1).all()
    assert np.isnan(mixed.eigenvalues(2)[1:last]).all() and np.isnan(mixed.shape(5).y[1:last]).all()


@pytest.mark.parametrize("name", ["P", "H"])
def test_so_it_does_in_a_chain(name):
    values = [GOOD[name], *BAD[name], GOOD[name]]
    s = elastica.solve("U", **{key: GOOD[key] for key in ("P", "H")} | {name: values}, **CHAIN)
    assert set(s.reasons) == set(range(1, len(values) - 1))
    assert s.status[0] == s.status[-1] == Status.SOLVED and s.energy[0] == s.energy[-1]


@pytest.mark.parametrize("state", ["0", "B1", "U", "Ua", "U-", "UD"])
@pytest.mark.parametrize("ends", ["clamped-clamped", "clamped-pinned", "1e-12/1e12"])
def test_extreme_but_possible_numbers_are_answered(state, ends):
    P, H = np.meshgrid([0.0, 5e-324, 1e-300, 1e-12, 1.0, 1e6], [5e-324, 1e-300, 1e-12, 0.1, 1e12, 1e308])
    s = elastica.solve(state, P=P, H=H, ends=ends)
    failed = s.status == Status.FAILED
    assert set(s.reasons) == set(np.flatnonzero(failed.ravel()))
    solved = s.status == Status.SOLVED
    assert np.isfinite(s.energy[solved]).all() and np.isfinite(s.error[solved]).all()
    assert (s.index[solved] >= 0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"P": "two"}, "P = 'two' is text"),
        ({"P": [1.0, 2.0], "H": [0.1, 0.2, 0.3]}, r"P \(2,\) and H \(3,\) do not broadcast"),
        ({"P": 1j}, "complex"),
        ({"P": None}, "give either P or shortening"),
        ({"H": None}, "H is missing"),
        ({"ends": "-1/2"}, "k >= 0"),
        ({"ends": 3}, "ends = 3"),
        ({"ends": ""}, "ends = ''"),
        ({"state": None}, "state = None"),
        ({"state": ""}, "state = ''"),
        ({"state": "U:0"}, "state = 'U:0'"),
        ({"links": math.nan, "method": "chain"}, "links = nan"),
        ({"links": -5, "method": "chain"}, "links = -5"),
        ({"stiffness": math.inf, "method": "chain"}, "inf"),
    ],
)
def test_a_configuration_without_meaning_is_refused_with_a_sentence(arguments, message):
    given = {"state": "U", "P": 2.5, "H": 0.1} | arguments
    with pytest.raises(ValueError, match=message):
        elastica.solve(given.pop("state"), **given)
