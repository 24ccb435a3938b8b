"""Running a study: whoever computes it, the dataset is the same, and bad input costs nothing."""

import numpy as np
import pytest
import xarray as xr
from distributed import Client, LocalCluster

import studies
from elastica import Status
from studies import StudyError
from studies.running import session
from studies.running.runner import compute, is_done, join
from studies.running.session import Policy
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.files import opened
from studies.store.shards import find_shards, folder_of


@pytest.mark.parametrize(("workers", "block_points"), [(0, 5), (0, 17), (1, None), (2, 24)])
def test_policy_never_changes_a_value(study, dataset_file, tmp_path, workers, block_points):
    out = tmp_path / "again.nc"
    studies.run(study, out=out, workers=workers, block_points=block_points).close()
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    with xr.open_dataset(out) as again, xr.open_dataset(dataset_file) as first:
        xr.testing.assert_equal(again, first)


def test_a_running_cluster_is_used_and_left_running(study, dataset_file, tmp_path):
    out = tmp_path / "cluster.nc"
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        studies.run(study, out=out, client=client).close()
        assert client.submit(lambda: 7).result() == 7
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]


def test_only_the_dataset_is_left_behind(study, tmp_path):
    studies.run(study, out=tmp_path / "small.nc", workers=0).close()
    assert [path.name for path in tmp_path.iterdir()] == ["small.nc"]


