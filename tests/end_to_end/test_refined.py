"""A refined study: the values of the dense one where it computes, whoever computes and whatever stops it."""

import numpy as np
import pytest
from click.testing import CliRunner
from distributed import Client, LocalCluster
from end_to_end.test_growing import altered

import studies
from elastica import Status
from studies import Study, StudyError
from studies.command_line import main
from studies.plot import chart
from studies.running import session
from studies.running.merging import merge
from studies.running.runner import compute, join
from studies.running.session import Policy
from studies.store.datasets import identify

TOML = """
[study]
name = "refined"
[grid]
ends = ["pinned-pinned"]
H = { start = 0.02, stop = 0.2, num = 4 }
P = { start = 0.05, stop = 12.0, num = 13 }
refine = { levels = 3 }
[states]
names = ["0", "B1", "U", "U-", "UD", "UDU"]
"""
FINEST = 25 * 97


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "refined.toml"
    path.write_text(TOML)
    return Study.from_toml(path)


def with_grid(study, **changes):
    content = study.model_dump(mode="json", exclude_none=True)
    return Study.from_dict(content | {"grid": content["grid"] | changes})


@pytest.fixture(scope="module")
def dense_study(study):
    content = study.model_dump(mode="json", exclude_none=True)
    content["grid"] = {"ends": content["grid"]["ends"], "H": study.grid.H, "P": study.grid.P}
    return Study.from_dict(content)


@pytest.fixture(scope="module")
def refined(study, computed):
    return computed(study)


@pytest.fixture(scope="module")
def dense(dense_study, computed):
    return computed(dense_study)


def assert_part_of(refined, dense):
    """Both have the same values where the refined one is computed: the share of points that is."""
    with studies.open(refined) as some, studies.open(dense) as every:
        known = (some["status"] != Status.NOT_COMPUTED).any("state").values
        for name in set(every.data_vars) - {"failure"}:
            values = some[name].values
            assert np.array_equal(
                values[known], every[name].values[known], equal_nan=values.dtype.kind == "f"
            )
        for name in ("status", "stable_count", "preferred_state"):
            assert (some[name].values[~known] == -1).all()
        assert some["energy"].where(~some["status"].isin([0, 2])).isnull().all()
    return known.mean()


def test_the_values_are_those_of_the_dense_grid_where_it_is_computed(refined, dense):
    assert 0.1 < assert_part_of(refined, dense) < 0.35
    report, problems = studies.check(refined, sample=40)
    assert problems == []
    assert any(line.startswith("  points") and f"of {FINEST:,} are computed" in line for line in report)


def test_a_missing_point_of_the_refinement_is_reported(refined, tmp_path):
    def forget(dataset):
        for name in ("status", "stability", "index", "nullity"):
            dataset[name][0, 8, 8] = -1
        dataset["stable_count"][0, 8, 8] = dataset["preferred_state"][0, 8, 8] = -1

    forgetful = altered(refined, tmp_path / "forgetful.nc", forget)
    assert studies.check(forgetful, sample=5)[1] == ["1 points that the refinement needs are not computed"]


def test_the_chart_is_that_of_the_dense_grid_but_for_a_thin_set(refined, dense):
    pictures = []
    for path in (refined, dense):
        with studies.open(path) as dataset:
            mesh = chart(dataset).axes[0].collections[0]
            pictures.append(mesh.get_array().reshape(-1, 3))
    assert len(np.unique(pictures[0], axis=0)) > 4
    assert (pictures[0] != pictures[1]).any(axis=1).mean() < 2e-3


def test_stopped_again_and_again_it_ends_with_the_identical_dataset(study, refined, tmp_path, monkeypatch):
    out, original, calls = tmp_path / "refined.nc", session.compute_block, []
    patience = 7

    def interrupted(block, job):
        if len(calls) and len(calls) % patience == 0 and calls[-1] is not None:
            calls.append(None)
            raise KeyboardInterrupt
        calls.append(block)
        return original(block, job)

    monkeypatch.setattr(session, "compute_block", interrupted)
    plan, stops = study.plan(block_points=40), 0
    while not out.exists():
        try:
            compute(plan, out, Policy(workers=0))
        except KeyboardInterrupt:
            stops += 1
            with pytest.raises(StudyError, match="shards are missing"):
                join(plan, out)
    done = [block for block in calls if block is not None]
    assert stops >= 2
    assert len(done) == len(set(done))
    assert sum(block.points for block in done) < FINEST
    assert identify(out)["content_hash"] == identify(refined)["content_hash"]
    assert list(tmp_path.iterdir()) == [out]


