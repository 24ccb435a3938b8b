"""Numbers of users: what is no plain number is understood or refused, wherever numbers are asked for."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr

import elastica
import studies
from elastica.labelled import LabelledSolution

UNITS = pint.UnitRegistry()
STRIP = elastica.Strip(length=0.3, width=0.025, thickness=0.001, E=200e9, density=7850)


class InNewtons(np.ndarray):
    """As quantities of astropy and unyt: an array with a unit that NumPy drops."""

    unit = "N"


REFUSED = {
    "quantity": (2.5 * UNITS.newton, "in newton"),
    "quantities": (np.array([2.5, 3.0]) * UNITS.kN, "in kilonewton"),
    "list of quantities": ([2.5 * UNITS.newton, 3.0], "in newton"),
    "array with a unit": (np.array([2.5, 3.0]).view(InNewtons), "in N;"),
    "physical DataArray": (xr.DataArray([250.0], dims="x", attrs={"units": "N"}), "in N;"),
    "quantity in a DataArray": (xr.DataArray(np.array([2.5]) * UNITS.newton, dims="x"), "in newton"),
    "masked": (np.ma.masked_array([2.5, 3.0], [False, True]), "masked; .*filled"),
    "masked element": ([2.5, np.ma.masked], "masked"),
    "Series": (pd.Series([2.5, 3.0], [1, 0]), "labelled; .*to_numpy.*to_xarray"),
    "DataFrame": (pd.DataFrame({"P": [2.5]}), "labelled"),
    "Dataset": (xr.Dataset({"P": 2.5}), "a Dataset"),
    "list of DataArrays": ([xr.DataArray([2.5, 3.0], dims="x")], "a list of labelled arrays"),
    "bool": (True, "a truth value"),
    "bool among numbers": ([2.5, True], "a truth value"),
    "array of bool": (np.array([True, False]), "a truth value"),
    "complex": (2.5 + 1j, "complex"),
    "array of complex": (np.array([2.5 + 0j]), "complex"),
    "text": ("2.5", "text"),
    "list of text": (["2.5", "3"], "text"),
    "bytes": (b"2.5", "text"),
    "date": (np.datetime64("2026-01-01"), "a date"),
    "duration": (np.array([3], "m8[D]"), "a date or a duration"),
    "dates of pandas": (pd.date_range("2026", periods=2), "a date"),
    "nothing": ([2.5, None], "of the type NoneType"),
    "object": (object(), "of the type object"),
    "object in an array": (np.array([2.5, "3"], object), "text"),
    "set": ({2.5}, "of the type set"),
    "dict": ({"P": 2.5}, "of the type dict"),
    "ragged": ([[2.5, 3.0], [4.0]], "no array of numbers"),
    "too large": ([10**400], "beyond the range"),
    "records": (np.zeros(2, [("P", float)]), "of the type ndarray"),
}
ASKS = {
    "P": lambda x: elastica.solve("U", P=x, H=0.1),
    "H": lambda x: elastica.solve("U", P=2.5, H=x),
    "shortening": lambda x: elastica.solve("U", shortening=x, H=0.1),
    "P of a chain": lambda x: elastica.solve("U", P=x, H=0.1, method="chain", links=20),
    "stiffness": lambda x: elastica.solve("U", P=2.5, H=0.1, method="chain", links=20, stiffness=x),
    "P of states": lambda x: elastica.find_states(P=x, H=0.1, max_contacts=0),
    "H of transitions": lambda x: elastica.transitions("0", H=x),
    "P_max": lambda x: elastica.transitions("0", H=0.1, P_max=x),
    "P of a path": lambda x: studies.loading_path(H=0.1, P=x),
    "H of a path": lambda x: studies.loading_path(H=x, P=[0.5]),
}
PHYSICAL = {
    "length": lambda x: elastica.Strip(length=x, width=0.025, thickness=0.001, E=200e9),
    "gap": lambda x: STRIP.to_dimensionless(gap=x),
    "force": lambda x: STRIP.to_dimensionless(force=x),
}


@pytest.mark.parametrize("ask", ASKS)
@pytest.mark.parametrize("kind", REFUSED)
def test_what_numpy_would_strip_is_refused_by_name(kind, ask):
    value, message = REFUSED[kind]
    with pytest.raises(ValueError, match=rf"^{ask.split()[0]} = .* is {message}") as refusal:
        ASKS[ask](value)
    assert "give dimensionless numbers" in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize("ask", PHYSICAL)
@pytest.mark.parametrize(
    "kind", ["masked", "Series", "bool", "complex", "text", "date", "physical DataArray"]
)
def test_physical_numbers_too(kind, ask):
    if (ask, kind) == ("force", "physical DataArray"):
        assert STRIP.to_dimensionless(force=REFUSED[kind][0])["P"].item() == 250 / STRIP.scales["force"]
        return
    with pytest.raises(ValueError, match=rf"^{ask} = .* is {REFUSED[kind][1]}|in N; give numbers in m"):
        PHYSICAL[ask](REFUSED[kind][0])


@pytest.mark.parametrize(
    "value",
    [
        np.float32(2.5),
        Decimal("2.5"),
        Fraction(5, 2),
        [Fraction(5, 2)],
        250 * UNITS.percent,
        [2.5 * UNITS.dimensionless],
        pd.Index([2.5]),
        memoryview(np.array([2.5])),
        xr.DataArray(2.5),
        [xr.DataArray(2.5)],
        xr.DataArray([2.5], dims="x", attrs={"units": "1"}),
        np.array([2.5], object),
    ],
)
def test_numbers_in_other_clothes_are_numbers(value):
    expected = elastica.solve("U", P=2.5, H=0.1).energy
    assert np.ravel(elastica.solve("U", P=value, H=0.1).energy) == expected


LOADS = xr.DataArray([2.0, 3.0, 2.5], dims="day", coords={"day": ["mo", "tu", "we"], "year": 2026})
GAPS = xr.DataArray([0.05, 0.1], dims="wall", coords={"wall": [7, 9]})


@pytest.mark.parametrize("method", [{}, {"method": "chain", "links": 40}], ids=["exact", "chain"])
def test_arrays_with_names_are_paired_by_name_and_come_back_labelled(method):
    s = elastica.solve("U", P=LOADS, H=GAPS, **method)
    plain = elastica.solve("U", P=LOADS.values[:, None], H=GAPS.values, **method)
    assert isinstance(s, elastica.Solution) and isinstance(s, LabelledSolution)
    one = {"day": "we", "wall": 9}
    for name in ("P", "H", "status", "stability", "index", "energy", "error", "curvature"):
        value, expected = getattr(s, name), getattr(plain, name)
        assert value.sel(one).item() == expected[2, 1] and value.dims == ("day", "wall"), name
        assert value.name == name and value["year"] == 2026
    for value, expected, extra in (
        (s.reaction, plain.reaction, "contact"),
        (s.lam, plain.lam, "segment"),
        (s.eigenvalues(2), plain.eigenvalues(2), "mode"),
        (s.frequencies(2), plain.frequencies(2), "mode"),
        (s.conventional(2).eigenvalues, plain.conventional(2).eigenvalues, "mode"),
        (s.shape(11).y, plain.shape(11).y, "s"),
    ):
        assert value.dims == ("day", "wall", extra) and extra in value.coords
        np.testing.assert_array_equal(value.sel(one), expected[2, 1])
    assert (s.conventional().stable == plain.conventional().stable).all()


def test_the_same_dimension_is_paired_by_label():
    same = xr.DataArray([0.1, 0.05, 0.02], dims="day", coords={"day": ["mo", "tu", "we"]})
    assert elastica.solve("U", P=LOADS, H=same).energy.dims == ("day",)
    with pytest.raises(ValueError, match=r"P and H have different labels along a dimension; .*align"):
        elastica.solve("U", P=LOADS, H=same.assign_coords(day=["we", "tu", "mo"]))
    with pytest.raises(
        ValueError, match=r"H has the shape \(3,\) and no names for its dimensions, but P has"
    ):
        elastica.solve("U", P=LOADS, H=same.values)
    with pytest.raises(ValueError, match="a dimension 'contact'; rename that of yours"):
        elastica.solve("U", P=LOADS.rename(day="contact"), H=0.1)


def test_found_states_know_the_labels_of_their_points():
    found = elastica.find_states(P=LOADS, H=GAPS, max_contacts=1)
    assert set(found.labels) == {"day", "wall"}
    for row in range(len(found)):
        assert found.P[row] == LOADS.sel(day=found.labels["day"][row])
        assert found.H[row] == GAPS.sel(wall=found.labels["wall"][row])
    assert elastica.find_states(P=2.5, H=0.1, max_contacts=0).labels == {}


def test_a_strip_keeps_labels_and_tells_units():
    force = xr.DataArray([400.0, 500.0], dims="day", coords={"day": ["mo", "tu"]}, attrs={"units": "N"})
    given = STRIP.to_dimensionless(force=force, gap=xr.DataArray([0.031], dims="wall"))
    assert given["P"].sel(day="tu") == STRIP.to_dimensionless(force=500.0)["P"] and not given["P"].attrs
    pressed = STRIP.force(elastica.solve("U", **given).reaction)
    assert pressed.dims == ("day", "wall", "contact") and pressed.attrs["units"] == "N"
    in_units = elastica.Strip(length=30 * UNITS.cm, width=0.025, thickness=0.001, E=200e9)
    assert in_units.force(given["P"]).data.to("N").magnitude == pytest.approx(force.values)
    with pytest.raises(ValueError, match="in kN; give numbers in N"):
        STRIP.to_dimensionless(force=force.assign_attrs(units="kN"))


def test_arrays_that_do_not_broadcast_say_what_a_gap_may_be():
    with pytest.raises(
        ValueError, match=r"P \(3,\) and H \(2,\) do not broadcast: .* half gap of both walls"
    ):
        elastica.solve("U", P=[2.0, 2.5, 3.0], H=(0.1, 0.05))


@pytest.mark.parametrize("method", [{}, {"method": "chain"}])
def test_an_unknown_keyword_is_an_unknown_keyword(method):
    with pytest.raises(TypeError, match="unexpected keyword argument 'friction'"):
        elastica.solve("U", P=2.5, H=0.1, friction=0.3, **method)
