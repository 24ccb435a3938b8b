"""A study grows: what a dataset has is used again, and datasets join, without a value changing."""

import copy
import json
import os
import shutil

import pytest
from click.testing import CliRunner
from end_to_end.conftest import CONTENT

import studies
from elastica import Status
from studies import Study, StudyError
from studies.command_line import main
from studies.design.request import NUMERICS_VERSION
from studies.running import runner, session
from studies.running.merging import merge
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.files import opened


def part(**axes):
    content = copy.deepcopy(CONTENT)
    content["outputs"] = {"eigenvalues": 2}
    content["grid"] = {"ends": ["clamped-clamped"], "H": [0.08, 0.12], "P": [1.8, 3.4, 5.0]} | axes
    return Study.from_dict(content)


WHOLE = part(ends=["clamped-clamped", "clamped-pinned"], H=[0.08, 0.1, 0.12], P=[1.8, 2.6, 3.4, 5.0, 9.0])


def compute(study, out, **policy):
    studies.run(study, out, workers=0, **policy).close()
    return out


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return compute(WHOLE, tmp_path_factory.mktemp("whole") / "whole.nc")


def assert_identical(grown, fresh):
    assert identify(grown)["content_hash"] == identify(fresh)["content_hash"]
    assert not os.path.exists(f"{grown}.shards")


@pytest.mark.parametrize(
    ("old", "computed"),
    [
        (part(), 24),
        (part(P=[0.5, 1.8, 9.0]), 26),
        (part(ends=["clamped-pinned"], H=[0.1], P=[2.6]), 29),
        (part(H=[0.3]), 30),
        (WHOLE.model_copy(update={"study": WHOLE.study.model_copy(update={"name": "other"})}), 0),
    ],
)
def test_points_that_are_there_are_not_computed_again(whole, tmp_path, monkeypatch, old, computed):
    narrow = compute(old, tmp_path / "narrow.nc")
    points, gaps, original = [], [], session.compute_block

    def counted(block, job):
        (points if job.task == WHOLE.task else gaps).append(block.points)
        return original(block, job)

    monkeypatch.setattr(session, "compute_block", counted)
    wide = compute(WHOLE, tmp_path / "wide.nc", reuse=narrow)
    assert sum(points) == computed
    assert sum(gaps) <= 30 - computed
    assert_identical(wide, whole)
    assert identify(wide)["reused"] == identify(narrow)["study_id"]
    assert identify(wide)["reused_versions"] == identify(narrow)["library_versions"]


def changed(study, **tables):
    content = study.model_dump(mode="json", exclude_none=True)
    return Study.from_dict(content | tables)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ({"names": ["0", "U", "U:2", "U-"]}, {"names": ["0", "U", "U:2", "U-"]}),
        ({"names": ["0", "U"]}, {"names": ["0", "U", "Ua", "U-"]}),
        ({"max_contacts": 0}, {"max_contacts": 1}),
        ({"names": ["U"]}, {"max_contacts": 0}),
    ],
)
def test_states_that_the_old_dataset_lacks_are_computed_at_its_points(tmp_path, capsys, old, new):
    narrow = compute(changed(part(), states=old), tmp_path / "narrow.nc")
    wide = compute(changed(WHOLE, states=new), tmp_path / "wide.nc", reuse=narrow)
    fresh = compute(changed(WHOLE, states=new), tmp_path / "fresh.nc")
    assert_identical(wide, fresh)
    told = capsys.readouterr().err
    assert ("computed at 6 points there" in told) == (old.keys() == new.keys() and old != new)
    assert ("so all points of the study are computed" in told) == (old.keys() != new.keys())


def test_points_without_the_outputs_that_are_wanted_are_computed_again(whole, tmp_path, capsys):
    narrow = compute(changed(part(), outputs={"eigenvalues": 1}), tmp_path / "narrow.nc")
    assert_identical(compute(WHOLE, tmp_path / "wide.nc", reuse=narrow), whole)
    assert "narrow.nc: eigenvalues of the study are not there, so all its points are computed" in (
        capsys.readouterr().err
    )


def test_a_merged_dataset_with_holes_is_used_again(whole, tmp_path):
    first = compute(part(), tmp_path / "a.nc")
    second = compute(
        changed(part(ends=["clamped-pinned"], H=[0.1]), states={"max_contacts": 0}), tmp_path / "b.nc"
    )
    merge([first, second], tmp_path / "c.nc")
    assert_identical(compute(WHOLE, tmp_path / "wide.nc", reuse=tmp_path / "c.nc"), whole)


def test_parts_merge_to_the_dataset_of_the_whole(whole, tmp_path):
    first = compute(part(ends=list(WHOLE.grid.ends), H=[0.08, 0.12], P=list(WHOLE.grid.P)), tmp_path / "a.nc")
    second = compute(part(ends=list(WHOLE.grid.ends), H=[0.1, 0.12], P=list(WHOLE.grid.P)), tmp_path / "b.nc")
    files = [str(first), str(second), "-o", str(tmp_path / "c.nc")]
    result = CliRunner().invoke(main, ["merge", *files, "--fill"])
    assert result.exit_code == 0, result.output
    assert_identical(tmp_path / "c.nc", whole)
    assert identify(tmp_path / "c.nc")["study_id"] == WHOLE.study_id
    report, problems = studies.check(tmp_path / "c.nc", sample=30)
    assert (problems, report[-1]) == ([], "  good")


