"""What a dataset holds: all of it in memory, and the hash over it.

Not here: how files are opened (`files`), the points that some hold (`sources`), whether they are right
(`checking`).
"""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from math import prod
from typing import NamedTuple

import numpy as np

from studies.errors import StudyError
from studies.schema import (
    COORDINATES,
    STATES_NOT_COMPUTED,
    TRANSITIONS,
    TRANSITIONS_FAILED,
    control_of,
    coordinates,
    failure_indices,
    variables,
)
from studies.store.files import opened, read_labels, refuse_more_than_memory
from studies.store.structure import MEANING, is_type
from studies.store.transition_table import read_events

BAND_BYTES = 300_000_000
"""Of the columns that are read at a time."""


class Content(NamedTuple):
    """What a dataset holds.

    Attributes
    ----------
    labels : dict of str to ndarray
        Of ends, H, what is prescribed, and the states.
    values : dict of str to ndarray
        By variable.
    failures : ndarray of int, shape (rows, 4)
        Positions in the table of failures.
    events : list of studies.store.transition_table.Row
    without_events : str
        Where it says that transitions could not be found.
    problems : list of str
        Where attributes do not give numbers the meaning that they have in this format.
    """

    labels: dict
    values: dict
    failures: np.ndarray
    events: list
    without_events: str
    problems: list


def read_content(path, outputs):
    """Read all that a dataset holds.

    Parameters
    ----------
    path : str or Path
    outputs : Outputs
        Of its study.

    Returns
    -------
    Content

    Raises
    ------
    StudyError
        If variables are missing or have not the shape of their labels, or do not fit into memory.
    """
    with opened(path) as dataset:
        control = control_of(dataset.dimensions)
        axes = ("ends", "H", control, "state")
        shapes = {name: variable.shape for name, variable in dataset.variables.items()}
        labels = {name: read_labels(dataset.variables[name], path) for name in axes}
        whole = coordinates(labels["ends"], labels["H"], control, labels[control], labels["state"], outputs)
        expected = variables(whole, outputs)
        missing = [
            name
            for name, variable in expected.items()
            if shapes.get(name) != tuple(whole[dim].size for dim in variable.dims)
        ]
        if missing:
            raise StudyError(f"{path}: {', '.join(missing)} missing or of another shape; damaged")
        refuse_more_than_memory(path, [dataset.variables[name] for name in expected])
        values = {name: dataset.variables[name][:] for name in expected}
        problems = _conventions(dataset, expected | _table(dataset, path))
        failures = _failure_rows(dataset, control)
    events, without_events = read_events(path)
    return Content(labels, values, failures, events, without_events, problems)


def _table(dataset, path):
    """Columns of the transition table, if there is one."""
    if "transition" not in dataset.dimensions:
        return {}
    for name, variable in TRANSITIONS.items():
        found = dataset.variables.get(name)
        if found is None or found.dimensions[:1] != variable.dims or not is_type(found, variable.dtype):
            raise StudyError(f"{path}: {name} missing or without its dimensions; damaged")
    return TRANSITIONS


def _conventions(dataset, expected):
    """Attributes that give numbers their meaning, where they are not those of the format."""
    problems = []
    coordinates = {dim: COORDINATES[dim] for dim in dataset.dimensions if dim in dataset.variables}
    attributes = {name: variable.attributes for name, variable in expected.items()} | coordinates
    for name, wanted in attributes.items():
        variable = dataset.variables[name]
        if getattr(variable, "units", None) != wanted.get("units"):
            problems.append(f"{name} has not the units of this format")
        # Which code has which name is part of the structure, without which no dataset is opened.
        described = getattr(variable, "flag_values", ())
        if "flag_values" in wanted and (unknown := np.setdiff1d(variable[:], described)).size:
            problems.append(f"{name} has codes without a meaning: {unknown.tolist()}")
    if "CF-" not in str(getattr(dataset, "Conventions", "")):
        problems.append("the attribute Conventions does not name CF")
    return problems


def _failure_rows(dataset, control):
    """Positions in the table of failures, shape (rows, 4)."""
    if "failure" not in dataset.dimensions:
        return np.zeros((0, 4), int)
    return np.stack([dataset.variables[name][:] for name in failure_indices(control)], axis=-1)


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
    first_format = np.array_equal(getattr(dataset, "format_version", 1), 1)
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
        for band in _ahead(bands):
            values = np.ascontiguousarray(band)
            if values.dtype.kind == "f":
                values = np.where(np.isnan(values), np.nan, values + 0.0)
            digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def _ahead(bands):
    """Bands, each of them read while the one before is hashed."""
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(next, bands, None)
        while (band := coming.result()) is not None:
            coming = reader.submit(next, bands, None)
            yield band


def _contents(variable):
    """Dimensions, type, shape and values, in bands; of text the characters, however it is stored."""
    if variable.dtype is not str:
        bands = (variable[slab] for slab in _bands(variable))
        return variable.dimensions, np.dtype(variable.dtype), variable.shape, bands
    encoded = [text.encode() for text in np.ravel(variable[:])]
    width = max(1, *map(len, encoded), 1)
    characters = np.array(encoded, f"S{width}").view("S1").reshape(*variable.shape, width)
    return (*variable.dimensions, f"string{width}"), characters.dtype, characters.shape, iter([characters])


def _bands(variable):
    """Indices of what is read at a time, in the order of the values: the rows that share their chunks.

    Of a single row that is too long, the columns that do.
    """
    if variable.ndim < 3:
        return [...]
    ends, all_rows, all_columns, *rest = variable.shape
    rows, columns = (1, 1) if variable.chunking() == "contiguous" else variable.chunking()[1:3]
    column = np.dtype(variable.dtype).itemsize * prod(rest)
    columns *= max(1, BAND_BYTES // (column * columns))
    if rows > 1 or columns >= all_columns:
        columns = all_columns
    return [
        (number, slice(row, row + rows), slice(first, first + columns))
        for number in range(ends)
        for row in range(0, all_rows, rows)
        for first in range(0, all_columns, columns)
    ]
