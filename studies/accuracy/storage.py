"""What compression and chunks cost: a dataset of maps rewritten in several ways, and read as by a chart.

A chart reads whole planes of one state; a study is written in bands of rows. Times are those of files in the
memory of the system, without the disk's own speed.
"""

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.design.plan import LARGEST_BLOCK
from studies.store.files import opened
from studies.store.layout import CHUNK_BYTES, COMPRESSION

PLANES = "status", "stability", "energy"
"""What is read of one state, for a chart of each kind."""


class Layout(NamedTuple):
    """How variables are stored."""

    title: str
    compression: dict
    chunks: object


def _block(sizes, itemsize):
    """Rows of one state, of as many points as a block of maps."""
    return 1, max(1, min(sizes[1], LARGEST_BLOCK // sizes[2])), sizes[2], 1


def _point(sizes, itemsize):
    """All states of a point together."""
    return 1, max(1, min(sizes[1], CHUNK_BYTES // (sizes[2] * itemsize * sizes[3]))), sizes[2], sizes[3]


def _automatic(sizes, itemsize):
    """What the library chooses."""
    return None


LAYOUTS = [
    Layout("as stored: zlib 4, shuffle, rows of a state", COMPRESSION, _block),
    Layout("no compression", {"fletcher32": True}, _block),
    Layout("zlib 1, shuffle", COMPRESSION | {"complevel": 1}, _block),
    Layout("zlib 9, shuffle", COMPRESSION | {"complevel": 9}, _block),
    Layout("zlib 4, no shuffle", COMPRESSION | {"shuffle": False}, _block),
    Layout("zlib 4, shuffle, all states in a chunk", COMPRESSION, _point),
    Layout("zlib 4, shuffle, chunks of the library", COMPRESSION, _automatic),
]


class Stored(NamedTuple):
    """Seconds to write all, bytes, seconds to read the planes of one state."""

    writing: float
    file_bytes: float
    reading: float


def stored(file, layout, folder):
    """Write the variables of a dataset again in a layout, and read one state.

    Parameters
    ----------
    file : Path
        A dataset with the dimensions ends, H, P and state.
    layout : Layout
    folder : Path

    Returns
    -------
    Stored
    """
    with opened(file) as source:
        names = [name for name, variable in source.variables.items() if len(variable.dimensions) == 4]
        values = {name: source.variables[name][:] for name in names}
    path = Path(folder) / "layout.nc"
    begin = time.perf_counter()
    with opened(path, "w") as target:
        sizes = values["status"].shape
        for dim, size in zip(("ends", "H", "P", "state"), sizes, strict=True):
            target.createDimension(dim, size)
        for name, array in values.items():
            created = target.createVariable(
                name,
                array.dtype,
                ("ends", "H", "P", "state"),
                chunksizes=layout.chunks(sizes, array.dtype.itemsize),
                fill_value=np.nan if array.dtype == "f8" else False,
                **layout.compression,
            )
            created[:] = array
    writing = time.perf_counter() - begin
    begin = time.perf_counter()
    with opened(path) as target:
        for name in PLANES:
            target.variables[name][0, :, :, 0]
    reading = time.perf_counter() - begin
    return Stored(writing, path.stat().st_size, reading)
