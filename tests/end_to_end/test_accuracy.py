"""`elastica accuracy`: what it measures, what it refuses, and what an interrupted run leaves behind."""

import json

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from matplotlib.image import imread
from references.make_accuracy import CASES, ENDS, heights
from references.make_states import reference

from studies.accuracy import measure
from studies.accuracy.cases import Answer, cases
from studies.accuracy.chain import ORDERS
from studies.command_line import main


def accuracy(*arguments):
    return CliRunner().invoke(main, ["accuracy", *map(str, arguments)])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Everything but the slowest, with few settings."""
    folder = tmp_path_factory.mktemp("accuracy")
    arguments = [part for name in measure.FAMILIES for part in ("--method", name)]
    result = accuracy("-o", folder, "--quick", *arguments)
    assert result.exit_code == 0, result.output
    return folder, result.stdout


def test_dataset_tables_and_figures(measured):
    folder, text = measured
    with xr.open_dataset(folder / "accuracy.nc") as data:
        assert data["seconds"].dims == ("scene", "task", "solver", "round")
        assert data.sizes["round"] == measure.QUICK_ROUNDS
        assert "NumPy" in data.attrs["machine"]
        assert (data["seconds"] > 0).any("round").equals(data["error"] > 0)
    assert (folder / "accuracy.md").read_text() == text
    assert "| contact | equilibrium | IPOPT, 400 links |" in text
    for case in cases():
        assert imread(folder / f"accuracy-{case}.png").std() > 0.05


def test_errors_are_as_large_as_the_methods_promise(measured):
    with xr.open_dataset(measured[0] / "accuracy.nc") as data:
        error = data["error"].load().set_index(solver=["curve", "setting"])
    exact = error.sel(curve="exact").squeeze("setting")
    assert (exact <= 1e-12).all()
    for setting, order in ORDERS.items():
        chain = error.sel(curve=f"chain-{setting}", task=["equilibrium", "eigenvalue"])
        fine = chain.sel(setting=chain["setting"] >= 200)
        slope = -np.diff(np.log(fine), axis=-1) / np.diff(np.log(fine["setting"]))
        assert slope == pytest.approx(order, abs=0.15)
    better = error.sel(curve="chain-consistent-extrapolated", task="equilibrium", setting=400.0)
    assert (better < 1e-2 * error.sel(curve="chain-consistent", task="equilibrium", setting=400.0)).all()
    spectral = error.sel(curve="spectral", task="eigenvalue")
    assert (spectral.sel(setting=4.0) > 1e-4).all()
    # A shape without contact is one element, whose poles are the nearer the longer it is.
    assert (spectral.sel(setting=24.0) < 1e-9).all()
    assert (spectral.sel(setting=48.0) < 1e-12).all()
    dense, chain = (
        error.sel(curve=curve, task=["equilibrium", "index", "eigenvalue"], setting=200.0).values
        for curve in ("dense", "chain-published")
    )
    assert dense == pytest.approx(chain, rel=1e-6)
    collocation = error.sel(curve="solve_bvp", task=["equilibrium", "shape"])
    assert (collocation.sel(setting=1e-9) < 1e-9).all()
    assert (error.sel(curve="ipopt", task="equilibrium", setting=400.0) < 1e-3).all()


def test_a_wrong_index_is_an_infinite_error():
    case = cases()["contact"]
    answer = Answer({"equilibrium": 1.0, "index": 1.0}, case.energy, case.shortening, case.index + 1)
    assert answer.errors(case)["index"] == np.inf
    assert answer.errors(case)["equilibrium"] < 1e-15


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "nowhere/new"], "nowhere/new: this folder cannot be made (No such file or directory)"),
        (["-o", "new", "--method", "abacus"], "method 'abacus' is not known; use some of exact"),
    ],
)
def test_bad_input(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = accuracy(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert not list(tmp_path.iterdir())


def test_a_missing_peer_is_skipped_and_refused_only_if_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(measure, "find_spec", lambda name: None)
    chosen, skipped = measure.methods()
    assert skipped == ["ipopt: casadi is not installed (pip install casadi); skipped"]
    assert {method.family for method in chosen} == set(measure.FAMILIES) - {"ipopt"}
    result = accuracy("-o", tmp_path, "--method", "ipopt")
    assert result.exit_code == 2
    assert "casadi is not installed" in result.stderr


def test_an_interrupted_run_keeps_what_it_measured(tmp_path, monkeypatch):
    calls = []

    def answer(self, case, answers):
        calls.append(self)
        if len(calls) > 6:
            raise KeyboardInterrupt
        return Answer({"equilibrium": 1e-6}, 1.001 * case.energy, case.shortening)

    monkeypatch.setattr(measure.Method, "answer", answer)
    result = accuracy("-o", tmp_path, "--method", "exact")
    assert result.exit_code == 130
    assert "stopped; 2 of 7 rounds are kept" in result.stderr
    with xr.open_dataset(tmp_path / "accuracy.nc") as data:
        assert data.sizes["round"] == 2
        assert data["error"].sel(task="equilibrium").values == pytest.approx(1e-3)
    assert "medians of 2 interleaved rounds" in (tmp_path / "accuracy.md").read_text()


def test_stored_references_can_be_computed_again():
    from importlib.resources import files

    stored = json.loads(files("studies.accuracy").joinpath("references.json").read_text(encoding="utf-8"))
    for name, (state, P, H) in CASES.items():
        assert stored[name] == reference(state, ENDS, P, H) | {"y": heights(state, P, H)}