def test_workers_give_the_identical_dataset(study, refined, tmp_path):
    studies.run(study, tmp_path / "again.nc", workers=2, block_points=60).close()
    assert identify(tmp_path / "again.nc")["content_hash"] == identify(refined)["content_hash"]


def test_more_levels_take_the_points_that_are_there(study, refined, dense, tmp_path, monkeypatch):
    points, original = [], session.compute_block
    monkeypatch.setattr(session, "compute_block", lambda *a: points.append(a[0].points) or original(*a))
    coarser = with_grid(study, refine={"levels": 2})
    studies.run(coarser, tmp_path / "coarse.nc", workers=0).close()
    there, fresh = sum(points), with_grid(study, refine={"levels": 3, "audit": 0})
    points.clear()
    studies.run(fresh, tmp_path / "fine.nc", workers=0, reuse=tmp_path / "coarse.nc").close()
    share = assert_part_of(tmp_path / "fine.nc", dense)
    assert there + sum(points) == round(share * FINEST)
    assert studies.check(tmp_path / "fine.nc", sample=20)[1] == []


def test_a_dense_study_takes_the_points_of_a_refined_one(dense_study, refined, dense, tmp_path, monkeypatch):
    points, original = [], session.compute_block
    monkeypatch.setattr(session, "compute_block", lambda *a: points.append(a[0].points) or original(*a))
    studies.run(dense_study, tmp_path / "all.nc", workers=0, reuse=refined).close()
    assert sum(points) == FINEST - round(assert_part_of(refined, dense) * FINEST)
    assert identify(tmp_path / "all.nc")["content_hash"] == identify(dense)["content_hash"]


def test_refined_datasets_are_merged_and_what_none_computed_stays_unknown(study, refined, tmp_path, computed):
    other = computed(with_grid(study, ends=["clamped-pinned"]))
    merge([refined, other], tmp_path / "both.nc")
    assert studies.check(tmp_path / "both.nc", sample=20)[1] == []
    with studies.open(tmp_path / "both.nc") as both:
        for path in (refined, other):
            with studies.open(path) as part:
                again = both.sel(ends=part.ends, state=part.state)
                for name in ("status", "stability", "index", "energy", "stable_count"):
                    assert np.array_equal(again[name], part[name], equal_nan=part[name].dtype.kind == "f")
                assert (part["status"] == Status.NOT_COMPUTED).any()


def test_a_refined_study_on_workers_that_are_there_already(study, refined, tmp_path):
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        studies.run(study, tmp_path / "again.nc", client=client, block_points=200).close()
    assert identify(tmp_path / "again.nc")["content_hash"] == identify(refined)["content_hash"]


def test_under_prescribed_shortening(computed, study):
    content = study.model_dump(mode="json", exclude_none=True)
    content["states"] = {"names": ["0", "B1", "B2"]}
    content["grid"] = {
        "ends": ["clamped-clamped"],
        "H": {"start": 0.05, "stop": 0.2, "num": 3},
        "shortening": {"start": 0.001, "stop": 0.3, "num": 5, "spacing": "log"},
    }
    some = Study.from_dict({**content, "grid": content["grid"] | {"refine": {"levels": 3}}})
    assert any("warning" in line for line in some.plan().report(1))
    every = Study.from_dict(
        {**content, "grid": content["grid"] | {"H": some.grid.H, "shortening": some.grid.shortening}}
    )
    assert 0.1 < assert_part_of(computed(some), computed(every)) < 0.9


def test_a_plan_says_what_is_certain_and_what_it_cannot_exceed(study, tmp_path):
    report = "\n".join(study.plan().report(workers=2))
    assert f"points    {FINEST:,} grid points" in report
    assert "refined   88 points first" in report
    assert "at most all" in report


def test_parts_of_a_refined_study_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "refined.toml").write_text(TOML)
    result = CliRunner().invoke(main, ["run", "refined.toml", "--shard", "1/2"])
    assert result.exit_code == 2
    assert "--shard 1/2: which points a refined study needs" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["refined.toml"]
