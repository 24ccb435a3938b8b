"""Quasi-static loading: where states are lost, where the strip goes from there, and the dataset of it."""

import numpy as np
import pytest
import xarray as xr
from brute_force.chain import minimise

import elastica
import studies
from elastica.control import LOAD, SHORTENING
from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root
from elastica.paths.curve import curve_through
from elastica.paths.quasistatic import CHAINS, Loading
from elastica.paths.stretch import stretch_of
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from studies import StudyError, loading_path

pytestmark = pytest.mark.long

CC, PP = "clamped-clamped", "pinned-pinned"
UP = np.array([0.0, 0.002, 0.0061, 0.0064, 0.007, 0.0075, 0.0076, 0.009, 0.02, 0.0265])
SHORTENINGS = np.concatenate([UP, [0.02, 0.009, 0.00745, 0.0074, 0.00738, 0.007, 0.0]])


@pytest.fixture(scope="module")
def shortened():
    return loading_path(CC, 0.05, shortening=SHORTENINGS)


@pytest.fixture(scope="module")
def loaded():
    return loading_path(CC, 0.05, P=[0.0, 0.9, 1.002, 2.0, 3.9, 4.0, 6.0, 2.1, 2.0, 0.5])


def words(path):
    return path["state"].values.tolist()


def jumps(path):
    return dict(
        zip(np.flatnonzero(path["jump"]).tolist(), path["event_control"].values[path["jump"]], strict=True)
    )


def test_loop_at_prescribed_shortening(shortened):
    rising = ["0", "B1", "B1", "U", "U", "U", "Ua", "Ua", "Ua", "UD"]
    assert words(shortened) == [*rising, "Ua", "Ua", "Ua", "Ua", "U", "U", "0"]
    at = jumps(shortened)
    assert list(at) == [6, 14]
    assert at[6] == pytest.approx(0.00754507562, rel=1e-8)
    assert at[14] == pytest.approx(0.007386777, abs=1e-9)
    touched = elastica.solve("U", P=1.003107058816, H=0.05).shortening
    assert shortened["event_control"][3] == pytest.approx(float(touched), rel=1e-9)
    assert shortened["P"].values[[0, -1]].tolist() == [1.0, 1.0]
    assert set(shortened["other_state"].values) == {""}


def test_small_deflections():
    H = 0.002
    path = loading_path(CC, H, shortening=H**2 * np.array([2.999, 3.0001, 2.939, 2.937]))
    assert words(path) == ["U", "Ua", "Ua", "U"]
    at = jumps(path)
    assert at[1] / H**2 == pytest.approx(3, rel=5e-5)
    assert at[3] / H**2 == pytest.approx(2.937848, rel=5e-5)
    assert path["P"][1] == pytest.approx(3.355451, abs=5e-4)


def test_arcs_end_where_theory_says():
    ua = stretch_of(curve_through(elastica.solve("Ua", P=3.0, H=0.05), SHORTENING))
    assert ua.end(True).P == pytest.approx(2.066078, abs=1e-6)
    assert ua.end(False).P == pytest.approx(3.65445, abs=5e-6)
    assert ua.low == pytest.approx(0.007386777, abs=1e-9)
    assert stretch_of(curve_through(elastica.solve("Ua", P=3.0, H=0.05), LOAD)) is None
    u = stretch_of(curve_through(elastica.solve("U", P=3.0, H=0.1), LOAD))
    assert (u.low, u.high) == pytest.approx((1.0127127055026, 3.9378211842362), rel=1e-11)
    flat = stretch_of(curve_through(elastica.solve("U-", P=2.0, H=0.05, ends=PP), LOAD))
    assert flat.high == pytest.approx(3.9685924505, rel=1e-10)


def test_loop_under_load(loaded):
    assert words(loaded) == ["0", "0", "B1", "U", "U", "UD", "UD", "UD", "U", "0"]
    at = jumps(loaded)
    assert list(at) == [5, 8]
    assert at[5] == pytest.approx(3.984869364316, rel=1e-11)
    assert at[8] == pytest.approx(2.066078, abs=1e-6)
    assert loaded["event_control"][2] == 1.0
    assert (np.diff(loaded["energy"])[4] < 0) and loaded["shortening"][5] > 3 * loaded["shortening"][4]


@pytest.mark.parametrize("name", ["shortened", "loaded"])
def test_every_row_is_a_state_that_solve_finds(name, request):
    path = request.getfixturevalue(name)
    for word, P, shortening, energy, bending in zip(
        *(path[n].values for n in ("state", "P", "shortening", "energy", "bending_energy")), strict=True
    ):
        if word != "0":
            s = elastica.solve(word, P=P, H=0.05)
            assert (s.shortening, s.energy, s.bending_energy) == pytest.approx(
                (shortening, energy, bending), rel=1e-6
            )


