"""netCDF files: how they are opened, identified and hashed.

netCDF-C and HDF5 are not thread-safe even on different files, so all access of a process goes through one
lock. Not here: what the variables mean (`schema`), how they are laid out (`layout`), how a file gets its name
(`whole_files`).
"""

import errno
import fcntl
import hashlib
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import netCDF4
import numpy as np
import psutil

from studies.errors import StudyError
from studies.kinds import MOST_NEEDED, refuse_other
from studies.messages import readable_path
from studies.sandbox import Lost, call
from studies.schema import FORMAT_VERSION, STATES_NOT_COMPUTED, TRANSITIONS_FAILED
from studies.store.access import ACCESS
from studies.store.layout import CHUNK_BYTES
from studies.store.structure import MEANING, fault

if TYPE_CHECKING:
    from xarray import Dataset

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


def content_hash(path):
    """Hash of what a file holds; see `hash_values`.

    Reads every value, so damage that the checksums of the file reveal raises here.
    """
    with opened(path) as dataset:
        return hash_values(dataset)


def hash_values(dataset):
    """SHA-256 of what an open dataset says, whoever wrote it.

    Covers what was asked (the numerics, what is prescribed, the states looked for), where no transitions
    could be found, which states were not looked for everywhere, and every variable: its name, dimensions,
    type, labels and values, all NaN alike and both zeros, and since format 2 its units and the meanings of
    its flags; attributes that would change what a reader makes of the values no dataset may have
    (`structure`). Does not cover how the values are stored (compression, chunks, byte order), texts for
    readers, and the origin (versions, times, host).

    It proves that a file is whole, not who wrote it: whoever edits one can compute it again. What the values
    are worth shows when they are solved again, as `elastica check` does with some of them.
    """
    digest = hashlib.sha256()
    first_format = getattr(dataset, "format_version", 1) == 1
    for name in ("numerics_id", "control", "states_searched"):
        digest.update(f"{name} {getattr(dataset, name, '')}".encode())
    for name in (TRANSITIONS_FAILED, STATES_NOT_COMPUTED):
        if name in dataset.ncattrs():
            digest.update(f"{name} {dataset.getncattr(name)}".encode())
    for name in sorted(dataset.variables):
        variable = dataset.variables[name]
        dimensions, dtype, shape, bands = _contents(variable)
        digest.update(f"{name} {dimensions} {dtype.str[1:]} {shape}".encode())
        for key in () if first_format else MEANING:
            if key in variable.ncattrs():
                digest.update(f"{key} {np.asarray(variable.getncattr(key)).tolist()}".encode())
        for band in bands:
            values = np.ascontiguousarray(band)
            if values.dtype.kind == "f":
                values = np.where(np.isnan(values), np.nan, values + 0.0)
            digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def _contents(variable):
    """Dimensions, type, shape and values, in bands; of text the characters, however it is stored."""
    if variable.dtype is not str:
        bands = (variable[slab] for slab in _bands(variable))
        return variable.dimensions, np.dtype(variable.dtype), variable.shape, bands
    encoded = [text.encode() for text in np.ravel(variable[:])]
    width = max(1, *map(len, encoded), 1)
    characters = np.array(encoded, f"S{width}").view("S1").reshape(*variable.shape, width)
    return (*variable.dimensions, f"string{width}"), characters.dtype, characters.shape, [characters]


def _bands(variable):
    """Indices of what is read at a time: the rows that share their chunks, in the order of the values."""
    if variable.ndim < 3:
        return [...]
    rows = 1 if variable.chunking() == "contiguous" else variable.chunking()[1]
    return [
        (number, slice(first, first + rows))
        for number in range(variable.shape[0])
        for first in range(0, variable.shape[1], rows)
    ]


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