def test_merging_computes_nothing_unless_told_and_says_what_it_would(tmp_path, monkeypatch, capsys):
    few = compute(changed(part(H=[0.05]), states={"max_contacts": 1}), tmp_path / "few.nc")
    more = compute(changed(part(H=[0.04]), states={"max_contacts": 2}), tmp_path / "more.nc")
    capsys.readouterr()
    arguments = ["merge", str(few), str(more), "-o"]
    with monkeypatch.context() as nothing:
        nothing.setattr(session, "compute_block", None)
        result = CliRunner().invoke(main, [*arguments, str(tmp_path / "c.nc")])
    assert result.exit_code == 0, result.output
    lacking = identify(tmp_path / "c.nc")["states_not_computed"].split()
    assert {"UD", "UU", "UU-"} & set(lacking)
    # At the other points too: what is solved nowhere there is left out, and was perhaps inadmissible.
    assert f"{' '.join(lacking)}: not computed at 6 of 6 points, whose datasets lack them" in result.stderr
    assert "--fill (in Python fill=True) computes them, in less than a second of work" in result.stderr

    assert studies.check(tmp_path / "c.nc", sample=6)[1] == []
    with studies.open(tmp_path / "c.nc") as merged:
        words = [name for name in merged["state"].values if len(name.strip("a-").partition(":")[0]) == 2]
        assert words
        assert (merged["status"].sel(state=words, H=0.05) == Status.NOT_COMPUTED).all()
        assert (merged["stability"].sel(state=words, H=0.05) == -1).all()
        assert (merged["stable_count"] >= 0).all()
        studies.plot.chart(merged)
        united = Study.from_dict(json.loads(merged.attrs["config_json"]))
    with pytest.raises(StudyError, match=r"or states there, are not computed here; choose another output"):
        runner.is_done(united, tmp_path / "c.nc")

    fresh = compute(united, tmp_path / "fresh.nc")
    assert_identical(compute(united, tmp_path / "again.nc", reuse=tmp_path / "c.nc"), fresh)
    result = CliRunner().invoke(main, [*arguments, str(tmp_path / "filled.nc"), "--fill"])
    assert result.exit_code == 0, result.output
    assert_identical(tmp_path / "filled.nc", fresh)
    assert "states_not_computed" not in identify(tmp_path / "filled.nc")


def test_a_state_that_was_searched_in_one_dataset_only_is_not_lost(tmp_path):
    """It is solved nowhere there, so it is no label of the dataset; where the other is, it is unknown."""
    few = compute(changed(part(), states={"max_contacts": 0}), tmp_path / "few.nc")
    more = compute(changed(part(H=[0.3], P=[1.0]), states={"max_contacts": 1}), tmp_path / "more.nc")
    merge([few, more], tmp_path / "c.nc")
    with studies.open(tmp_path / "c.nc") as merged:
        assert "U" not in merged["state"]
        united = Study.from_dict(json.loads(merged.attrs["config_json"]))
    assert "U" in identify(tmp_path / "c.nc")["states_not_computed"].split()
    report, problems = studies.check(tmp_path / "c.nc", sample=20)
    assert (problems, report[-1]) == ([], "  good as far as it is computed")
    fresh = compute(united, tmp_path / "fresh.nc")
    assert_identical(compute(united, tmp_path / "again.nc", reuse=tmp_path / "c.nc"), fresh)


def test_points_that_no_part_holds_are_not_computed(tmp_path):
    first = compute(part(), tmp_path / "a.nc")
    second = compute(part(ends=["clamped-pinned"], H=[0.1]), tmp_path / "b.nc")
    merge([first, second], tmp_path / "c.nc")
    with studies.open(tmp_path / "c.nc") as merged:
        held = (merged["status"] != Status.NOT_COMPUTED).any("state")
        assert int(held.sum()) == 9
        assert int(held.sel(ends="clamped-pinned", H=0.1).sum()) == 3
        assert merged.attrs["points_not_computed"] == 9
        assert (merged["preferred_state"].where(~held, -1) == -1).all()
    report, problems = studies.check(tmp_path / "c.nc", sample=18)
    assert (problems, report[-1]) == ([], "  good as far as it is computed")
    with pytest.raises(StudyError, match="not computed here"):
        study = Study.from_dict(json.loads(identify(tmp_path / "c.nc")["config_json"]))
        runner.is_done(study, tmp_path / "c.nc")


def altered(path, copy_to, change):
    copy_to.write_bytes(path.read_bytes())
    with opened(copy_to, "a") as dataset:
        change(dataset)
    digest = content_hash(copy_to)
    with opened(copy_to, "a") as dataset:
        dataset.setncattr("content_hash", digest)
    return copy_to


