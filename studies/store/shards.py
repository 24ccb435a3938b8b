"""Shards: one file a block, written by whoever computed it, whose name tells whose it is and whether intact.

The name holds the block's place and extent, its owner and a seal. The owner is a hash of what is computed
and of the versions of this package, numpy and scipy; the texts of a study are not in it, so a new title
costs nothing. The seal is a hash of the identity of the study, the labels of the block and every byte: a
shard that is damaged or cut short is known before netCDF, which may hang on it, opens it. Shards of other
owners are neither used nor removed.

Not here: which blocks there are (`plan`), when they are computed (`runner`), how they are joined
(`joining`).
"""

import hashlib
import json
import os
import re
import shutil
from collections import defaultdict
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import netCDF4
import numpy as np

from studies.errors import StudyError
from studies.messages import note
from studies.sandbox import Lost
from studies.schema import FORMAT_VERSION, coordinates, per_state
from studies.store.access import ACCESS
from studies.store.files import READING_FAILS, opened, read_apart
from studies.store.layout import define, write, write_failures
from studies.store.provenance import decisive_versions
from studies.store.transition_table import write_events
from studies.whole_files import PART, sync, temporary_beside

NAME = re.compile(
    r"(?P<place>[0-9]{6,}(-[0-9]{6,}){4})(\.(?P<owner>[0-9a-f]{16}))?\.(?P<seal>[0-9a-f]{32})\.nc"
)
"""Of a shard; those of the first release have no owner."""
LONGEST_NAME = f"{'-'.join(['0' * 7] * 5)}.{'0' * 16}.{'0' * 32}.nc"
PROBE = ".probe-"
"""Files by which workers prove that they see the folder."""
OF_CLUSTER = ".certificates-"
"""Folders with the certificates of a cluster, which are gone when it is."""


def folder_of(out):
    """Folder of the shards of an output file, the same by whichever link it is called."""
    return Path(f"{os.path.realpath(out) if os.path.islink(out) else out}.shards")


def make_folder(out):
    """The folder of the shards of an output file, made if it is not there.

    Raises
    ------
    StudyError
        If it cannot be made, or not written to.
    """
    folder = folder_of(out)
    try:
        folder.mkdir(exist_ok=True)
    except FileExistsError:
        raise StudyError(f"{folder}: the shards go there, and this is no folder; move it away") from None
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        raise StudyError(
            f"{folder}: you may not write there; ask its owner to allow it (chmod g+w), or choose another "
            "output"
        )
    return folder.resolve()


def owner_of(identity):
    """Whose the shards are, in their names: of these results, by these versions."""
    whose = [identity["results_id"], identity["numerics_id"], decisive_versions()]
    return hashlib.sha256(json.dumps(whose, sort_keys=True).encode()).hexdigest()[:16]


def place_of(block):
    """A block's place and extent in the grid, as the names of its files begin."""
    return "-".join(f"{number:06d}" for number in block.key)


