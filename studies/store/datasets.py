"""Datasets of ours: told from other files, and opened.

Not here: the files they are in (`files`).
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.errors import StudyError
from studies.kinds import MOST_NEEDED, refuse_other
from studies.sandbox import Lost
from studies.schema import FORMAT_VERSION
from studies.store.access import ACCESS
from studies.store.files import (
    READING_FAILS,
    as_damage_error,
    opened,
    read_apart,
    refuse_more_than_memory,
    refuse_path,
    why_unlockable,
)
from studies.store.structure import fault

if TYPE_CHECKING:
    from xarray import Dataset


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
    version: Any = attributes.get("format_version")
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
