import numpy as np
import pytest

import elastica
from elastica.ends import CLAMPED, PINNED, parse_ends
from elastica.equilibria.euler import euler_modes_below, euler_root
from elastica.state import is_canonical, parse_state

CC, CP, PP = "clamped-clamped", "clamped-pinned", "pinned-pinned"


@pytest.mark.parametrize(
    ("name", "ends", "canonical"),
    [
        ("aU", CC, "Ua"),
        ("aU", CP, "aU"),
        ("D", CC, "U"),
        ("Da-", CP, "Ua-"),
        ("aU-", PP, "Ua-"),
        ("Ua:2", CC, "Ua:2"),
        ("B12", CC, "B12"),
        ("0", PP, "0"),
        ("UDD", CC, "UUD"),
        ("UDD", CP, "UDD"),
        ("DUa", CC, "UDa"),
        ("aDU", CC, "UDa"),
        ("UD-", CC, "UD-"),
    ],
)
def test_canonical_name(name, ends, canonical):
    assert parse_state(name, ends).name == canonical
    assert is_canonical(name, ends) == (name == canonical)


@pytest.mark.parametrize(
    "name",
    [
        "",
        "X",
        "B0",
        "B",
        "Ub",
        "u",
        "0-",
        "B1-",
        "U--",
        "aa",
        "UU-",
        "UDUU-",
        "U" * 51,
        "U:0",
        "-U",
        "U ",
        None,
        3,
        "Ua-",
    ],
)
def test_names_without_meaning_are_refused(name):
    with pytest.raises(ValueError, match="state = "):
        parse_state(name, CC)


@pytest.mark.parametrize("ends", ["", "clamped", "clamped-free", "clamped-clamped-clamped", None, 3])
def test_unknown_ends_are_refused_with_what_is_allowed(ends):
    with pytest.raises(ValueError, match="each side clamped, pinned or a spring"):
        parse_ends(ends)


def test_ends_are_read_with_dash_or_slash():
    assert parse_ends("clamped/pinned") == parse_ends("clamped-pinned") == (CLAMPED, PINNED)


def test_enumeration():
    assert elastica.states(CC, 1) == ["0", "B1", "B2", "U", "Ua", "aUa", "U-"]
    assert elastica.states(CP, 1) == ["0", "B1", "B2", "U", "Ua", "aU", "aUa", "U-", "Ua-"]
    assert elastica.states(PP, 1) == ["0", "B1", "B2", "U", "Ua", "aUa", "U-", "Ua-", "aUa-"]
    assert elastica.states(CC, 0) == ["0", "B1"]
    two = elastica.states(CC, 2)
    assert two[:4] == ["0", "B1", "B2", "B3"]
    assert two[8:] == ["UU", "UUa", "aUUa", "UD", "UDa", "aUDa", "UD-"]
    for bad in (-1, 11, True, 1.0, "1"):
        with pytest.raises(ValueError, match="max_contacts"):
            elastica.states(CC, bad)


def test_euler_loads():
    loads = euler_root(np.arange(1, 7), parse_ends(CC)) ** 2 / (4 * np.pi**2)
    expected = [1, 2.0457485159383, 4, 6.04679919465894, 9, 12.0470754785777]
    assert loads == pytest.approx(expected, rel=1e-13)
    assert euler_root(np.arange(1, 4), parse_ends(PP)) == pytest.approx(np.pi * np.arange(1, 4))
    r = euler_root(np.arange(1, 30), parse_ends(CP))
    assert np.tan(r) == pytest.approx(r, rel=1e-9)


@pytest.mark.parametrize("ends", [CC, CP, PP])
def test_modes_below_a_load_are_counted_on_both_sides_of_it(ends):
    ends = parse_ends(ends)
    thrust = euler_root(np.arange(1, 200), ends) ** 2
    assert np.array_equal(euler_modes_below(thrust * (1 - 1e-13), ends), np.arange(0, 199))
    assert np.array_equal(euler_modes_below(thrust * (1 + 1e-13), ends), np.arange(1, 200))
