import subprocess
import sys

import numpy as np
import pytest
import xarray

import elastica
import studies
from elastica import Status


@pytest.fixture
def dataset(dataset_file):
    with studies.open(dataset_file) as dataset:
        yield dataset


@pytest.fixture
def ruler():
    return elastica.Strip(length=0.3, width=0.025, thickness=0.001, E=200e9, density=7850)


def test_stable_is_what_sel_and_where_say(dataset):
    stable = dataset.elastica.stable()
    assert stable.dtype == bool and stable.dims == dataset["stability"].dims
    assert 0 < stable.sum() < stable.size
    assert list(stable.attrs) == ["long_name"] and stable.H.attrs == dataset.H.attrs
    xarray.testing.assert_equal(stable.sum("state"), dataset["stable_count"])
    energy = dataset["energy"].where(stable)
    assert (dataset["status"].where(stable, 0) == Status.SOLVED).all()
    assert energy.groupby("ends").count(...).sum() == stable.sum()


def test_a_state_by_any_of_its_names(dataset):
    like, unlike = dataset.sel(ends="clamped-clamped"), dataset.sel(ends="clamped-pinned")
    assert like.elastica.state("D").state == "U"
    assert like.elastica.state("aD").state == "Ua"
    assert unlike.elastica.state("aD").state == "aU"
    # Between like ends aU is Ua, elsewhere a state of its own.
    both = dataset.elastica.state("aU")
    assert both.state.values.tolist() == ["Ua", "aU"] and both.sizes["ends"] == 2
    for ends in both.ends.values:
        own = dataset.sel(ends=ends).elastica.state("aU")
        xarray.testing.assert_equal(both["energy"].sel(ends=ends), own["energy"])
    assert own.elastica.state("aU").identical(own)


def test_shapes_stored_and_computed_are_the_same(dataset):
    some = dataset.isel(H=[1, 3], P=slice(2, 9, 3))
    stored = some.elastica.shape()
    assert stored.sizes["s"] == 11 and stored["y"].dims == dataset["y"].dims
    # 21 samples hold the 11 stored ones.
    computed = some.elastica.shape(21)
    assert np.isfinite(stored["y"]).sum() > 100
    for name in ("theta", "x", "y"):
        np.testing.assert_allclose(computed[name][..., ::2], stored[name], atol=1e-12)
    assert computed["theta"].attrs == dataset["theta"].attrs
    np.testing.assert_allclose(computed.s[::2], stored.s)


def test_a_shape_at_one_point(dataset):
    point = dataset.sel(ends="clamped-clamped").sel(H=0.08, P=2.6, method="nearest")
    shape = point.elastica.state("D").elastica.shape(101)
    assert shape["y"].dims == ("s",) and shape["y"].max() == pytest.approx(float(point.H))
    alone = elastica.solve("U", P=float(point.P), H=float(point.H)).shape(101)
    np.testing.assert_array_equal(shape["y"], alone.y)
    np.testing.assert_array_equal(shape["theta"], alone.theta)


@pytest.mark.parametrize(
    ("given", "solve"),
    [({"shortening": [0.05]}, {}), ({"P": [0.6]}, {"method": "chain", "links": 60})],
    ids=["at prescribed shortening", "of a chain"],
)
def test_shapes_are_solved_as_the_study_solves(computed, given, solve):
    content = {
        "study": {"name": "other"},
        "grid": {"ends": ["pinned-pinned"], "H": [0.1], **given},
        "states": {"names": ["U"]},
        "solve": solve,
    }
    with studies.open(computed(studies.Study.from_dict(content))) as dataset:
        one = dataset.squeeze()
        shape = one.elastica.shape(61)
        assert one["status"] == Status.SOLVED
        # The chain's own shortening differs from the strip's in the fourth digit.
        assert 1 - shape["x"][-1] == pytest.approx(float(one["shortening"]), rel=1e-9)