def write_shard(folder, identity, block, outputs, tile, names, arrays, failures, seconds):
    """Write what a block gave.

    Parameters
    ----------
    folder : Path
    identity : dict of str to str
        Of the study.
    block : Block
    outputs : Outputs
    tile : (int, int) or None
        That of the plan: the shard then has chunks of the dataset, for `joining` to copy as they are.
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
    labels = coordinates((block.ends,), H, block.control, block.prescribed, names, outputs)

    def fill(dataset):
        define(dataset, labels, per_state(labels, outputs), _attributes(identity, seconds), tile)
        for name, values in arrays.items():
            write(dataset.variables[name], (slice(1), *map(slice, block.shape[1:])), values)
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
    versions = json.dumps(decisive_versions())
    return {**identity, "versions": versions, "format_version": FORMAT_VERSION, "seconds": seconds}


def _store(folder, identity, block, fill):
    """Write what `fill` puts into an empty dataset: name of the file."""
    content = _encoded(fill)
    place = place_of(block)
    owner = owner_of(identity)
    path = folder / f"{place}.{owner}.{_sealed(identity, block, owner, BytesIO(content))}.nc"
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


def _sealed(identity, block, owner, stream):
    """The seal of what a stream holds."""
    digest = hashlib.sha256(json.dumps([identity, block, owner], sort_keys=True).encode())
    return hashlib.file_digest(stream, lambda: digest).hexdigest()[:32]


def intact(path, identity, block):
    """Whether a file holds the bytes that were written of a block, for this study and its numerics."""
    named = NAME.fullmatch(path.name)
    try:
        # To open a pipe would wait for who writes into it.
        if named is None or not path.is_file():
            return False
        with open(path, "rb") as stream:
            return _sealed(identity, block, named["owner"], stream) == named["seal"]
    except OSError:
        return False


def find_shards(folder, blocks, identity):
    """Intact shards of blocks; those that are there and are not intact are reported.

    What is no file counts as damaged. Shards of other owners are passed over.

    Parameters
    ----------
    folder : Path
    blocks : sequence of Block
    identity : dict of str to str

    Returns
    -------
    dict of Block to Path
    """
    present = defaultdict(list)
    for path in _by_owner(folder)[owner_of(identity)]:
        present[path.name.partition(".")[0]].append(path)
    found, bad = {}, 0
    for block in blocks:
        paths = present[place_of(block)]
        good = next((path for path in paths if intact(path, identity, block)), None)
        if good is not None:
            found[block] = good
        bad += len(paths) > 0 and good is None
    if bad:
        note(f"{folder}: {bad} shards are damaged or of other points, and are computed again")
    return found


def _by_owner(folder):
    """Paths of shards by owner, in the order of their names; of the first release by None."""
    found = defaultdict(list)
    for path in sorted(folder.iterdir()):
        if named := NAME.fullmatch(path.name):
            found[named["owner"]].append(path)
    return found


def tell_of_others(folder, identity):
    """Tell the user which shards there are of other studies or versions, that are kept and not used."""
    for owner, paths in _by_owner(folder).items():
        if owner != owner_of(identity):
            note(
                f"{folder}: {len(paths)} shards there are not used, {_unlike(owner, paths[0], identity)}; "
                "they are kept, remove them if nobody will go on with them"
            )


def _unlike(owner, path, identity):
    """What keeps a shard of another owner from being used, in words."""
    if owner is None:
        return "they are of an older release"
    try:
        # To open a pipe would wait for who writes into it.
        origin = read_apart(_origin, path) if path.is_file() else None
    except (*READING_FAILS, Lost):
        origin = None
    if origin is None:
        return "they are of another study or of other versions"
    results, versions = origin
    if results != identity["results_id"]:
        return "they are of another study with the same output"
    unlike = [
        f"{name} {versions.get(name)} there, {here} here"
        for name, here in decisive_versions().items()
        if versions.get(name) != here
    ]
    return f"they are of other versions ({', '.join(unlike)})"


def _origin(path):
    """What a shard was computed of, and by which versions."""
    with opened(path) as dataset:
        return dataset.results_id, dict(json.loads(dataset.versions))


def discard_parts(folder, blocks=None):
    """Remove what writers of these blocks, or all runs, left unfinished when they were killed."""
    places = None if blocks is None else {place_of(block) for block in blocks}
    parts = []
    for leftover in folder.glob(f".*{PART}"):
        if places is None and leftover.name.startswith(OF_CLUSTER):
            shutil.rmtree(leftover, ignore_errors=True)
        elif places is None or leftover.name[1:].partition(".")[0] in places:
            parts.append(leftover)
    _remove(parts)


def remove_shards(folder, identity):
    """Remove every shard of these results by these versions."""
    _remove([*_by_owner(folder)[owner_of(identity)], *folder.glob(f"{PROBE}*")])


def _remove(paths):
    """Remove files; tell the user if some are folders, or the file system forbids it."""
    left = []
    for path in paths:
        try:
            path.unlink(missing_ok=True)
        except OSError as problem:
            left.append(f"{path}: this cannot be removed ({problem.strerror})")
    if left:
        note(f"{left[0]}{f', nor can {len(left) - 1} more there' * (len(left) > 1)}; remove it by hand")


def remove_folder(folder):
    """Remove the folder of the shards unless there is something in it."""
    with suppress(OSError):
        folder.rmdir()