def open(path: str | Path, chunks: Any = None) -> "Dataset":
    """Open a dataset lazily, with the accessor `studies.accessor` at `.elastica`.

    Parameters
    ----------
    path : str or Path
    chunks : dict, int or "auto", optional
        As in `xarray.open_dataset`: {} makes dask arrays with the chunks of the file. By default values are
        read when they are used.

    Returns
    -------
    xarray.Dataset
        Labels as text, flags as integers. Saved again, by whichever writer of xarray, text becomes strings.

    Raises
    ------
    StudyError
        If the file is missing, damaged, or not one of ours, or the chunks name no dimension of it.
    """
    import xarray

    import studies.accessor  # noqa: F401

    identify(path)
    with ACCESS, as_damage_error(path):
        dataset = xarray.open_dataset(path, engine="netcdf4", lock=ACCESS)
    if chunks is None:
        return _with_plain_text(dataset)
    dataset.close()
    if isinstance(chunks, dict) and not set(chunks) <= set(dataset.dims):
        # xarray itself takes no notice of them.
        raise StudyError(
            f"chunks = {chunks!r}: use the dimensions of {path}, {', '.join(map(str, dataset.dims))}"
        )
    try:
        with ACCESS:
            dataset = xarray.open_dataset(path, engine="netcdf4", chunks=chunks, lock=ACCESS)
    except (TypeError, ValueError) as problem:
        raise StudyError(f"chunks = {chunks!r} cannot be: {problem}") from None
    # Not under the lock: threads of dask read the text, and they take it.
    return _with_plain_text(dataset)


def _with_plain_text(dataset):
    """A dataset that forgets how its text was stored: not every format has characters of fixed length."""
    for variable in dataset.variables.values():
        if "char_dim_name" in variable.encoding:
            variable.encoding = {}
            if variable.chunks:
                # Writers would load it, and warn: dask does not know that these are texts.
                variable.load()
    return dataset


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


def identify(path, read=()):
    """Global attributes of a dataset of ours.

    A damaged file may make HDF5 crash or read for ever, so another process opens it first.

    Parameters
    ----------
    path : str or Path
    read : sequence of str
        Variables to read entirely there.

    Raises
    ------
    StudyError
        If the file is missing, damaged, of a newer format, or not one of ours.
    """
    path = Path(path)
    refuse_path(path)
    if not path.is_file():
        what = "this is no file" if path.exists() else "there is no such file"
        raise StudyError(f"{path}: {what}; give the path of a dataset")
    with path.open("rb") as stream:
        refuse_other("dataset", path, stream.read(MOST_NEEDED))
    try:
        return read_apart(_identify, path, read)
    except Lost as problem:
        raise StudyError(f"{path}: the file is damaged (while it was read: {problem})") from None


def _identify(path, read):
    # Its own HDF5 library is loaded only where files of unknown origin are opened.
    from studies.store.container import foreign

    try:
        if strange := foreign(path):
            raise StudyError(f"{path}: this is no dataset of constrained-elastica ({strange})")
        with opened(path) as dataset:
            attributes = {name: dataset.getncattr(name) for name in dataset.ncattrs()}
            present, dims = set(dataset.variables), set(dataset.dimensions)
            for variable in dataset.variables.values():
                variable.__dict__, variable.filters(), variable.chunking()
            at_once = [dataset.variables[name] for name in present & (set(read) | dims)]
            refuse_more_than_memory(path, at_once)
            for variable in at_once:
                variable[:]
            wrong = fault(dataset)
    except StudyError:
        raise
    except READING_FAILS as problem:
        with Path(path).open("rb") as stream:
            if stream.read(3) == b"CDF":
                raise StudyError(f"{path}: this is netCDF-3; it opens with xarray.open_dataset") from None
        raise StudyError(f"{path}: this cannot be read as netCDF ({problem}){why_unlockable(path)}") from None
    version = attributes.get("format_version")
    ours = isinstance(attributes.get("study_id"), str) and isinstance(version, (int, np.integer))
    if not ours:
        raise StudyError(
            f"{path}: this is no dataset of constrained-elastica, or its attributes are lost; "
            "xarray.open_dataset opens what is netCDF"
        )
    if version > FORMAT_VERSION:
        raise StudyError(
            f"{path}: format {version} is newer than {FORMAT_VERSION}, which this version reads; "
            "install a newer constrained-elastica"
        )
    if wrong:
        raise StudyError(
            f"{path}: this is no whole dataset ({wrong}); a selection, or what else was made of one, opens "
            "with xarray.open_dataset; if this is meant to be whole, the file is damaged"
        )
    return attributes
