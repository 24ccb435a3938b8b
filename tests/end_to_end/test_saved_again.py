"""What users save with xarray of a dataset: every writer takes it, and what comes of it opens or is named."""

import warnings

import pytest
import xarray as xr

import elastica
import studies
from studies import Study, StudyError
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.files import opened

ENGINES = ["netcdf4", "h5netcdf"]


@pytest.fixture(scope="module")
def with_tables(computed):
    """A dataset with text in tables too."""
    study = {
        "study": {"name": "tables"},
        "grid": {"ends": ["clamped-clamped"], "H": [0.1], "P": [1.0, 6.0]},
        "states": {"names": ["0", "U"]},
        "outputs": {"transitions": True},
    }
    path = computed(Study.from_dict(study))
    with opened(path) as dataset:
        assert "transition_state" in dataset.variables
    return path


@pytest.fixture
def no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("chunks", [None, {}])
@pytest.mark.parametrize("version", [2, 3])
def test_zarr_takes_text_without_a_warning(with_tables, tmp_path, no_warning, chunks, version):
    with studies.open(with_tables, chunks=chunks) as dataset:
        # That Zarr has no common metadata yet is not about this dataset.
        dataset.to_zarr(tmp_path / "a.zarr", zarr_format=version, consolidated=False)
        with xr.open_zarr(tmp_path / "a.zarr", consolidated=False) as again:
            xr.testing.assert_equal(again.load(), dataset.load())


@pytest.mark.parametrize(
    "answer",
    [
        lambda: studies.loading_path("pinned-pinned", H=0.1, P=[0.2, 0.5]),
        lambda: studies.to_dataset(elastica.find_states(P=6.0, H=0.1)),
        lambda: studies.to_dataset(elastica.solve("U", P=[2.0, 3.0], H=0.1)),
    ],
)
def test_answers_are_saved_without_a_warning(answer, tmp_path, no_warning):
    dataset = answer()
    dataset.to_zarr(tmp_path / "a.zarr", consolidated=False)
    dataset.to_netcdf(tmp_path / "a.nc")
    for again in (xr.open_zarr(tmp_path / "a.zarr", consolidated=False), xr.open_dataset(tmp_path / "a.nc")):
        with again:
            xr.testing.assert_equal(again.load(), dataset)


@pytest.mark.parametrize("engine", [*ENGINES, "scipy"])
def test_netCDF_takes_text_without_a_warning(with_tables, tmp_path, no_warning, engine):
    with studies.open(with_tables) as dataset:
        dataset.to_netcdf(tmp_path / "a.nc", engine=engine)
        with xr.open_dataset(tmp_path / "a.nc", engine=engine) as again:
            xr.testing.assert_equal(again.load(), dataset.load())


@pytest.mark.parametrize("engine", ENGINES)
def test_a_dataset_that_is_saved_again_is_the_same_dataset(with_tables, tmp_path, engine):
    path = tmp_path / "a.nc"
    with studies.open(with_tables) as dataset:
        dataset.to_netcdf(path, engine=engine)
        assert content_hash(path) == identify(with_tables)["content_hash"]
        with studies.open(path) as again:
            xr.testing.assert_identical(again.load(), dataset.load())
    assert studies.check(path, sample=2)[1] == []


OPEN = {
    "two variables": lambda d: d[["status", "energy"]],
    "a range": lambda d: d.isel(H=slice(0, 2)),
    "some ends": lambda d: d.isel(ends=[0]),
    "some states": lambda d: d.sel(state=["U", "0"]),
    "joined again": lambda d: xr.concat([d.isel(P=slice(0, 3)), d.isel(P=slice(3, None))], "P"),
    "merged": lambda d: xr.merge([d[["energy"]], d[["status"]]], combine_attrs="override"),
    "with one more": lambda d: d.assign(vigour=2 * d["energy"]),
}
NAMED = {
    "one gap": lambda d: d.isel(H=2),
    "one load": lambda d: d.isel(P=0),
    "one end condition": lambda d: d.isel(ends=0),
    "one state": lambda d: d.sel(state="U"),
    "one point": lambda d: d.isel(ends=0, H=1, P=2),
    "one variable": lambda d: d[["energy"]],
    "an array": lambda d: d["energy"].to_dataset(),
    "nothing": lambda d: d.isel(H=[]),
    "masked": lambda d: d.where(d["status"] == 0),
    "turned": lambda d: d.transpose(),
    "upside down": lambda d: d.isel(H=slice(None, None, -1)),
    "renamed": lambda d: d.rename(H="gap"),
    "an average": lambda d: d[["energy"]].mean("P", keep_attrs=True),
    "another dimension": lambda d: d.expand_dims(run=[1]),
    "without labels": lambda d: d.drop_vars("state"),
    "in single precision": lambda d: d.astype("f4"),
    "without attributes": lambda d: d.drop_attrs(),
}


@pytest.fixture(scope="module")
def dataset(dataset_file):
    with studies.open(dataset_file) as opened_dataset:
        yield opened_dataset.load()


@pytest.mark.parametrize("kind", OPEN)
def test_what_is_still_a_dataset_opens(dataset, tmp_path, kind):
    part = OPEN[kind](dataset)
    part.to_netcdf(tmp_path / "a.nc")
    with studies.open(tmp_path / "a.nc") as again:
        xr.testing.assert_equal(again.load(), part)


@pytest.mark.parametrize("kind", NAMED)
def test_what_is_no_longer_one_is_said_to_open_with_xarray(dataset, tmp_path, kind):
    NAMED[kind](dataset).to_netcdf(tmp_path / "a.nc")
    with pytest.raises(StudyError, match=r"this is no .*dataset.* xarray\.open_dataset"):
        studies.open(tmp_path / "a.nc")


def test_netCDF_3_is_said_to_be_that(dataset, tmp_path):
    dataset.isel(H=2).to_netcdf(tmp_path / "a.nc", engine="scipy")
    with pytest.raises(StudyError, match=r"this is netCDF-3; it opens with xarray\.open_dataset"):
        studies.open(tmp_path / "a.nc")
