"""Studies that prescribe the shortening, with the load as a variable; and what modes are stored."""

import numpy as np
import pytest

import elastica
import studies
from elastica import Stability, Status
from studies import Study
from studies.store.datasets import identify

CONTENT = {
    "study": {"name": "short"},
    "grid": {
        "ends": ["clamped-clamped"],
        "H": [0.05, 0.1],
        "shortening": {"start": 0.0, "stop": 0.12, "num": 7},
    },
    "states": {"names": ["0", "B1", "U", "Ua", "U-"]},
    "outputs": {"eigenvalues": 2, "shapes": 5},
}


@pytest.fixture(scope="module")
def study():
    return Study.from_dict(CONTENT)


@pytest.fixture(scope="module")
def short_file(study, computed):
    return computed(study)


@pytest.fixture(scope="module")
def dataset(short_file):
    with studies.open(short_file) as opened:
        yield opened.load()


def test_the_load_takes_the_place_of_the_shortening(dataset):
    assert dataset["status"].dims == dataset["P"].dims == ("ends", "H", "shortening", "state")
    assert dataset["P"].attrs["long_name"] == "thrust"
    assert dataset["shortening"].dims == ("shortening",)
    assert dataset.attrs["control"] == "shortening"


@pytest.mark.parametrize("name", CONTENT["states"]["names"])
def test_every_value_is_what_solve_says(dataset, name):
    H, shortening = np.meshgrid(dataset["H"], dataset["shortening"], indexing="ij")
    s = elastica.solve(name, shortening=shortening, H=H)
    part = dataset.sel(ends="clamped-clamped", state=name)
    for field in ("status", "stability", "index", "P", "energy", "bending_energy"):
        assert np.array_equal(part[field], getattr(s, field), equal_nan=True), field


def test_the_loads_lead_back_to_the_shortening(dataset):
    part = dataset.sel(ends="clamped-clamped", state="U", H=0.1)
    solved = (part["status"] == Status.SOLVED).values
    assert solved.sum() > 2
    back = elastica.solve("U", P=part["P"].values[solved], H=0.1)
    assert back.shortening == pytest.approx(part["shortening"].values[solved], rel=1e-9)


def test_the_preferred_state_has_the_least_bending_energy(dataset):
    stable = (dataset["stability"] == Stability.STABLE).values
    least = np.where(stable, dataset["bending_energy"], np.inf).argmin(axis=-1)
    assert np.array_equal(dataset["preferred_state"], np.where(stable.any(axis=-1), least, -1))
    assert np.array_equal(dataset["stable_count"], stable.sum(axis=-1))


def test_blocks_of_any_size_give_the_same_dataset(study, short_file, tmp_path):
    out = tmp_path / "short.nc"
    studies.run(study, out=out, workers=0, block_points=7).close()
    assert identify(out)["content_hash"] == identify(short_file)["content_hash"]


def test_check_solves_again(short_file, tmp_path):
    report, problems = studies.check(short_file, sample=10)
    assert problems == []
    assert any("shortening  7 values" in line for line in report)


def test_the_chart_has_the_shortening_as_its_axis_and_no_curves_of_load_control(dataset):
    (ax,) = studies.plot.chart(dataset).axes
    assert ax.get_ylabel().startswith("shortening")
    assert ax.get_ylim() == pytest.approx((0, 0.12))
    assert ax.get_lines() == []


def test_failures_say_where_on_the_shortening_axis(study, tmp_path, monkeypatch):
    from studies.running import evaluate

    original = evaluate.solve

    def poisoned(name, *, shortening, **arguments):
        if name == "B1" and (shortening == 0.04).any():
            raise ZeroDivisionError("poison")
        return original(name, shortening=shortening, **arguments)

    monkeypatch.setattr(evaluate, "solve", poisoned)
    quick = study.model_copy(update={"states": study.states.model_copy(update={"names": ("0", "B1")})})
    with studies.run(quick, out=tmp_path / "short.nc", workers=0) as dataset:
        place = zip(
            *(dataset[f"failure_{axis}"].values for axis in ("H", "shortening", "state")), strict=True
        )
        assert sorted(place) == [(0, 2, 1), (1, 2, 1)]


def test_every_root_at_a_shortening_where_nothing_or_something_exists(tmp_path):
    content = {
        "study": {"name": "deep"},
        "grid": {"ends": ["clamped-clamped"], "H": [0.1], "shortening": [0.01, 0.1, 1.999]},
        "states": {"max_contacts": 1},
    }
    with studies.run(Study.from_dict(content), out=tmp_path / "deep.nc", workers=0) as deep:
        found = elastica.find_states(shortening=0.1, H=0.1, max_contacts=1)
        part = deep.sel(ends="clamped-clamped", H=0.1, shortening=0.1)
        solved = part["status"] == Status.SOLVED
        assert sorted(part["state"].values[solved]) == sorted(found.state)
        loads = dict(zip(found.state, found.P, strict=True))
        assert {str(n): float(part["P"].sel(state=n)) for n in loads} == loads


def test_frequencies_share_their_modes_with_eigenvalues(tmp_path):
    content = CONTENT | {
        "grid": {"ends": ["clamped-clamped"], "H": [0.1], "P": [2.0, 2.5]},
        "states": {"names": ["0", "U"]},
        "outputs": {"eigenvalues": 1, "frequencies": 3},
    }
    with studies.run(Study.from_dict(content), out=tmp_path / "modes.nc", workers=0) as modes:
        expected = elastica.solve("U", P=[2.0, 2.5], H=0.1).frequencies(3)
        stored = modes.sel(ends="clamped-clamped", H=0.1, state="U")
        assert modes["mode"].values.tolist() == [1, 2, 3]
        assert stored["frequency"].values == pytest.approx(expected, rel=1e-9)
        assert stored["eigenvalue"].sel(mode=1).notnull().all()
        assert stored["eigenvalue"].sel(mode=[2, 3]).isnull().all()
    assert studies.check(tmp_path / "modes.nc")[1] == []
