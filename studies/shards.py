"""Shards: one file a block, written by whoever computed it, whose name tells whether it is intact.

The name holds the block's place and extent and a hash of its labels, the study's identity and every byte: a
shard that is damaged, cut short or of another study is known before netCDF, which may hang on it, opens it.
Left out: which blocks there are (`plan`), when they are computed (`runner`), how they are joined
(`reduction`).
"""

import hashlib
import json
import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

import netCDF4
import numpy as np

from studies.events import write_events
from studies.files import ACCESS, PART, define, sync, temporary_beside, write_failures
from studies.progress import note
from studies.schema import FORMAT_VERSION, coordinates, per_state

NAME = re.compile(r"(?P<place>[0-9]{6,}(-[0-9]{6,}){4})\.(?P<seal>[0-9a-f]{32})\.nc")

PROBE = ".probe-"
"""Files by which workers prove that they see the folder."""


def folder_of(out):
    """Folder of the shards of an output file."""
    return Path(f"{out}.shards")


def place_of(block):
    """A block's place and extent in the grid, as the names of its files begin."""
    return "-".join(f"{number:06d}" for number in (*block.place, *block.shape[1:]))


def write_shard(folder, identity, block, outputs, names, arrays, failures, seconds):
    """Write what a block gave.

    Parameters
    ----------
    folder : Path
    identity : dict of str to str
        Of the study.
    block : Block
    outputs : Outputs
    names, arrays, failures
        From `evaluate`.
    seconds : float
        What it took.

    Returns
    -------
    str
        Name of the file.
    """
    # A row of scattered points has no gap of its own: the block knows those of the points.
    H = block.H if len(block.H) == block.shape[1] else (np.nan,)
    labels = coordinates((block.ends,), H, block.control, block.given, names, outputs)

    def fill(dataset):
        # Its name tells whether it is intact; to compress it would double what it costs to write and read.
        attributes = _attributes(identity, seconds)
        define(dataset, labels, per_state(labels, outputs), attributes, compressed=False)
        for name, values in arrays.items():
            dataset.variables[name][:] = values
        write_failures(dataset, block.control, failures)

    return _store(folder, identity, block, fill)


def write_events_shard(folder, identity, block, rows, failed, seconds):
    """Write the events that were found at a block of gaps; the arguments are as for `write_shard`.

    Parameters
    ----------
    block : Gaps
    rows, failed
        From `find_events`.

    Returns
    -------
    str
        Name of the file.
    """

    def fill(dataset):
        dataset.setncatts(_attributes(identity, seconds))
        write_events(dataset, rows, failed)

    return _store(folder, identity, block, fill)


def _attributes(identity, seconds):
    return {**identity, "format_version": FORMAT_VERSION, "seconds": seconds}


def _store(folder, identity, block, fill):
    """Write what `fill` puts into an empty dataset: name of the file."""
    content = _encoded(fill)
    place = place_of(block)
    path = folder / f"{place}.{_seal(identity, block, content)}.nc"
    with temporary_beside(folder / place) as temporary:
        temporary.write_bytes(content)
        sync(temporary)
        if temporary.read_bytes() != content:
            raise OSError(f"{temporary} does not hold what was written to it")
        os.replace(temporary, path)
    sync(folder)
    return path.name


def _encoded(fill):
    """The bytes of a shard: made in memory, where no full disk stops the library half-way."""
    with ACCESS:
        dataset = netCDF4.Dataset("shard", "w", memory=1)
        dataset.set_auto_mask(False)
        dataset.set_auto_chartostring(False)
        fill(dataset)
        return bytes(dataset.close())


def _seal(identity, block, content):
    digest = hashlib.sha256(json.dumps([identity, block], sort_keys=True).encode())
    digest.update(content)
    return digest.hexdigest()[:32]


def intact(path, identity, block):
    """Whether a file holds the bytes that were written of a block, for this study and its numerics."""
    try:
        return _seal(identity, block, path.read_bytes()) == NAME.fullmatch(path.name)["seal"]
    except OSError:
        return False


def find_shards(folder, blocks, identity):
    """Intact shards of blocks; those that are there and are not intact are reported.

    Parameters
    ----------
    folder : Path
    blocks : sequence of Block
    identity : dict of str to str

    Returns
    -------
    dict of Block to Path
    """
    present = {}
    for path in sorted(folder.iterdir()):
        if named := NAME.fullmatch(path.name):
            present.setdefault(named["place"], []).append(path)
    found, bad = {}, 0
    for block in blocks:
        paths = present.get(place_of(block), ())
        good = next((path for path in paths if intact(path, identity, block)), None)
        if good is not None:
            found[block] = good
        bad += len(paths) > 0 and good is None
    if bad:
        note(f"{folder}: {bad} shards are damaged or of another study and are computed again")
    return found


def discard_parts(folder, blocks=None):
    """Remove what writers of these blocks, or all runs, left unfinished when they were killed."""
    places = None if blocks is None else {place_of(block) for block in blocks}
    for leftover in folder.glob(f".*{PART}"):
        if leftover.is_dir() and places is None:
            shutil.rmtree(leftover, ignore_errors=True)
        elif places is None or leftover.name[1:].partition(".")[0] in places:
            leftover.unlink(missing_ok=True)


def remove_shards(folder):
    """Remove every shard."""
    for path in folder.iterdir():
        if NAME.fullmatch(path.name) or path.name.startswith(PROBE):
            path.unlink(missing_ok=True)


def remove_folder(folder):
    """Remove the folder of the shards unless there is something in it."""
    with suppress(OSError):
        folder.rmdir()
