"""File systems without locks, links or permissions, and files of other users."""

import errno
import fcntl
import json
import os
import stat
from pathlib import Path

import netCDF4
import pytest
from end_to_end.outputs.tiny import HERE, PART, PLAN, STUDY, names

from studies import StudyError
from studies.archive.catalog import INDEX
from studies.archive.keeping import add
from studies.running.lock import sole_writer
from studies.running.output import is_done
from studies.running.runner import compute
from studies.store.shards import folder_of
from studies.whole_files import sync


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
