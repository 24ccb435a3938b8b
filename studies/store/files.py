"""netCDF files: how they are opened, and what is done about damaged ones.

netCDF-C and HDF5 are not thread-safe even on different files, so all access of a process goes through one
lock.

Not here: what the variables mean (`schema`), how they are laid out (`layout`), whether they are those of a
dataset (`datasets`), how a file gets its name (`whole_files`).
"""

import errno
import fcntl
import os
from contextlib import contextmanager
from pathlib import Path

import netCDF4
import numpy as np
import psutil

from studies.errors import StudyError
from studies.messages import readable_path
from studies.sandbox import Lost, call
from studies.store.access import ACCESS
from studies.store.layout import CHUNK_BYTES

READING_SECONDS, READING_SPEED = 30.0, 10e6
"""A file that takes longer to read, given its bytes, makes the library loop."""
READING_MEMORY = 1 << 30
"""Bytes that reading a file may take beyond its own size: whole chunks, and the flags of all points."""
READING_FAILS = (OSError, RuntimeError, ValueError, KeyError, AttributeError, IndexError, MemoryError)
"""What netCDF4 and xarray raise on damaged files."""
# Chunks are written and read whole: the 64 MB that netCDF keeps of each variable would only fill memory.
netCDF4.set_chunk_cache(CHUNK_BYTES)


def refuse_path(path):
    """Refuse a path that netCDF cannot take.

    Raises
    ------
    StudyError
        If its bytes are no text in UTF-8.
    """
    try:
        os.path.realpath(path).encode()
    except UnicodeEncodeError:
        raise StudyError(
            f"{readable_path(os.path.realpath(path))}: netCDF takes only paths that are text in UTF-8, and "
            "this is not; rename the file or its folder"
        ) from None


def why_unlockable(path):
    """Why HDF5, which locks every file that it opens, cannot lock this one; nothing if it can.

    Its own messages ("Permission denied", "Unknown file format") do not tell.
    """
    try:
        with Path(path).open("rb") as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return "; another program has it open to write"
    except OSError as problem:
        if problem.errno in (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP):
            return (
                f"; this file system has no locks ({problem.strerror}), so set HDF5_USE_FILE_LOCKING=FALSE "
                "in the environment"
            )
    return ""


@contextmanager
def opened(path, mode="r"):
    """A netCDF4 dataset that gives plain arrays, under the lock of this process.

    Raises
    ------
    StudyError
        If what is read turns out to be damaged.
    """
    with ACCESS:
        dataset = netCDF4.Dataset(path, mode)
        try:
            dataset.set_auto_mask(False)
            dataset.set_auto_chartostring(False)
            yield dataset
        except READING_FAILS as problem:
            if mode != "r" or not str(problem).startswith("NetCDF:"):
                raise
            raise StudyError(f"{path}: the file is damaged ({problem})") from None
        finally:
            dataset.close()


@contextmanager
def as_damage_error(path):
    """Errors of reading a file of unknown health, here or in another process, as one sentence.

    Raises
    ------
    StudyError
    """
    try:
        yield
    except StudyError:
        raise
    except (*READING_FAILS, Lost) as problem:
        raise StudyError(f"{path}: the file is damaged ({problem})") from None


def mark_of(path):
    """What a file does not share with any other that has its path later, nor with itself once it is changed.

    None if there is no file.
    """
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def refuse_more_than_memory(path, variables):
    """Refuse to read variables that would not fit; a small file may declare any size.

    Raises
    ------
    StudyError
    """
    size = sum(variable.size * np.dtype(variable.dtype).itemsize for variable in variables)
    if size > psutil.virtual_memory().available:
        raise StudyError(
            f"{path}: its values need {size / 1e9:,.3g} GB of memory, more than this machine has free; use a "
            "larger one, or select some with studies.open"
        )


def read_labels(variable, path):
    """Labels of a coordinate, characters joined to text.

    Raises
    ------
    StudyError
        If they are no text in UTF-8.
    """
    values = variable[:]
    if values.dtype.kind == "O":
        return values.astype(str)
    if values.dtype.kind != "S":
        return values
    try:
        return np.array([row.tobytes().rstrip(b"\0").decode() for row in values])
    except UnicodeDecodeError:
        raise StudyError(f"{path}: the labels of {variable.name} are no text; the file is damaged") from None


def read_apart(function, path, *arguments):
    """Read a file of unknown health or origin in another process, which has a limit of time and of memory.

    Raises
    ------
    Lost
        If the process did not survive it.
    """
    size = Path(path).stat().st_size
    limit = READING_SECONDS + size / READING_SPEED
    return call(function, path, *arguments, limit=limit, memory=READING_MEMORY + size)