def test_dask_chunks_change_no_value(dataset_file, dataset):
    with studies.open(dataset_file, chunks={"ends": 1, "P": -1}) as lazy:
        assert lazy["energy"].chunksizes["ends"] == (1, 1) and lazy["energy"].chunksizes["P"] == (12,)
        assert lazy.elastica.stable().chunks is not None
        xarray.testing.assert_equal(lazy.compute(), dataset)
        xarray.testing.assert_equal(lazy.elastica.stable().compute(), dataset.elastica.stable())
    with pytest.raises(studies.StudyError, match=r"chunks = {'Q': 5}: use the dimensions of .*, ends, H"):
        studies.open(dataset_file, chunks={"Q": 5})
    with pytest.raises(studies.StudyError, match="chunks = 'many' cannot be"):
        studies.open(dataset_file, chunks="many")


def test_every_variable_says_what_it_is(dataset):
    for name, variable in dataset.variables.items():
        assert variable.attrs["long_name"], name
        # Names and counts have no unit; flags have meanings.
        number = variable.dtype.kind == "f"
        assert ("units" in variable.attrs) >= number, name
        assert ("flag_meanings" in variable.attrs) == (name in ("status", "stability")), name
    page = dataset._repr_html_()
    assert "half gap between the walls" in page and "radian" in page


def test_physical_units(dataset, ruler):
    real = dataset.elastica.physical(ruler)
    point = {"ends": "clamped-clamped", "state": "U"}
    before, after = (data.sel(point).isel(H=1, P=3) for data in (dataset, real))
    for name, convert, unit in (
        ("P", ruler.force, "N"),
        ("reaction", ruler.force, "N"),
        ("H", ruler.distance, "m"),
        ("y", ruler.distance, "m"),
        ("shortening", ruler.distance, "m"),
        ("energy", ruler.energy, "J"),
        ("curvature", ruler.curvature, "1/m"),
    ):
        np.testing.assert_allclose(after[name], convert(before[name]), rtol=1e-14)
        assert real[name].attrs["units"] == unit
    for name in ("max_slope", "eigenvalue", "stability"):
        xarray.testing.assert_equal(
            after[name].variable.to_base_variable(), before[name].variable.to_base_variable()
        )
    # Labels still select.
    assert real.sel(P=float(after.P), H=float(after.H)).elastica.state("D")["energy"].dims == ("ends",)
    assert set(real.coords) == set(dataset.coords)


def test_shapes_of_a_real_strip_are_in_metres(dataset, ruler):
    some = dataset.isel(H=[1], P=[3, 5])
    real, numbers = some.elastica.physical(ruler), some.elastica.shape(21)
    shapes = real.elastica.shape(21)
    assert shapes["y"].attrs["units"] == shapes["s"].attrs["units"] == "m" and shapes["y"].count() > 0
    for name in ("x", "y", "s"):
        np.testing.assert_allclose(shapes[name], ruler.distance(numbers[name].values), rtol=1e-12)
    xarray.testing.assert_equal(shapes["H"], real["H"])
    # Converting again is converting once, and what no attribute tells any more is not guessed.
    longer = elastica.Strip(length=0.6, width=0.025, thickness=0.001, E=200e9)
    np.testing.assert_allclose(real.elastica.physical(longer)["H"], longer.distance(some["H"]), rtol=1e-14)
    for lost, message in (
        (some.drop_attrs(), r"H has lost its attribute 'units': is it a number, or in m\?"),
        (real.drop_attrs(deep=False), "no attribute 'strip' says of which strip"),
    ):
        with pytest.raises(studies.StudyError, match=message):
            lost.elastica.shape(21)
    with pytest.raises(studies.StudyError, match="H has lost its attribute 'units'"):
        some.drop_attrs().elastica.physical(ruler)


