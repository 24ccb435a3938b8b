"""One writer at a time: an OS lock, which dies with its process, and a record of who holds it.

The lock alone decides on one machine. Between machines it may not reach, so the record of another host is
believed until the user says that its run has ended. Jobs that compute different parts of one study may work
side by side.
"""

import errno
import fcntl
import json
import os
import socket
import stat
import time
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

import psutil

from studies.errors import StudyError
from studies.messages import note

STRANGE = "{}: a lock goes there, and this is no file; move it away"
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
PAUSE = 0.02


class Held(StudyError):
    """Another process holds a lock."""


@contextmanager
def sole_writer(folder, part=None, force=False):
    """Be the only process that computes a study, or one part of it.

    Parameters
    ----------
    folder : Path
        Where the shards are kept; the lock stays there until it is released.
    part : (int, int), optional
        The part i of n that this job computes; without it, everything.
    force : bool
        Take the lock of another host, whose run the user knows to have ended.

    Raises
    ------
    StudyError
        If another run holds the lock; says host, process and start.
    """
    path = folder / _name(part)
    descriptor = _seize(path, force)
    with _released(path, descriptor):
        for other in sorted(folder.glob("run*.lock")):
            if other != path and _conflict(part, other):
                _let_go(other, _seize(other, force))
        _sign(descriptor)
        yield


@contextmanager
def one_at_a_time(path, patience):
    """Be the only process that changes something for a moment; wait for the others to be done.

    Parameters
    ----------
    path : Path
        The lock; it exists only while somebody holds it.
    patience : float
        Seconds to wait.

    Raises
    ------
    StudyError
        If another process holds the lock all that time.
    """
    descriptor = _awaited(path, time.monotonic() + patience)
    with _released(path, descriptor):
        _sign(descriptor)
        yield


def _awaited(path, deadline):
    while True:
        try:
            return _seize(path, force=False)
        except Held:
            if time.monotonic() >= deadline:
                raise StudyError(
                    f"{path}: another process holds this lock; wait for it, or remove the lock if that "
                    "process has ended"
                ) from None
        time.sleep(PAUSE)


@contextmanager
def _released(path, descriptor):
    """Release a lock in the end."""
    try:
        yield
    finally:
        _let_go(path, descriptor)


def _let_go(path, descriptor):
    """Remove a lock; where its folder forbids that, it stays and says that nobody holds it."""
    try:
        # While it is locked, so that nobody else can hold the file that is removed.
        path.unlink(missing_ok=True)
    except OSError:
        os.truncate(descriptor, 0)
    os.close(descriptor)


def _sign(descriptor):
    """Record who holds the lock."""
    os.truncate(descriptor, 0)
    os.pwrite(descriptor, json.dumps(_this_process()).encode(), 0)
    with suppress(OSError):
        # Who reads it on this machine sees it anyway.
        os.fsync(descriptor)


def _name(part):
    return "run.lock" if part is None else "run-{}-of-{}.lock".format(*part)


def _conflict(part, other):
    """Whether the holder of another lock writes our shards, which other parts of one division do not."""
    return part is None or not other.name.endswith(f"-of-{part[1]}.lock")


def _seize(path, force):
    """A descriptor of the locked file, which is the one that bears the name."""
    while True:
        descriptor, ours = _opened(path)
        record = _record(descriptor)
        foreign = record is not None and record["host"] != socket.gethostname()
        locked = _locked(descriptor)
        if foreign and force:
            os.close(descriptor)
            _unlink(path)
            note(f"took over from process {record['pid']} on {record['host']}, as --force-unlock says")
        elif foreign or not locked or _is_alive(record):
            os.close(descriptor)
            raise Held(_refusal(path, record, foreign))
        elif not _bears_name(descriptor, path):
            os.close(descriptor)
        else:
            if record is not None:
                note(f"took over from process {record['pid']}, which ended before its work was done")
            if ours:
                return descriptor
            # What another user left is replaced, while it is locked.
            _unlink(path)
            os.close(descriptor)


def _opened(path):
    """A descriptor of the file of a lock, made if it is not there; and whether it can be written to.

    Raises
    ------
    StudyError
        If it cannot even be read, or something else has its name.
    """
    # Neither is a link followed nor does a pipe make us wait.
    flags = os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    try:
        try:
            descriptor, ours = os.open(path, flags | os.O_RDWR | os.O_CREAT, 0o666), True
        except PermissionError:
            descriptor, ours = os.open(path, flags | os.O_RDONLY), False
    except OSError as problem:
        if problem.errno in (errno.ELOOP, errno.EISDIR):
            raise StudyError(STRANGE.format(path)) from None
        raise StudyError(f"{path}: this lock cannot be opened ({problem.strerror})") from None
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise StudyError(STRANGE.format(path))
    return descriptor, ours


def _unlink(path):
    try:
        path.unlink(missing_ok=True)
    except OSError as problem:
        raise StudyError(
            f"{path}: the run that held this lock has ended, but you cannot remove it ({problem.strerror}); "
            "ask its owner to"
        ) from None


def _locked(descriptor):
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        # A file system without locks: the record decides alone.
        return True
    return True


def _bears_name(descriptor, path):
    """Whether the file is still the one of this name: its last holder may just have removed it."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _record(descriptor):
    """Who wrote the lock; None if nobody did, or died while writing."""
    try:
        record = json.loads(os.pread(descriptor, 4096, 0))
    except ValueError:
        return None
    complete = isinstance(record, dict) and record.keys() >= {"host", "boot", "pid", "started"}
    return record if complete else None


def _is_alive(record):
    """Whether the process of a record, written on this host, still runs."""
    if record is None or record["boot"] != _boot():
        return False
    try:
        return psutil.Process(record["pid"]).create_time() == record["started"]
    except psutil.Error:
        return False


def _this_process():
    return {
        "host": socket.gethostname(),
        "boot": _boot(),
        "pid": os.getpid(),
        "started": psutil.Process().create_time(),
    }


def _boot():
    """Identity of this start of the machine, where the system tells."""
    return BOOT_ID.read_text().strip() if BOOT_ID.exists() else ""


def _refusal(path, record, foreign):
    if record is None:
        return f"{path}: another run has just begun to compute this study; wait for it"
    start = datetime.fromtimestamp(record["started"], UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    who = f"process {record['pid']} on {record['host']}, started {start}"
    if foreign:
        return f"{path}: {who}, computes this study; if it has ended, give --force-unlock"
    return f"{path}: {who}, computes this study; wait for it or stop it"
