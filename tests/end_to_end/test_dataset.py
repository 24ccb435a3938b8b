"""What a study leaves behind: labels, values, attributes, readable by others."""

import numpy as np
import pytest
import xarray as xr
from compliance_checker.runner import CheckSuite, ComplianceChecker

import elastica
import studies
from elastica import Stability, Status
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.files import opened


@pytest.fixture(scope="module")
def dataset(dataset_file):
    with studies.open(dataset_file) as opened_dataset:
        yield opened_dataset.load()


def test_dimensions_and_labels(dataset):
    assert list(dataset["status"].dims) == ["ends", "H", "P", "state"]
    assert list(dataset["reaction"].dims) == ["ends", "H", "P", "state", "contact"]
    assert list(dataset["eigenvalue"].dims) == ["ends", "H", "P", "state", "mode"]
    assert list(dataset["theta"].dims) == ["ends", "H", "P", "state", "s"]
    assert dataset["H"].values.tolist() == [0.04, 0.08, 0.12, 0.16, 0.2]
    assert dataset["ends"].values.tolist() == ["clamped-clamped", "clamped-pinned"]


@pytest.mark.parametrize("name", ["0", "U", "Ua", "aUa", "U-"])
@pytest.mark.parametrize("ends", ["clamped-clamped", "clamped-pinned"])
def test_every_value_is_what_solve_says_at_its_labels(dataset, name, ends):
    part = dataset.sel(ends=ends, state=name)
    H, P = np.meshgrid(part["H"], part["P"], indexing="ij")
    s = elastica.solve(name, P=P, H=H, ends=ends)
    for field in ("status", "stability", "index", "nullity", "curvature", "energy", "error", "clearance"):
        assert np.array_equal(part[field], getattr(s, field), equal_nan=True), field
    # Linear algebra on several threads, as here, rounds differently.
    assert part["eigenvalue"].values == pytest.approx(s.eigenvalues(3), rel=1e-11, nan_ok=True)
    assert np.array_equal(part["y"], s.shape(11).y, equal_nan=True)
    if name != "0":
        assert np.array_equal(part["reaction"], s.reaction, equal_nan=True)


def test_states_without_meaning_for_an_end_are_not_computed(dataset):
    part = dataset.sel(ends="clamped-clamped", state="Ua-")
    assert (part["status"] == Status.NOT_COMPUTED).all()
    assert (part["stability"] == Stability.NOT_SOLVED).all()
    assert part["energy"].isnull().all()


def test_states_found_nowhere_are_left_out_but_listed(dataset):
    searched = dataset.attrs["states_searched"].split()
    kept = dataset["state"].values.tolist()
    solved = (dataset["status"] == Status.SOLVED).any(["ends", "H", "P"])
    assert solved.all()
    left_out = set(searched) - set(kept)
    for name in left_out:
        for ends in ("clamped-clamped", "clamped-pinned"):
            if name in elastica.states(ends, 1):
                H, P = np.meshgrid(dataset["H"], dataset["P"])
                assert not (elastica.solve(name, P=P, H=H, ends=ends).status == Status.SOLVED).any()


def test_stable_count_and_preferred_state(dataset):
    stable = (dataset["stability"] == Stability.STABLE).values
    assert np.array_equal(dataset["stable_count"], stable.sum(axis=-1))
    energy = np.where(stable, dataset["energy"], np.inf)
    preferred = np.where(stable.any(axis=-1), energy.argmin(axis=-1), -1)
    assert np.array_equal(dataset["preferred_state"], preferred)
    assert set(np.unique(dataset["stable_count"])) == {0, 1}


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_opens_with_both_readers_and_flags_stay_integers(dataset_file, engine):
    with xr.open_dataset(dataset_file, engine=engine) as dataset:
        for name in ("status", "stability", "index", "nullity", "stable_count", "preferred_state"):
            assert dataset[name].dtype.kind == "i"
            assert "_FillValue" not in dataset[name].encoding
        flag = dataset["stability"].attrs
        assert flag["flag_values"].dtype == np.int8
        assert len(flag["flag_values"]) == len(flag["flag_meanings"].split()) == 6
        point = dataset.sel(ends="clamped-clamped", H=0.12, state="U").sel(P=2.6, method="nearest")
        assert point["stability"] == Stability.STABLE


def test_every_byte_is_protected_by_a_checksum(dataset_file):
    with opened(dataset_file) as dataset:
        for name, variable in dataset.variables.items():
            assert variable.filters()["fletcher32"], name
            assert variable.filters()["zlib"], name


def test_the_content_hash_is_of_what_is_said_and_not_of_how_it_is_stored(dataset_file, tmp_path):
    written = identify(dataset_file)["content_hash"]

    def rewritten(change=lambda dataset: None):
        """The hash of the same dataset, written by another library without compression, after a change."""
        with xr.open_dataset(dataset_file, mask_and_scale=False) as dataset:
            dataset = dataset.load()
        for variable in dataset.variables.values():
            text = {key: variable.encoding.get(key) for key in ("dtype", "char_dim_name")}
            variable.encoding = text if text["char_dim_name"] else {"_FillValue": None}
        change(dataset)
        dataset.to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
        return content_hash(tmp_path / "again.nc")

    def zero(dataset):
        dataset["curvature"].values[dataset["curvature"].values == 0] = -0.0

    assert rewritten() == written
    assert rewritten(lambda dataset: dataset.attrs.update(history="by a colleague", title="x")) == written
    assert rewritten(zero) == written
    assert rewritten(lambda dataset: dataset.attrs.update(numerics_id="0" * 32)) != written
    assert rewritten(lambda dataset: dataset.attrs.update(states_searched="0 U")) != written
    assert rewritten(lambda dataset: dataset.update({"H": dataset["H"] * (1 + 1e-15)})) != written
    assert rewritten(lambda dataset: dataset.update({"energy": dataset["energy"] * (1 + 1e-15)})) != written
    assert rewritten(lambda dataset: dataset.update({"vigour": dataset["energy"]})) != written


def test_provenance(dataset, study):
    assert dataset.attrs["study_id"] == study.study_id
    assert dataset.attrs["numerics_id"] == study.numerics_id
    assert dataset.attrs["config_json"] == study.config_json
    assert dataset.attrs["title"] == "A small study"
    assert dataset.attrs["Conventions"] == "CF-1.11, ACDD-1.3"
    assert dataset.attrs["control"] == "P"


def test_passes_the_cf_checker(dataset_file, tmp_path):
    CheckSuite.load_all_available_checkers()
    report = tmp_path / "report.txt"
    passed, errors = ComplianceChecker.run_checker(
        str(dataset_file), ["cf:1.11"], 0, "normal", output_filename=str(report), output_format="text"
    )
    text = report.read_text()
    assert not errors, text
    assert passed, text
    assert "Errors" not in text, text
