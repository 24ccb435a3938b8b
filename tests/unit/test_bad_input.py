"""Input that makes no sense is refused, with a message that names it."""

import numpy as np
import pytest

import elastica
import studies
from elastica import Status
from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root

STUDY = {"study": {"name": "bad"}, "states": {"names": ["U"]}}


@pytest.mark.parametrize("call", [elastica.find_states, lambda **given: elastica.solve("U", **given)])
@pytest.mark.parametrize("given", [{}, {"P": 2.0, "shortening": 0.01}])
def test_load_and_shortening_both_or_neither(call, given):
    with pytest.raises(ValueError, match="either P or shortening"):
        call(H=0.1, **given)


@pytest.mark.parametrize("ends", ["-1/clamped", "clamped/-0.5", "nan/nan", "pinned/-1e-9"])
def test_negative_springs(ends):
    with pytest.raises(ValueError, match="k >= 0"):
        elastica.solve("U", P=2.0, H=0.1, ends=ends)


@pytest.mark.parametrize(
    "state", ["UX", "UaD", "U-D", "-U", "U-a", "aB1", "B1a", "0a", "UDD-", "aU-", "U" * 51]
)
def test_names_without_meaning(state):
    with pytest.raises(ValueError, match="state = "):
        elastica.solve(state, P=2.0, H=0.1)


@pytest.mark.parametrize("contacts", [11, -1, 2.0])
def test_too_many_contacts_to_enumerate(contacts):
    with pytest.raises(ValueError, match="max_contacts"):
        elastica.find_states(P=2.0, H=0.1, max_contacts=contacts)


def test_a_shortening_that_a_state_cannot_have():
    s = elastica.solve("U", shortening=[1e-6, 0.02, -1.0], H=0.05)
    assert s.status.tolist() == [Status.NO_EQUILIBRIUM, Status.SOLVED, Status.FAILED]
    assert list(s.reasons) == [2]


@pytest.mark.parametrize(
    ("ends", "remedy"),
    [
        ("1e13/pinned", "write clamped"),
        ("clamped/1e35", "write clamped"),
        ("1e300/pinned", "write clamped"),
        ("1e308/1e-308", "write clamped"),
        ("1e-13/0.3", "write pinned"),
        ("pinned/1e-320", "write pinned"),
    ],
)
def test_springs_beyond_what_numbers_can_tell(ends, remedy):
    for ask in (
        lambda: elastica.solve("aU", P=2.0, H=0.1, ends=ends),
        lambda: elastica.solve("aU", P=2.0, H=0.1, ends=ends, method="chain"),
        lambda: elastica.find_states(P=2.0, H=0.1, ends=ends),
        lambda: elastica.transitions("U", H=0.1, ends=ends),
        lambda: elastica.states(ends),
        lambda: studies.loading_path(ends, H=0.1, P=[0.5]),
        lambda: studies.Study.from_dict(STUDY | {"grid": {"ends": [ends], "H": [0.1], "P": [2.0]}}),
    ):
        with pytest.raises(ValueError, match=rf"{ends}.*a spring .*; {remedy}"):
            ask()


@pytest.mark.parametrize("name", ["0", "U", "aU", "UD", "B1"])
@pytest.mark.parametrize("other", ["pinned", "clamped", "0.3", "same"])
@pytest.mark.parametrize(("spring", "like"), [("1e12", "clamped"), ("1e-12", "pinned")])
def test_springs_at_the_bounds_are_as_good_as_clamps_and_pins(name, other, spring, like):
    given = {"P": [1.1] if name == "B1" else [1.2, 2.3, 5.0], "H": 0.1}
    ends, limit = (f"{side}/{side if other == 'same' else other}" for side in (spring, like))
    one, two = (elastica.solve(name, ends=e, **given) for e in (ends, limit))
    assert one.status.tolist() == two.status.tolist() and one.index.tolist() == two.index.tolist()
    assert one.energy == pytest.approx(two.energy, rel=1e-10, abs=1e-12, nan_ok=True)
    assert one.eigenvalues(2) == pytest.approx(two.eigenvalues(2), rel=1e-9, abs=1e-7, nan_ok=True)


def test_euler_loads_of_soft_and_stiff_springs_are_those_of_pins_and_clamps_far_up():
    modes = np.arange(1, 3000)
    for springs, like in (
        ("1e-12/pinned", "pinned-pinned"),
        ("3e-12/1e-11", "pinned-pinned"),
        ("1e12/clamped", "clamped-clamped"),
        ("1e-12/clamped", "pinned-clamped"),
        ("1e12/pinned", "clamped-pinned"),
        ("1e-12/1e12", "pinned-clamped"),
    ):
        roots = [euler_root(modes, parse_ends(ends)) for ends in (springs, like)]
        np.testing.assert_allclose(*roots, rtol=1e-10, err_msg=springs)


def test_numbers_too_small_to_be_told_from_nothing_fail_with_their_reason():
    for state in ("U", "B1", "U-"):
        tiny = elastica.solve(state, P=2.0, H=[1e-200, 1e-51, 1e-50, 1e-5])
        assert sorted(tiny.reasons) == [0, 1] and "from 1e-50 on" in tiny.reasons[0]
    assert tiny.status[3] == tiny.status[2]
    small = elastica.solve("B1", shortening=[0, 1e-300, 9e-12, 1e-11], H=0.1)
    assert sorted(small.reasons) == [1, 2] and "0 or at least 1e-11" in small.reasons[1]
    with pytest.raises(ValueError, match=r"H = .* half gaps from 1e-50"):
        elastica.transitions("U", H=1e-200)
    with pytest.raises(ValueError, match="H = 1e-200"):
        studies.loading_path(H=1e-200, P=[0.5])
    for grid, message in (
        ({"H": [1e-200], "P": [2.0]}, "from 1e-50 on"),
        ({"H": [0.1], "shortening": [0, 1e-12]}, "1e-12 is lost in the rounding"),
    ):
        with pytest.raises(ValueError, match=message):
            studies.Study.from_dict(STUDY | {"grid": {"ends": ["clamped-clamped"]} | grid})


@pytest.mark.parametrize("H", [1e-12, 1e-50])
@pytest.mark.parametrize(("name", "P"), [("U", 2.0), ("UD", 5.0), ("UU", 6.0), ("Ua", 3.0), ("U-", 6.5)])
def test_narrow_gaps_have_the_shape_of_small_deflections(name, P, H):
    narrow, wide = (elastica.solve(name, P=P, H=h) for h in (H, 1e-5))
    assert (narrow.status, narrow.index) == (wide.status, wide.index)
    assert narrow.energy / H / H == pytest.approx(float(wide.energy) * 1e10, rel=1e-7)
    assert narrow.reaction / H == pytest.approx(wide.reaction * 1e5, rel=1e-7)


@pytest.mark.parametrize(
    "given",
    [{"ends": "9" * 500}, {"ends": "9" * 300 + "/pinned"}, {"state": "x" * 500}, {"method": "x" * 500}],
)
def test_what_is_long_is_shown_in_part(given):
    with pytest.raises(ValueError, match=r"\.\.\.") as error:
        elastica.solve(**{"state": "U", "P": 1, "H": 0.1} | given)
    assert len(str(error.value)) < 400