def test_conflicts_and_other_numerics_are_refused_with_names(tmp_path):
    first = compute(part(), tmp_path / "a.nc")

    def bend(dataset):
        row = list(dataset["status"][0, 1, 2]).index(Status.SOLVED)
        dataset["energy"][0, 1, 2, row] = dataset["energy"][0, 1, 2, row] + 1e-3

    other = altered(first, tmp_path / "b.nc", bend)
    with pytest.raises(
        StudyError, match=r"differs from .*a.nc in energy of .* at clamped-clamped H=0.12 P=5$"
    ):
        merge([first, other], tmp_path / "c.nc")
    newer = altered(first, tmp_path / "d.nc", lambda dataset: dataset.setncattr("numerics_version", 999))
    with pytest.raises(StudyError, match=f"numerics_version is 999 there, here {NUMERICS_VERSION}"):
        merge([first, newer], tmp_path / "c.nc")
    with pytest.raises(StudyError, match=f"numerics_version is 999 there, here {NUMERICS_VERSION}"):
        compute(WHOLE, tmp_path / "wide.nc", reuse=newer)
    damaged = tmp_path / "e.nc"
    damaged.write_bytes(first.read_bytes()[:-300])
    with pytest.raises(StudyError, match=r"e\.nc"):
        merge([first, damaged], tmp_path / "c.nc")
    assert not (tmp_path / "c.nc").exists()


def test_array_jobs_take_what_is_there_and_so_does_their_reduction(whole, tmp_path):
    narrow = compute(part(), tmp_path / "narrow.nc")
    out, toml = tmp_path / "wide.nc", tmp_path / "whole.toml"
    toml.write_text(
        """
        study.name = "small"
        states.max_contacts = 1
        outputs.eigenvalues = 2
        [grid]
        ends = ["clamped-clamped", "clamped-pinned"]
        H = [0.08, 0.1, 0.12]
        P = [1.8, 2.6, 3.4, 5.0, 9.0]
        """
    )
    common = [str(toml), "-o", str(out), "--reuse", str(narrow)]
    for options in (
        ["run", "--shard", "1/2", "--workers", "0"],
        ["run", "--shard", "2/2", "--workers", "0"],
        ["reduce"],
    ):
        result = CliRunner().invoke(main, [*options, *common])
        assert result.exit_code == 0, result.output
    assert_identical(out, whole)


def replaced(old, other):
    os.replace(shutil.copy(other, old.with_name("new.nc")), old)


def overwritten(old, other):
    """In place, with the times that it had."""
    times = old.stat()
    old.write_bytes(other.read_bytes())
    os.utime(old, ns=(times.st_atime_ns, times.st_mtime_ns))


def removed(old, _):
    old.unlink()


def led_elsewhere(old, other):
    old.unlink()
    old.symlink_to(other)


@pytest.mark.parametrize(
    ("moment", "change"),
    [
        *(("joining", change) for change in (replaced, overwritten, removed, led_elsewhere)),
        *((moment, replaced) for moment in ("hashing", "planning", "computing")),
        ("reading", overwritten),
    ],
)
def test_nothing_is_taken_of_a_file_that_is_not_the_one_proved(tmp_path, monkeypatch, change, moment):
    """Whenever it is changed, nothing is written; what is computed is kept, and serves when it is back."""
    from studies.store import reuse, sources

    small = changed(part(), states={"names": ["0", "U"]}, outputs={})
    wide = changed(small, grid={"ends": ["clamped-clamped"], "H": [0.08, 0.12], "P": [1.8, 3.4, 5.0, 6.0]})
    proved, kept = compute(small, tmp_path / "old.nc"), tmp_path / "kept.nc"
    shutil.copy(proved, kept)

    def bend(dataset):
        dataset["energy"][:] = dataset["energy"][:] * 2

    other = altered(proved, tmp_path / "other.nc", bend)
    done = []

    def at(module, name, when=lambda *_: True):
        original = getattr(module, name)

        def changing(*arguments):
            result = original(*arguments)
            if when(*arguments) and not done:
                done.append(change(proved, other))
            return result

        monkeypatch.setattr(module, name, changing)

    if moment == "planning":
        at(reuse, "borrow")
        monkeypatch.setattr(runner, "borrow", reuse.borrow)
    elif moment == "computing":
        at(session, "compute_block")
    elif moment == "joining":
        at(runner, "survey")
    elif moment == "reading":
        at(sources, "read_points")
    else:
        at(reuse, "content_hash")
        monkeypatch.setattr(reuse, "read_apart", lambda function, *arguments: function(*arguments))
    with pytest.raises(StudyError, match=r"old\.nc: this file was changed, or replaced by another, since"):
        compute(wide, tmp_path / "wide.nc", reuse=proved)
    assert done == [None]
    assert not (tmp_path / "wide.nc").exists()
    monkeypatch.undo()
    blocks, original = [], session.compute_block
    monkeypatch.setattr(session, "compute_block", lambda *some: blocks.append(some) or original(*some))
    proved.unlink(missing_ok=True)
    os.replace(kept, proved)
    grown = compute(wide, tmp_path / "wide.nc", reuse=proved)
    assert len(blocks) == (moment == "hashing")
    assert_identical(grown, compute(wide, tmp_path / "fresh.nc"))
