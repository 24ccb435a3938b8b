"""Studies with max_contacts hold every root of every word, however the grid is cut."""

import copy

import numpy as np
import pytest

import elastica
import studies
from elastica import Status
from studies import Study
from studies.running import evaluate
from studies.store.datasets import identify

CONTENT = {
    "study": {"name": "roots"},
    "grid": {
        "ends": ["clamped-clamped", "pinned-pinned"],
        "H": [0.04, 0.1],
        "P": {"start": 1.0, "stop": 13.0, "num": 5},
    },
    "states": {"max_contacts": 2},
}


@pytest.fixture(scope="module")
def study():
    return Study.from_dict(CONTENT)


@pytest.fixture(scope="module")
def roots_file(study, computed):
    return computed(study)


@pytest.fixture(scope="module")
def dataset(roots_file):
    with studies.open(roots_file) as opened:
        yield opened.load()


@pytest.mark.parametrize("ends", CONTENT["grid"]["ends"])
def test_the_dataset_holds_what_find_states_finds_and_nothing_else(dataset, ends):
    part = dataset.sel(ends=ends)
    H, P = (grid.ravel() for grid in np.meshgrid(part["H"], part["P"], indexing="ij"))
    found = elastica.find_states(P=P, H=H, ends=ends, max_contacts=2)
    solved = (part["status"] == Status.SOLVED).values.reshape(H.size, -1)
    points, columns = np.nonzero(solved)
    stored = {
        (point, str(part["state"].values[column])): part["energy"].values.reshape(H.size, -1)[point, column]
        for point, column in zip(points, columns, strict=True)
    }
    expected = dict(zip(zip(found.point, map(str, found.state), strict=True), found.energy, strict=True))
    assert stored == expected
    assert any(":" in name for _, name in stored)


def test_states_are_in_order_with_their_roots_and_solved_somewhere(dataset, study):
    names = [str(name) for name in dataset["state"].values]
    place = {name: number for number, name in enumerate(study.task.names)}
    ranks = [(place[name.split(":")[0]], int((name + ":1").split(":")[1])) for name in names]
    assert ranks == sorted(ranks)
    assert len(set(names)) == len(names)
    assert (dataset["status"] == Status.SOLVED).any(["ends", "H", "P"]).all()
    assert dataset.attrs["states_searched"].split() == list(study.task.names)


def test_what_a_block_lacks_has_no_equilibrium_or_no_meaning(dataset):
    pinned = dataset["status"].sel(ends="pinned-pinned", state="Ua-")
    clamped = dataset["status"].sel(ends="clamped-clamped", state="Ua-")
    assert (pinned != Status.NOT_COMPUTED).all()
    assert (clamped == Status.NOT_COMPUTED).all()
    # The roots of a line word are many at some points and none at others.
    roots = [name for name in dataset["state"].values if name.endswith(":2")]
    part = dataset["status"].sel(ends="clamped-clamped", state=roots)
    assert set(np.unique(part.sel(P=1.0))) <= {Status.NO_EQUILIBRIUM, Status.NOT_COMPUTED}


@pytest.mark.parametrize("block_points", [2, 5])
def test_blocks_of_any_size_give_the_same_dataset(study, roots_file, tmp_path, block_points):
    out = tmp_path / "roots.nc"
    studies.run(study, out=out, workers=0, block_points=block_points).close()
    assert identify(out)["content_hash"] == identify(roots_file)["content_hash"]


def test_check_searches_again_and_misses_a_root_that_was_taken_out(study, roots_file, tmp_path, monkeypatch):
    assert studies.check(roots_file, sample=8)[1] == []

    def forgetful(*arguments):
        for points, numbers, solution in original(*arguments):
            if solution.state.name != "U-":
                yield points, numbers, solution

    original = evaluate.search
    monkeypatch.setattr(evaluate, "search", forgetful)
    out = tmp_path / "roots.nc"
    studies.run(study, out=out, workers=0).close()
    monkeypatch.undo()
    problems = studies.check(out, sample=20, seed=0)[1]
    assert problems
    assert all(problem.startswith("state cannot be found again") for problem in problems)


def test_a_poisoned_word_fails_alone_and_only_at_its_point(study, dataset, tmp_path, monkeypatch):
    original = evaluate.search

    def poisoned(names, scene, control, P):
        if "UD" in names and str(scene.ends) == "clamped-clamped" and ((P == 7.0) & (scene.H == 0.1)).any():
            raise ZeroDivisionError("poison")
        return original(names, scene, control, P)

    monkeypatch.setattr(evaluate, "search", poisoned)
    with studies.run(study, out=tmp_path / "roots.nc", workers=0) as hurt:
        failed = hurt["status"] == Status.FAILED
        assert failed.sum() == 1
        assert failed.sel(ends="clamped-clamped", H=0.1, P=7.0, state="UD")
        # Nothing is known of the other roots of the word at that point.
        roots = [name for name in dataset["state"].values if name.startswith("UD:")]
        unknown = hurt["status"].sel(state=roots) == Status.NOT_COMPUTED
        assert (
            (unknown == ((hurt["P"] == 7.0) & (hurt["H"] == 0.1) & (hurt["ends"] == "clamped-clamped")))
            .sel(ends="clamped-clamped")
            .all()
        )
        others = [name for name in dataset["state"].values if not name.startswith("UD")]
        for name in ("status", "energy"):
            assert hurt[name].sel(state=others).equals(dataset[name].sel(state=others))
    assert studies.check(tmp_path / "roots.nc")[1] == []


def test_names_of_roots_can_be_asked_for(tmp_path):
    content = copy.deepcopy(CONTENT) | {"states": {"names": ["UD:2", "U"]}}
    with studies.run(Study.from_dict(content), out=tmp_path / "named.nc", workers=0) as named:
        assert named["state"].values.tolist() == ["UD:2", "U"]
        H, P = np.meshgrid(named["H"], named["P"], indexing="ij")
        expected = elastica.solve("UD:2", P=P, H=H, ends="pinned-pinned")
        stored = named.sel(ends="pinned-pinned", state="UD:2")
        assert np.array_equal(stored["status"], expected.status)
        assert np.array_equal(stored["energy"], expected.energy, equal_nan=True)


def test_springs_are_ends_like_others(tmp_path):
    content = copy.deepcopy(CONTENT)
    content["grid"] = {"ends": ["0.30/2.5", "clamped/1e0"], "H": [0.1], "P": [0.9, 1.4]}
    content["states"] = {"max_contacts": 1}
    with studies.run(Study.from_dict(content), out=tmp_path / "springs.nc", workers=0) as springs:
        assert springs["ends"].values.tolist() == ["0.3/2.5", "clamped/1"]
        found = elastica.find_states(P=1.4, H=0.1, ends="0.3/2.5", max_contacts=1)
        part = springs.sel(ends="0.3/2.5", P=1.4, H=0.1)
        solved = part["state"].values[part["status"] == Status.SOLVED]
        assert sorted(solved) == sorted(found.state)
    assert studies.check(tmp_path / "springs.nc")[1] == []
