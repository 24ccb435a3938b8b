"""What stands at an output, before, during and after a run."""

import errno
import fcntl
import os
import signal
import subprocess
import sys

import pytest
from end_to_end.outputs.tiny import HERE, PLAN, STUDY, names
from end_to_end.processes import elastica

import studies
from studies import StudyError
from studies.archive.keeping import add
from studies.running.lock import sole_writer
from studies.running.output import is_done
from studies.running.runner import compute
from studies.running.session import Policy
from studies.store.datasets import identify
from studies.store.shards import folder_of
from studies.whole_files import written_whole

TOML = """
[study]
name = "tiny"
[grid]
ends = ["clamped-clamped"]
H = [0.1]
P = [1.5]
[states]
names = ["0", "U"]
"""


def test_a_join_that_was_killed_leaves_nothing_after_the_next_run(out, nothing_is_computed):
    compute(PLAN, out, Policy(workers=0, part=(1, 1)))
    out.with_suffix(".json").write_text(STUDY.config_json)
    killed = """
import json, os, sys
from pathlib import Path
from studies import Study
from studies.store import joining
from studies.running.runner import join
joining.content_hash = lambda _: os.kill(os.getpid(), 9)
out = Path(sys.argv[1])
join(Study.from_dict(json.loads(out.with_suffix(".json").read_text())).plan(block_points=1), out)
"""
    for _ in range(2):
        process = subprocess.run([sys.executable, "-c", killed, str(out)], timeout=300)
        assert process.returncode == -signal.SIGKILL
        # That of the first is cleared away by the second.
        assert len(list(out.parent.glob(".tiny.nc.*.part"))) == 1
    others = {".tiny.nc.bak.0123abcd.part", ".other.nc.0123abcd.part", ".tiny.nc.part"}
    for name in others:
        out.with_name(name).touch()
    nothing_is_computed()
    compute(PLAN, out, HERE)
    assert names(out.parent) == {"tiny.nc", "tiny.json", *others}


def test_what_a_living_run_writes_is_not_cleared_away(out):
    folder = folder_of(out)
    folder.mkdir()
    with sole_writer(folder), written_whole(out) as temporary:
        with pytest.raises(StudyError, match="computes this study"):
            compute(PLAN, out, HERE)
        assert temporary.exists()


@pytest.mark.parametrize("links", [True, False])
def test_a_file_that_appears_during_the_run_is_kept_and_so_are_the_shards(
    out, monkeypatch, nothing_is_computed, links
):
    from studies.store import joining

    def seen(path):
        out.write_text("my thesis")
        return "0"

    def refused(*_):
        raise PermissionError(errno.EPERM, "no hard links here")

    monkeypatch.setattr(joining, "content_hash", seen)
    if not links:
        monkeypatch.setattr(os, "link", refused)
    with pytest.raises(StudyError, match=r"tiny\.nc: this file appeared while .*left as it is; move it away"):
        compute(PLAN, out, HERE)
    assert out.read_text() == "my thesis"
    assert len(names(folder_of(out))) == len(PLAN.blocks)
    monkeypatch.undo()
    nothing_is_computed()
    out.rename(out.with_name("thesis.txt"))
    if not links:
        monkeypatch.setattr(os, "link", refused)
    compute(PLAN, out, HERE)
    assert names(out.parent) == {"tiny.nc", "thesis.txt"}


def test_an_output_that_is_a_link_has_one_folder_of_shards_and_one_lock(out, tmp_path):
    (tmp_path / "far").mkdir()
    out.symlink_to(tmp_path / "far" / "data.nc")
    assert folder_of(out) == folder_of((tmp_path / "far" / "data.nc").resolve())
    compute(PLAN, out, HERE)
    assert out.is_symlink()
    assert names(tmp_path / "far") == {"data.nc"}
    assert is_done(STUDY, out)


def test_names_that_do_not_fit_are_refused_before_anything_is_computed(tmp_path, nothing_is_computed):
    nothing_is_computed()
    for length in (239, 245, 255, 300, 5000):
        out = tmp_path / ("n" * length + ".nc")
        with pytest.raises(StudyError, match=r"too long for what a run writes beside it.* choose a shorter"):
            studies.run(STUDY, out, workers=0)
    assert names(tmp_path) == set()


def test_the_longest_name_that_is_taken_is_written(tmp_path):
    out = tmp_path / ("n" * 237 + ".nc")
    assert not is_done(STUDY, out)
    compute(PLAN, out, HERE)
    assert names(tmp_path) == {out.name}


def test_paths_that_are_not_utf8_are_refused_before_anything_is_computed(tmp_path, nothing_is_computed):
    nothing_is_computed()
    folder = tmp_path / os.fsdecode(b"B\xfccher")
    folder.mkdir()
    for out in (folder / "tiny.nc", tmp_path / os.fsdecode(b"st\xfcdy.nc")):
        with pytest.raises(
            StudyError, match=r"\\xfc.*netCDF takes only paths that are text in UTF-8"
        ) as told:
            studies.run(STUDY, out, workers=0)
        str(told.value).encode()
        with pytest.raises(StudyError, match="netCDF takes only paths"):
            studies.open(out)
        with pytest.raises(StudyError, match="netCDF takes only paths"):
            compute(PLAN, out, HERE)
    (tmp_path / "link.nc").symlink_to(folder / "tiny.nc")
    with pytest.raises(StudyError, match="netCDF takes only paths"):
        studies.run(STUDY, tmp_path / "link.nc", workers=0)
    assert names(folder) == set()


def test_a_study_file_whose_name_is_not_utf8_is_computed_and_its_command_is_kept(tmp_path):
    toml = tmp_path / os.fsdecode(b"st\xfcdy.toml")
    toml.write_text(TOML)
    result = elastica("run", toml.name, "--workers", 0, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert r"st\xfcdy.toml" in identify(tmp_path / "tiny.nc")["command"]


def test_a_file_that_is_replaced_while_it_enters_a_catalog_is_refused(out, monkeypatch):
    from studies.archive import keeping

    studies.run(STUDY, out, workers=0).close()
    proved, original = out.read_bytes(), keeping._sha256

    def replacing(path):
        digest = original(path)
        out.with_name("new.nc").write_bytes(proved)
        os.replace(out.with_name("new.nc"), out)
        return digest

    catalogs = out.with_name("catalogs")
    catalogs.mkdir()
    monkeypatch.setattr(keeping, "_sha256", replacing)
    with pytest.raises(StudyError, match=r"tiny\.nc: this file was changed, or replaced by another, since"):
        add(catalogs, out)
    assert out.read_bytes() == proved
    assert names(catalogs) == set()


def test_a_file_that_another_program_writes_is_not_called_foreign(out):
    studies.run(STUDY, out, workers=0).close()
    with out.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        with pytest.raises(StudyError, match="another program has it open to write"):
            identify(out)
