"""The transition table of a dataset: where its states begin, end, meet and change their stability.

The events of a state depend on its gap alone, not on the loads of the grid: they are found at blocks of
gaps, when the points have told which states there are. A shard of such a block holds rows of the table.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from elastica.paths.transitions import transitions
from elastica.state import is_canonical
from studies.running.evaluate import Block, Piece, here, isolate_failures
from studies.schema import TRANSITIONS, TRANSITIONS_FAILED
from studies.store.files import opened, read_labels
from studies.store.layout import COMPRESSION, write_labels


class Gaps(Block):
    """Half gaps whose events are found between the first and the last load of the study, both `given`."""

    __slots__ = ()

    @property
    def shape(self):
        """As of a block without loads, so that its shard has a name that no block of points has."""
        return 1, len(self.H), 0

    @property
    def points(self):
        """Number of gaps."""
        return len(self.H)


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


def find_events(block, names, within=here):
    """Events of states at the gaps of a block.

    Parameters
    ----------
    block : Gaps
    names : sequence of str
        Those that have no meaning with these ends are left out.
    within : callable
        As for `evaluate`: what it raises costs one state at one gap.

    Returns
    -------
    rows : list of Row
    failed : list of str
        Where events could not be found, and why.
    """
    H, rows, failed = np.array(block.H), [], []
    for name in (name for name in names if is_canonical(name, block.ends)):
        for piece in isolate_failures(partial(within, _find, block.ends, H, block.given), [name], H.size):
            failed += [
                f"{place_of(block.ends, H[piece.points[i]], name)}: {why}" for i, why in piece.reasons.items()
            ]
            rows += piece.values.get("rows", [])
    return rows, failed


def place_of(ends, H, name):
    """Where the events of a state are looked for, in words."""
    return f"{ends} H={H:.12g} {name}"


def _find(ends, H, given, names, selected):
    """Rows of states at the gaps selected."""
    first, last = given
    for name in names:
        found = transitions(name, H[selected], ends, P_max=last)
        columns = (getattr(found, column).tolist() for column in Row._fields[1:])
        rows = [Row(ends, *row) for row in zip(*columns, strict=True)]
        yield Piece(name, selected, {"rows": [row for row in rows if row.P >= first]}, {})


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