def test_a_chain_that_is_minimised_along_the_path_jumps_with_the_strip(shortened):
    n, rng = 200, np.random.default_rng(3)
    theta = 0.05 * np.sin(2 * np.pi * (np.arange(n) + 0.5) / n)
    for step in range(1, SHORTENINGS.size - 1):
        nudged = theta * (1 + 0.01 * rng.normal()) + 2e-4 * rng.normal() * np.cos(np.pi * np.arange(n) / n)
        found = minimise(nudged, None, 0.05, CC, shorter=SHORTENINGS[step])
        theta = found.theta
        assert found.success
        assert found.energy == pytest.approx(float(shortened["bending_energy"][step]), rel=4e-3), step


def test_a_flat_stretch_between_pins_buckles_under_load():
    path = loading_path(PP, 0.1, P=[0.2, 0.5, 2.0, 3.8, 3.9, 3.0])
    assert words(path) == ["0", "U", "U-", "U-", "UDU", "UDU"]
    assert jumps(path) == {4: pytest.approx(3.8506274993, rel=1e-10)}


def test_what_cannot_be_followed_is_said():
    path = loading_path(CC, 0.1, P=[6.0, 7.0, 6.0])
    assert words(path) == ["UD", "?", "?"]
    assert np.isnan(path["energy"][1:]).all() and path["P"].values.tolist() == [6.0, 7.0, 6.0]
    assert path.attrs["stopped"].startswith("UD is lost at P = 6.9615617")
    assert "degrees" in path.attrs["stopped"]


@pytest.mark.parametrize(
    ("ends", "H", "states"),
    [
        ("16/pinned", 0.02, ["0", "B1", "0"]),
        ("pinned/16", 0.02, ["0", "B1", "0"]),
        ("1e-6/1e8", 0.02, ["0", "B1", "0"]),
        ("0.3/2.5", 0.02, ["0", "B1", "0"]),
        ("16/pinned", 1e-6, ["0", "U-", "0"]),
    ],
)
def test_every_strip_buckles_and_comes_back(ends, H, states):
    path = loading_path(ends, H, shortening=[0, {0.02: 1.25, 1e-6: 3.5}[H] * H**2, 0])
    assert words(path) == states
    assert not path["jump"].any() and "stopped" not in path.attrs


@pytest.mark.parametrize("H", [1e-3, 1e-6])
def test_narrow_gaps_have_the_jumps_of_small_deflections(H):
    """To and from the asymmetric state; under load at such gaps the strip touches the wall as it buckles."""
    path = loading_path(CC, H, shortening=H**2 * np.array([1, 2.999, 3.001, 2.938, 2.937, 1, 0]))
    assert words(path) == ["B1", "U", "Ua", "Ua", "U", "B1", "0"]
    assert [at / H**2 for at in jumps(path).values()] == pytest.approx([3, 2.937848], rel=1e-5)
    for ends in (CC, "16/pinned"):
        assert words(loading_path(ends, H, P=[0, 2, 0.3])) == ["0", "U", "0"]


def test_a_chain_that_rests_on_a_line_has_landed_there():
    path = loading_path(PP, 0.04, shortening=[0.02, 0.0097, 0.0096, 0.001])
    assert words(path) == ["UU", "UU", "U-", "B1"]
    assert jumps(path)[2] == pytest.approx(0.00967343484, rel=1e-8)
    assert float(elastica.solve("U-", P=path["P"][2], H=0.04, ends=PP).shortening) == pytest.approx(0.0096)


def test_where_a_chain_lands_is_traced_back_to_where_the_state_was_lost():
    """Ua is lost at 0.0181085; there is the line, which passes into the point at 0.0180117."""
    ends = parse_ends("0.3/2.5")
    loading = Loading(Scene(ends, np.array([0.08])), SHORTENING)
    lost = loading.through(elastica.solve("Ua", shortening=0.03, H=0.08, ends=ends))
    event = loading.passage(lost, False)
    assert (event.stretch.state.name, event.jump) == ("U-", True)
    assert (event.value, event.stretch.low) == pytest.approx((0.0181085304, 0.0180117), rel=1e-5)
    assert loading.passage(event.stretch, False).stretch.state.name == "U"


def test_where_following_ends_is_not_where_a_state_ends():
    """The steep UD goes on to at least 0.418, as a minimiser shows, but it is not followed beyond 106°."""
    path = loading_path(CC, 0.143, shortening=[0.0, 0.3, 0.33, 0.34, 0.4, 0.33, 0.1, 0.4])
    assert words(path) == ["0", "UD", "UD", "UD?", "UD?", "?", "?", "?"]
    assert path.attrs["stopped"].startswith("UD goes on beyond shortening = 0.3324")
    assert "lost" not in path.attrs["stopped"] and "106 degrees" in path.attrs["stopped"]
    assert np.isnan(path["energy"][3:]).all() and (path["stability"][3:] == -1).all()
    n = 200
    theta = elastica.solve("UD", P=path["P"][2], H=0.143).shape(2 * n + 1).theta[1::2]
    for shortening in np.linspace(0.33, 0.4, 6):
        found = minimise(theta, None, 0.143, CC, shorter=shortening)
        assert found.success and np.abs(found.theta - theta).max() < 0.2
        theta = found.theta