def test_a_table_has_a_row_for_each_solved_state(dataset):
    table = dataset.elastica.table()
    solved = dataset["status"] == Status.SOLVED
    assert len(table) == solved.sum() < solved.size / 2
    assert list(table)[:6] == ["ends", "H", "P", "state", "stability", "index"]
    assert {"reaction_1", "eigenvalue_3"} < set(table) and "stable_count" not in table
    for row in table.sample(20, random_state=1).itertuples():
        point = dataset.sel(ends=row.ends, H=row.H, P=row.P, state=row.state)
        assert point["status"] == Status.SOLVED
        assert row.stability == elastica.Stability(int(point["stability"])).name.lower()
        np.testing.assert_equal(row.energy, float(point["energy"]))
        np.testing.assert_equal(row.eigenvalue_3, float(point["eigenvalue"].sel(mode=3)))
    stable = dataset.elastica.stable().sum(["H", "P"]).to_series()
    counted = table[table["stability"] == "stable"].groupby(["ends", "state"]).size()
    assert (counted == stable[counted.index]).all() and counted.sum() == stable.sum()
    one = dataset.isel(ends=1, H=2, P=7)
    there = one.elastica.table()
    assert set(there["ends"]) == {"clamped-pinned"} and len(there) == (one["status"] == 0).sum()
    assert one.isel(state=int(np.argmax(one["status"].values == 0))).elastica.table().shape[0] == 1


CELLS = """
import studies
d = studies.open({path!r}).isel(ends=[0], H=slice(0, 2), P=slice(0, 3))
d.elastica.plot.shapes()
---
figure = d.elastica.plot.shapes()
---
figure.show()
---
%matplotlib inline
figure
---
import matplotlib.pyplot as plt
d.elastica.plot.shapes()
---
figure.show()
plt.show()
"""


def test_a_figure_is_shown_once_in_a_fresh_notebook(dataset_file):
    """As soon as a cell ends with it, or it is told to, with and without pyplot and its inline figures."""
    import nbformat
    from nbclient import NotebookClient

    cells = CELLS.format(path=str(dataset_file)).split("---")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell.strip()) for cell in cells])
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    pictures = [
        sum("image/png" in output.get("data", {}) for output in cell["outputs"]) for cell in notebook["cells"]
    ]
    assert pictures == [1, 0, 1, 1, 1, 1]


SCRIPT = """
import sys, types
import matplotlib
from matplotlib.backends import backend_agg
from matplotlib.backend_bases import FigureManagerBase

class Window(FigureManagerBase):
    @classmethod
    def pyplot_show(cls, *, block=None):
        from matplotlib import pyplot
        for number in pyplot.get_fignums():
            canvas = pyplot.get_current_fig_manager().canvas
            canvas.draw()
            print("shown", len(canvas.figure.axes))

class Canvas(backend_agg.FigureCanvasAgg):
    manager_class = Window

backend = types.ModuleType("windows")
backend.FigureCanvas, backend.FigureManager = Canvas, Window
sys.modules["windows"] = backend
matplotlib.use("module://windows")

import studies
d = studies.open(sys.argv[1]).isel(ends=[0], H=slice(0, 2), P=slice(0, 3))
figure = d.elastica.plot.shapes(states=["0", "U"])
figure.show()
print("again")
figure.show()
studies.plot.save(figure, sys.argv[2])
"""


def test_a_script_shows_a_figure_when_it_says_so(dataset_file, tmp_path):
    picture = tmp_path / "f.png"
    answer = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(dataset_file), str(picture)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert answer.stdout.split("\n")[:-1] == ["shown 2", "again", "shown 2"], answer.stderr
    assert picture.stat().st_size > 5000


def test_what_a_dataset_lacks_is_one_sentence(dataset, monkeypatch):
    monkeypatch.setattr("studies.accessor.MOST_SHAPES", 10)
    for ask, message in (
        (lambda: dataset.elastica.state("V"), "state = 'V' is not known"),
        (lambda: dataset.elastica.state("UD"), "state = 'UD' is not in this dataset; it has 0, "),
        (lambda: dataset[["energy"]].elastica.stable(), "no 'stability'"),
        (lambda: dataset.isel(H=0, P=0).elastica.shape(1), "samples = 1; ask for at least two"),
        (
            lambda: dataset.isel(H=0, P=0).drop_attrs(deep=False).elastica.shape(21),
            "has lost its attribute 'config_json'",
        ),
        (lambda: dataset.elastica.shape(21), "shapes are too many at once; select 10 or fewer"),
    ):
        with pytest.raises(ValueError, match=message):
            ask()


def test_the_chart_is_drawn(dataset):
    assert len(dataset.elastica.plot.chart().axes) == 2
