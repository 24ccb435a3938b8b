"""What stands at an output, before, during and after a run, and on which file systems."""

import errno
import fcntl
import json
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import netCDF4
import pytest
from end_to_end.processes import elastica

import studies
from studies import Study, StudyError
from studies.archive.archive import add
from studies.archive.catalog import INDEX
from studies.running.lock import one_at_a_time, sole_writer
from studies.running.output import is_done
from studies.running.runner import compute, join
from studies.running.session import Policy
from studies.store.datasets import identify
from studies.store.shards import PROBE, folder_of
from studies.whole_files import sync, written_whole

STUDY = Study.from_dict(
    {
        "study": {"name": "tiny"},
        "grid": {"ends": ["clamped-clamped"], "H": [0.05, 0.1], "P": [1.5, 3.0]},
        "states": {"names": ["0", "U"]},
    }
)
PLAN = STUDY.plan(block_points=1)
HERE, PART = Policy(workers=0), Policy(workers=0, part=(1, 2))
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


@pytest.fixture
def out(tmp_path):
    return tmp_path / "tiny.nc"


@pytest.fixture
def nothing_is_computed(monkeypatch):
    def never(*_):
        raise AssertionError("a block is computed")

    return lambda: monkeypatch.setattr("studies.running.session.compute_block", never)


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("umask", [0o002, 0o022, 0o027, 0o077])
def test_whatever_is_written_has_the_permissions_that_the_umask_leaves(out, umask):
    catalogs = out.with_name("catalogs")
    before = os.umask(umask)
    try:
        compute(PLAN, out, PART)
        folder = folder_of(out)
        with sole_writer(folder):
            modes = [path.stat().st_mode for path in folder.iterdir()]
            assert (folder / "run.lock").exists()
        of_folder = folder.stat().st_mode
        compute(PLAN, out, HERE)
        catalogs.mkdir()
        add(catalogs, out)
        modes += [path.stat().st_mode for path in catalogs.iterdir()]
    finally:
        os.umask(before)
    assert names(catalogs) == {"tiny.nc", INDEX}
    assert {stat.S_IMODE(mode) for mode in modes} == {0o666 & ~umask}
    assert stat.S_IMODE(of_folder) & 0o777 == 0o777 & ~umask


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
    from studies.archive import archive

    studies.run(STUDY, out, workers=0).close()
    proved, original = out.read_bytes(), archive._sha256

    def replacing(path):
        digest = original(path)
        out.with_name("new.nc").write_bytes(proved)
        os.replace(out.with_name("new.nc"), out)
        return digest

    catalogs = out.with_name("catalogs")
    catalogs.mkdir()
    monkeypatch.setattr(archive, "_sha256", replacing)
    with pytest.raises(StudyError, match=r"tiny\.nc: this file was changed, or replaced by another, since"):
        add(catalogs, out)
    assert out.read_bytes() == proved
    assert names(catalogs) == set()


def no_locks(monkeypatch, number):
    def refused(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refused)


WITHOUT_LOCKS = [errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP]


@pytest.mark.parametrize("number", WITHOUT_LOCKS)
def test_without_locks_a_run_goes_on_and_the_record_keeps_others_out(out, monkeypatch, number):
    no_locks(monkeypatch, number)
    folder = folder_of(out)
    folder.mkdir()
    refusal = f"process {os.getpid()} on .* computes this study"
    with sole_writer(folder), pytest.raises(StudyError, match=refusal):
        compute(PLAN, out, HERE)
    compute(PLAN, out, HERE)
    assert names(out.parent) == {"tiny.nc"}


@pytest.mark.parametrize("number", WITHOUT_LOCKS)
def test_where_HDF5_cannot_lock_the_remedy_is_told_before_anything_is_computed(
    out, monkeypatch, nothing_is_computed, number
):
    original = netCDF4.Dataset

    def as_HDF5(path, mode="r", **options):
        if mode == "w" and "memory" not in options:
            raise PermissionError(errno.EACCES, "Permission denied")
        return original(path, mode, **options)

    nothing_is_computed()
    no_locks(monkeypatch, number)
    monkeypatch.setattr(netCDF4, "Dataset", as_HDF5)
    with pytest.raises(StudyError, match=r"no locks .* set HDF5_USE_FILE_LOCKING=FALSE"):
        compute(PLAN, out, HERE)
    assert names(out.parent) == set()


def test_a_file_that_another_program_writes_is_not_called_foreign(out):
    studies.run(STUDY, out, workers=0).close()
    with out.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        with pytest.raises(StudyError, match="another program has it open to write"):
            identify(out)


@pytest.mark.parametrize("number", [errno.EINVAL, errno.EBADF, errno.ENOTSUP])
def test_a_file_system_that_cannot_sync_folders_or_change_permissions_is_good_enough(
    out, monkeypatch, number
):
    original = os.fsync

    def only_files(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        original(descriptor)

    def refused(*_):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "fsync", only_files)
    monkeypatch.setattr(os, "chmod", refused)
    monkeypatch.setattr(os, "fchmod", refused)
    compute(PLAN, out, HERE)
    assert names(out.parent) == {"tiny.nc"}


def test_a_disk_that_fails_to_sync_is_not(tmp_path, monkeypatch):
    def broken(_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "fsync", broken)
    with pytest.raises(OSError, match="Input/output error"):
        sync(tmp_path)


def others_lock(path, monkeypatch):
    """The lock of a run of another user that was killed, which may be read and not be written to."""
    theirs = json.dumps({"host": os.uname().nodename, "boot": "before", "pid": 7, "started": 1.7e9})
    path.write_text(theirs)
    original = os.open

    def guarded(name, flags, *mode, **options):
        writes = flags & (os.O_RDWR | os.O_WRONLY)
        if writes and name == path and path.exists() and path.read_text() == theirs:
            raise PermissionError(errno.EACCES, "Permission denied", str(name))
        return original(name, flags, *mode, **options)

    monkeypatch.setattr(os, "open", guarded)


def test_a_colleague_goes_on_with_a_run_that_was_killed(out, monkeypatch, capsys):
    folder = folder_of(out)
    folder.mkdir()
    others_lock(folder / "run.lock", monkeypatch)
    compute(PLAN, out, HERE)
    assert capsys.readouterr().err.count("took over from process 7, which ended") == 1
    assert names(out.parent) == {"tiny.nc"}


def test_a_lock_of_another_user_in_a_folder_of_theirs_is_one_sentence(out, monkeypatch):
    folder = folder_of(out)
    folder.mkdir()
    others_lock(folder / "run.lock", monkeypatch)

    def refused(path, missing_ok=False):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr("pathlib.Path.unlink", refused)
    refusal = r"has ended, but you cannot remove it .*; ask its owner"
    with pytest.raises(StudyError, match=refusal), sole_writer(folder):
        pass


def test_where_nothing_may_be_removed_the_dataset_is_written_and_one_line_told(out, monkeypatch, capsys):
    """As in a folder like /tmp, of what another user left there."""
    folder = folder_of(out)
    compute(PLAN, out, PART)
    original = Path.unlink

    def guarded(path, missing_ok=False):
        if path.parent == folder:
            raise PermissionError(errno.EPERM, "Operation not permitted")
        original(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", guarded)
    compute(PLAN, out, HERE)
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "cannot be removed (Operation not permitted), nor can 3 more there; remove it by hand" in told
    assert is_done(STUDY, out)
    assert (folder / "run.lock").read_text() == ""
    monkeypatch.undo()
    compute(PLAN, out, HERE)
    assert names(out.parent) == {"tiny.nc"}


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