@pytest.mark.parametrize(
    ("shortening", "states", "jump"),
    [([0.4], ["UD?"], [False]), ([0.0, 0.4, 0.1], ["0", "UD?", "?"], [False, True, False])],
)
def test_where_following_ends_on_the_way_the_state_is_the_one_at_its_end(shortening, states, jump):
    """Straight at the step before, or with no step before, the strip is UD when it is followed no more."""
    path = loading_path(CC, 0.143, shortening=shortening)
    assert (words(path), path["jump"].values.tolist()) == (states, jump)
    assert path.attrs["stopped"].startswith("UD goes on beyond shortening = 0.3324")


def test_chains_that_disagree_are_named():
    loading = Loading(Scene(parse_ends(CC), np.array([0.05])), LOAD)
    arc = loading.through(elastica.solve("UD", P=8.0, H=0.05))
    first = loading.passage(arc, True)
    assert first.jump and loading.other_state(arc, True) not in ("", first.stretch.state.name)
    assert len({links for links, _ in CHAINS}) == 2


def test_the_dataset_survives_a_file(shortened, tmp_path):
    shortened.to_netcdf(tmp_path / "path.nc")
    with xr.open_dataset(tmp_path / "path.nc") as back:
        assert back["jump"].dtype == bool and back["stability"].dtype == np.int8
        assert back["P"].attrs["long_name"] == "thrust"
        assert back.attrs["control"] == "shortening" and back.attrs["ends"] == CC
        xr.testing.assert_equal(back.load(), shortened)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"H": 0.1}, "either P or shortening"),
        ({"H": 0.1, "P": [1], "shortening": [0.1]}, "either P or shortening"),
        ({"H": 0.6, "P": [1]}, "H = 0.6"),
        ({"P": [1]}, "H = None"),
        ({"H": 0.1, "P": [1, np.nan]}, "P = nan at step 1"),
        ({"H": 0.1, "shortening": [-0.1]}, "shortening = -0.1 at step 0"),
        ({"H": 0.1, "P": 1.0}, "P has the shape"),
        ({"H": 0.1, "P": ["much"]}, "P = 'much' is text"),
        ({"ends": "free-free", "H": 0.1, "P": [1]}, "free-free"),
    ],
)
def test_bad_input_is_one_sentence(arguments, message):
    with pytest.raises(StudyError, match=message):
        studies.loading_path(**arguments)


def test_a_strip_between_springs_passes_from_state_to_state():
    path = loading_path("0.3/2.5", H=0.1, P=[0.5, 2.0, 0.5])
    assert path["state"].values.tolist() == ["0", "U", "0"]
    euler = float(euler_root(1, parse_ends("0.3/2.5"))) ** 2 / FOUR_PI_SQUARED
    assert path["event_control"].values[2] == pytest.approx(euler, rel=1e-9)
    assert not path["jump"].any()


@pytest.mark.parametrize("H", [0.003, 0.03])
def test_at_narrow_gaps_too_the_buckled_strip_comes_to_the_wall_without_a_jump(H):
    path = loading_path(CC, H, P=[0.9, 1.000002, 2.0, 0.9])
    assert words(path) == ["0", "B1", "U", "0"]
    assert not path["jump"].any()


def test_random_loops_agree_with_a_minimiser():
    """Every row has the energy of a chain that is minimised from the row before."""
    n, compared = 120, 0
    for seed in (100, 101):
        rng = np.random.default_rng(seed)
        ends = [CC, PP, "clamped-pinned", "pinned-clamped", "0.05/0.05"][rng.integers(5)]
        H = float(np.exp(rng.uniform(np.log(0.01), np.log(0.25))))
        up = np.linspace(0, rng.uniform(2, min(14, 0.2 / H**2)) * H**2, 9)
        given = np.concatenate([up, up[-2::-1]])
        path = loading_path(ends, H, shortening=given)
        theta = 0.1 * H * np.cos(np.pi * np.arange(n) / n)
        for step in range(1, given.size - 1):
            if words(path)[step].endswith("?"):
                break
            nudge = 0.02 * H * rng.normal() * np.cos(np.pi * np.arange(n) / n)
            found = minimise(theta * (1 + 0.01 * rng.normal()) + nudge, None, H, ends, shorter=given[step])
            theta = found.theta
            assert found.energy == pytest.approx(float(path["bending_energy"][step]), rel=0.03), (seed, step)
            compared += 1
    assert compared > 20