def test_blocks_that_are_done_are_not_computed_again(study, dataset_file, tmp_path, monkeypatch, capsys):
    out = tmp_path / "small.nc"
    plan = study.plan(block_points=24)
    calls = []

    original = session.compute_block

    def interrupted(block, job):
        if len(calls) == 3:
            raise KeyboardInterrupt
        calls.append(block)
        return original(block, job)

    here = Policy(workers=0)
    monkeypatch.setattr(session, "compute_block", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compute(plan, out, here)
    assert not out.exists()
    done = list(calls)
    shards = find_shards(folder_of(out), plan.blocks, study.identity)
    assert set(shards) == set(done)
    damaged = shards[done[1]]
    damaged.write_bytes(damaged.read_bytes()[:-2000])
    shards[done[2]].unlink()
    calls.clear()
    monkeypatch.setattr(session, "compute_block", lambda *a: calls.append(a[0]) or original(*a))
    compute(plan, out, here)
    assert set(calls) == set(plan.blocks) - {done[0]}
    assert "1 shards are damaged or of other points, and are computed again" in capsys.readouterr().err
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    assert list(tmp_path.iterdir()) == [out]


def test_a_missing_shard_is_never_papered_over(study, tmp_path):
    plan = study.plan(block_points=24)
    compute(plan, tmp_path / "small.nc", Policy(workers=0, part=(1, 3)))
    with pytest.raises(StudyError, match="4 of 6 shards are missing"):
        join(plan, tmp_path / "small.nc")
    assert not (tmp_path / "small.nc").exists()


def test_parts_computed_apart_are_joined_to_the_same_dataset(study, dataset_file, tmp_path):
    plan, out = study.plan(block_points=24), tmp_path / "small.nc"
    for number in (3, 1, 2):
        compute(plan, out, Policy(workers=0, part=(number, 3)))
    join(plan, out)
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    assert list(tmp_path.iterdir()) == [out]


def test_what_is_computed_needs_no_cluster_and_a_killed_one_leaves_no_certificates(
    study, dataset_file, tmp_path
):
    plan, out = study.plan(block_points=24), tmp_path / "small.nc"
    compute(plan, out, Policy(workers=0, part=(1, 1)))
    left = folder_of(out) / ".certificates-killed.part"
    left.mkdir()
    (left / "key.pem").touch()

    def start():
        raise AssertionError("there is nothing to compute")

    compute(plan, out, Policy(cluster=start))
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    assert list(tmp_path.iterdir()) == [out]


def test_an_exception_costs_its_point_and_is_recorded(study, tmp_path, monkeypatch):
    from studies.running import evaluate

    original = evaluate.search

    def poisoned(names, scene, control, P):
        if "U" in names and str(scene.ends) == "clamped-pinned" and ((P == 0.2) & (scene.H == 0.12)).any():
            raise ZeroDivisionError("poison")
        return original(names, scene, control, P)

    monkeypatch.setattr(evaluate, "search", poisoned)
    with studies.run(study, out=tmp_path / "small.nc", workers=0) as dataset:
        failed = dataset["status"] == Status.FAILED
        assert failed.sum() == 1
        assert failed.sel(ends="clamped-pinned", H=0.12, P=0.2, state="U")
        assert dataset.sizes["failure"] == 1
        place = [int(dataset[f"failure_{axis}"][0]) for axis in ("ends", "H", "P", "state")]
        assert failed.values[tuple(place)]
        assert "poison" in str(dataset["failure_reason"].values[0])


def test_a_finished_study_is_opened_and_another_one_refused(study, dataset_file, monkeypatch):
    monkeypatch.setattr("studies.running.runner.compute", None)
    before = dataset_file.read_bytes()
    studies.run(study, out=dataset_file).close()
    wider = study.model_copy(update={"grid": study.grid.model_copy(update={"H": (0.04, 0.21)})})
    with pytest.raises(StudyError, match="holds another study"):
        studies.run(wider, out=dataset_file)
    assert dataset_file.read_bytes() == before


def test_outputs_that_cannot_be_written_are_refused_before_anything_runs(study, tmp_path):
    with pytest.raises(StudyError, match="no such folder"):
        is_done(study, tmp_path / "nowhere" / "small.nc")
    with pytest.raises(StudyError, match="is a folder"):
        is_done(study, tmp_path)
    foreign = tmp_path / "foreign.nc"
    foreign.write_text("my thesis")
    with pytest.raises(StudyError, match="cannot be read as netCDF"):
        is_done(study, foreign)
    xr.Dataset({"a": ("x", np.arange(3))}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(StudyError, match="no dataset of constrained-elastica"):
        is_done(study, tmp_path / "other.nc")
    assert foreign.read_text() == "my thesis"


def test_check_finds_what_was_changed(dataset_file, tmp_path):
    report, problems = studies.check(dataset_file, sample=20)
    assert problems == []
    assert any("20 grid points solved again" in line for line in report)

    def tampered(change):
        path = tmp_path / "tampered.nc"
        path.write_bytes(dataset_file.read_bytes())
        with opened(path, "a") as dataset:
            change(dataset)
        return path

    def stabilise(dataset):
        values = dataset["stability"][:]
        values[values == 1] = 0
        dataset["stability"][:] = values
        # A forger who also corrects the hash is found by solving again.

    path = tampered(stabilise)
    assert any("content_hash" in problem for problem in studies.check(path, sample=5)[1])
    digest = content_hash(path)
    with opened(path, "a") as dataset:
        dataset.setncattr("content_hash", digest)
    assert any("stability cannot be found again" in p for p in studies.check(path, sample=120)[1])

    path = tampered(lambda dataset: dataset.setncattr("study_id", "0" * 32))
    assert any("study_id" in problem for problem in studies.check(path, sample=5)[1])


def test_shards_and_datasets_of_other_numerics_are_not_reused(study, dataset_file, tmp_path, monkeypatch):
    plan, out = study.plan(block_points=60), tmp_path / "small.nc"
    compute(plan, out, Policy(workers=0, part=(1, 2)))
    assert len(find_shards(folder_of(out), plan.blocks, study.identity)) == 1
    monkeypatch.setattr("studies.design.request.NUMERICS_VERSION", 999)
    assert find_shards(folder_of(out), plan.blocks, study.identity) == {}
    with pytest.raises(StudyError, match="another version of the numerics"):
        is_done(study, dataset_file)


def test_files_of_others_in_the_shard_folder_survive(study, tmp_path):
    folder = folder_of(tmp_path / "small.nc")
    folder.mkdir()
    (folder / "notes.txt").write_text("precious")
    studies.run(study, out=tmp_path / "small.nc", workers=0).close()
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_check_reports_edited_summaries_and_labels(dataset_file, tmp_path):
    def edited(change):
        path = tmp_path / "edited.nc"
        path.write_bytes(dataset_file.read_bytes())
        with opened(path, "a") as dataset:
            change(dataset)
        digest = content_hash(path)
        with opened(path, "a") as dataset:
            dataset.setncattr("content_hash", digest)
        return studies.check(path, sample=5)[1]

    def count(dataset):
        dataset["stable_count"][:] = dataset["stable_count"][:] + 1

    def shift(dataset):
        dataset["H"][:] = dataset["H"][:] * 1.01

    assert any("stable_count" in problem for problem in edited(count))
    assert any("labels of H" in problem for problem in edited(shift))
    with pytest.raises(StudyError, match="energy missing"):
        edited(lambda dataset: dataset.renameVariable("energy", "vigour"))


def test_joining_opens_each_shard_twice_however_many_there_are(study, tmp_path, monkeypatch):
    """Once to see which states there are, once in its band of rows."""
    states, outputs = (
        study.states.model_copy(update={"names": ("0", "U"), "max_contacts": None}),
        {"shapes": 0},
    )
    small = study.model_copy(
        update={"states": states, "outputs": study.outputs.model_copy(update={**outputs, "eigenvalues": 0})}
    )
    plan, opened_paths = small.plan(block_points=6), []

    def counted(path, *mode):
        opened_paths.append(str(path))
        return opened(path, *mode)

    monkeypatch.setattr("studies.store.sources.opened", counted)
    monkeypatch.setattr("studies.store.layout.CHUNK_BYTES", 100)
    compute(plan, tmp_path / "small.nc", Policy(workers=0))
    assert len(plan.blocks) == 20
    assert sum(".shards" in path for path in opened_paths) == 2 * len(plan.blocks)
