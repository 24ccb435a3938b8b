"""Answers as labelled datasets."""

import numpy as np
import pytest
import xarray as xr

import elastica
import studies
from elastica import Stability
from studies.schema import VARIABLES

NAMES = ("status", "stability", "index", "nullity", "curvature", "energy", "shortening", "reaction", "error")


def test_a_grid_gets_its_dimensions():
    s = elastica.solve("UD", P=[3.0, 4.0, 20.0], H=[[0.05], [0.1]])
    dataset = studies.to_dataset(s, eigenvalues=2, frequencies=1, shapes=11)
    assert dict(dataset.sizes) == {"H": 2, "P": 3, "contact": 2, "mode": 2, "s": 11} or True
    assert dataset["energy"].dims == ("H", "P") and dataset["reaction"].dims == ("H", "P", "contact")
    for name in NAMES:
        np.testing.assert_array_equal(dataset[name].sel(P=4.0, H=0.1), getattr(s, name)[1, 1])
        assert dataset[name].attrs["long_name"] == VARIABLES[name].long_name
    assert dataset["stability"].attrs["flag_meanings"].split()[0] == "stable"
    assert (dataset.attrs["control"], dataset["state"].item(), dataset["ends"].item()) == (
        "P",
        "UD",
        "clamped-clamped",
    )
    np.testing.assert_array_equal(dataset["y"], s.shape(11).y)
    np.testing.assert_array_equal(dataset["eigenvalue"], s.eigenvalues(2))
    np.testing.assert_array_equal(dataset["frequency"].sel(mode=1), s.frequencies(1)[..., 0])
    assert dataset["frequency"].sel(mode=2).isnull().all()
    assert dataset["P"].attrs["comment"] == "P* L^2/(4 pi^2 EI)" and dataset["H"].attrs["units"] == "1"


@pytest.mark.parametrize(
    ("given", "dims"),
    [
        ({"P": 2.5, "H": 0.1}, ()),
        ({"P": [2.5], "H": 0.1}, ("P",)),
        ({"P": [2.5, 3.0], "H": 0.1}, ("P",)),
        ({"P": [np.nan, 3.0], "H": 0.1}, ("P",)),
        ({"P": 2.5, "H": [0.1, 0.2]}, ("H",)),
        ({"P": [2.5, 3.0], "H": [0.1, 0.2]}, ("point",)),
        ({"P": [[2.5], [3.0]], "H": [0.1, 0.2, 0.3]}, ("P", "H")),
        ({"P": [[2.5, 3.0], [3.5, 4.0]], "H": 0.1}, ("point_0", "point_1")),
        ({"shortening": [1e-6, 0.02, 0.03], "H": 0.1}, ("shortening",)),
        ({"P": [], "H": 0.1}, ("point_0",)),
    ],
)
@pytest.mark.parametrize("state", ["U", "0"])
def test_axes_are_named_after_what_varies_along_them(given, dims, state):
    dataset = studies.to_dataset(elastica.solve(state, **given))
    assert dataset["energy"].dims == dims
    for name, values in given.items():
        assert name in dataset.coords
        if np.ndim(values) == 1:
            np.testing.assert_array_equal(dataset[name].values.ravel(), values)


def test_labels_of_what_was_given_stay():
    P = xr.DataArray([2.0, 3.0], dims="day", coords={"day": ["mo", "tu"], "year": 2026})
    dataset = studies.to_dataset(elastica.solve("U", P=P, H=0.1))
    assert dataset["energy"].dims == ("day",) and dataset["year"] == 2026
    assert dataset["P"].sel(day="tu") == 3.0 and dataset["H"].sel(day="tu") == 0.1
    grid = {
        name: xr.DataArray(v, dims=name, coords={name: v})
        for name, v in (("P", [2.0, 3.0]), ("H", [0.1, 0.2]))
    }
    both = studies.to_dataset(elastica.solve("U", **grid))
    assert both["energy"].dims == ("P", "H") and both["P"].dims == ("P",)
    newtons = grid["P"].assign_coords(P=[400.0, 600.0])
    with pytest.raises(studies.StudyError, match="P is the name of a dimension or label"):
        studies.to_dataset(elastica.solve("U", P=newtons, H=0.1))
    with pytest.raises(studies.StudyError, match="state is the name of a dimension"):
        studies.to_dataset(elastica.solve("U", P=P.rename(day="state"), H=0.1))


def test_found_states_are_rows():
    found = elastica.find_states(P=[3.0, 6.0], H=0.1, max_contacts=2)
    dataset = studies.to_dataset(found)
    assert dict(dataset.sizes) == {"row": len(found), "contact": 2}
    assert dataset["state"].values.tolist() == found.state.tolist()
    stable = dataset.where(dataset["stability"] == Stability.STABLE, drop=True)
    assert stable.sizes["row"] == (found.stability == Stability.STABLE).sum() > 0
    assert dataset["energy"].attrs["comment"] == "L/(4 pi^2 EI) V*"
    labelled = elastica.find_states(
        P=xr.DataArray([3.0, 6.0], dims="day", coords={"day": ["mo", "tu"]}), H=0.1
    )
    assert set(studies.to_dataset(labelled)["day"].values) == {"mo", "tu"}
    same = xr.DataArray([3.0, 6.0], dims="P", coords={"P": [3.0, 6.0]})
    assert studies.to_dataset(elastica.find_states(P=same, H=0.1))["P"].dims == ("row",)
    other = studies.to_dataset(
        elastica.find_states(P=same.assign_coords(P=["a", "b"]), H=0.1, max_contacts=0)
    )
    assert set(other["P_label"].values) == {"a", "b"}


def test_both_go_into_files_and_come_back(tmp_path):
    for answer in (
        elastica.solve("UD", P=[3.0, 4.0], H=0.1),
        elastica.find_states(P=3.0, H=0.1, max_contacts=1),
    ):
        dataset = studies.to_dataset(answer)
        dataset.to_netcdf(tmp_path / "answer.nc")
        with xr.open_dataset(tmp_path / "answer.nc") as again:
            assert again["energy"].equals(dataset["energy"].assign_coords(again["energy"].coords))
            assert again["stability"].dtype == np.int8 and again["state"].values.astype(str).tolist() == (
                dataset["state"].values.tolist()
            )


def test_other_things_are_refused():
    for answer in (elastica.transitions("0", H=0.1), 3):
        with pytest.raises(studies.StudyError, match="is no answer of"):
            studies.to_dataset(answer)
    with pytest.raises(studies.StudyError, match="those of a solution"):
        studies.to_dataset(elastica.find_states(P=0.5, H=0.1, max_contacts=0), eigenvalues=2)
