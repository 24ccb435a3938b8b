"""Pipes, folders, links and devices where a run expects its files."""

import os

import pytest
from end_to_end.outputs.tiny import HERE, PART, PLAN, STUDY, names

from studies import StudyError
from studies.running.lock import one_at_a_time
from studies.running.output import is_done
from studies.running.runner import compute, join
from studies.store.shards import PROBE, folder_of

IMPOSTORS = {
    "pipe": os.mkfifo,
    "folder": os.mkdir,
    "dangling link": lambda path: os.symlink("nowhere", path),
    "link to itself": lambda path: os.symlink(path.name, path),
    "device": lambda path: os.symlink("/dev/zero", path),
    "empty file": lambda path: path.touch(),
}


@pytest.fixture(params=IMPOSTORS)
def impostor(request):
    return request.param, IMPOSTORS[request.param]


def test_what_is_no_file_in_place_of_shards_is_computed_again(out, impostor, capsys):
    kind, make = impostor
    compute(PLAN, out, PART)
    folder = folder_of(out)
    shards = sorted(folder.iterdir())
    shards[0].unlink()
    make(shards[0])
    with pytest.raises(StudyError, match="3 of 4 shards are missing"):
        join(PLAN, out)
    compute(PLAN, out, HERE)
    assert "1 shards are damaged" in capsys.readouterr().err
    assert is_done(STUDY, out)
    left = names(folder) if folder.exists() else set()
    assert left == ({shards[0].name} if kind == "folder" else set())


def test_what_is_no_file_in_place_of_shards_of_others_is_passed_over(out, impostor, capsys):
    _, make = impostor
    folder = folder_of(out)
    folder.mkdir()
    make(folder / f"{'-'.join(['000000'] * 5)}.{'a' * 16}.{'0' * 32}.nc")
    compute(PLAN, out, HERE)
    assert "1 shards there are not used, they are of another study or of other versions" in (
        capsys.readouterr().err
    )
    assert is_done(STUDY, out)


def test_what_is_no_file_in_place_of_the_lock_is_one_sentence(out, impostor, nothing_is_computed):
    kind, make = impostor
    folder = folder_of(out)
    folder.mkdir()
    make(folder / "run.lock")
    if kind == "empty file":
        compute(PLAN, out, HERE)
        return
    nothing_is_computed()
    with pytest.raises(StudyError, match="a lock goes there, and this is no file; move it away"):
        compute(PLAN, out, HERE)
    assert names(folder) == {"run.lock"}


def test_what_is_no_file_in_place_of_the_lock_of_an_index_is_told_at_once(tmp_path):
    os.mkfifo(tmp_path / "index.lock")
    with pytest.raises(StudyError, match="this is no file"), one_at_a_time(tmp_path / "index.lock", 1e6):
        pass


def test_what_is_no_folder_in_place_of_that_of_the_shards_is_one_sentence(out, impostor, nothing_is_computed):
    kind, make = impostor
    make(folder_of(out))
    if kind == "folder":
        return
    nothing_is_computed()
    with pytest.raises(StudyError, match="this is no folder; move it away"):
        compute(PLAN, out, HERE)


def test_what_is_no_file_among_what_runs_leave_costs_nothing(out, impostor):
    _, make = impostor
    folder = folder_of(out)
    folder.mkdir()
    for name in (f"{PROBE}0", ".000000-000000-000000-000001-000001.01234567.part", "notes"):
        make(folder / name)
    make(out.with_name(".tiny.nc.01234567.part"))
    compute(PLAN, out, HERE)
    assert is_done(STUDY, out)
    assert "notes" in names(folder)


def test_what_is_no_file_in_place_of_the_output_is_refused(out, impostor):
    kind, make = impostor
    make(out)
    if kind == "dangling link":
        compute(PLAN, out, HERE)
        return
    with pytest.raises(StudyError, match=r"tiny\.nc"):
        compute(PLAN, out, HERE)
