"""The hash of what a file holds, whoever wrote it and however it is stored.

Not here: how files are opened (`files`), whether they are datasets (`structure`).
"""

import hashlib

import numpy as np

from studies.schema import STATES_NOT_COMPUTED, TRANSITIONS_FAILED
from studies.store.files import opened
from studies.store.structure import MEANING


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
