"""The transition table of a dataset: where its states begin, end, meet and change their stability.

The events of a state depend on its gap alone, not on the loads of the grid: they are found at blocks of
gaps, when the points have told which states there are. A shard of such a block holds rows of the table.

Not here: how they are found (`evaluate`).
"""

from typing import NamedTuple

import numpy as np

from studies.schema import TRANSITIONS, TRANSITIONS_FAILED
from studies.store.files import opened, read_labels
from studies.store.layout import COMPRESSION, write_labels


class Row(NamedTuple):
    """One event, as in the table."""

    ends: str
    H: float
    P: float
    shortening: float
    state: str
    other_state: str
    event: int
    index_before: int
    index_after: int


def place_of(ends, H, name):
    """Where the events of a state are looked for, in words."""
    return f"{ends} H={H:.12g} {name}"


def in_order(rows, ends, names):
    """Rows by ends, gap, load and state, in the order of these labels."""
    rank = {label: number for labels in (ends, names) for number, label in enumerate(labels)}
    return sorted(rows, key=lambda row: (rank[row.ends], row.H, row.P, rank[row.state], *row[6:]))


def write_events(dataset, rows, failed):
    """The table, in an open dataset; nothing where there is no event."""
    if failed:
        dataset.setncattr(TRANSITIONS_FAILED, "; ".join(failed))
    if not rows:
        return
    dataset.createDimension("transition", len(rows))
    for (name, variable), values in zip(TRANSITIONS.items(), zip(*rows, strict=True), strict=True):
        if variable.dtype == "S1":
            write_labels(dataset, name, np.array(values), variable.attributes)
            continue
        created = dataset.createVariable(
            name,
            variable.dtype,
            variable.dims,
            fill_value=np.nan if variable.dtype == "f8" else False,
            **COMPRESSION,
        )
        created.setncatts(variable.attributes)
        created[:] = np.array(values, variable.dtype)


def read_events(path):
    """What `write_events` wrote: rows, and where there are none because their search failed."""
    with opened(path) as dataset:
        failed = str(getattr(dataset, TRANSITIONS_FAILED, ""))
        if "transition" not in dataset.dimensions:
            return [], failed
        columns = [read_labels(dataset.variables[name], path).tolist() for name in TRANSITIONS]
    return [Row(*row) for row in zip(*columns, strict=True)], failed


def join_events(paths, ends, names):
    """The table from its shards: rows in order, and where events could not be found."""
    found = [read_events(path) for path in paths]
    # Datasets that are merged may share gaps.
    rows = in_order(dict.fromkeys(row for rows, _ in found for row in rows), ends, names)
    return rows, sorted(failed for _, failed in found if failed)
