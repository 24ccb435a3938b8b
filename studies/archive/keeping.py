"""How datasets enter a catalog, and whether they are still what they were.

Not here: repairing. A dataset that is gone or changed is reported; its entry stays as it is.
"""

import hashlib
import os
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from studies.archive.catalog import INDEX, LONGEST_TEXT, SUFFIX, Catalog, Entry, is_name
from studies.archive.checking import check
from studies.errors import StudyError
from studies.messages import note
from studies.running.lock import one_at_a_time
from studies.store.datasets import identify
from studies.store.provenance import now
from studies.store.reuse import read_finished
from studies.store.sources import refuse_changed
from studies.whole_files import temporary_name, written_whole

PATIENCE = 60.0
"""Seconds to wait while other processes add their datasets."""


def add(folder: str | Path, file: str | Path) -> str:
    """Move a dataset into a catalog.

    It has its name in the catalog, and its entry in the index, before it loses its own: however this
    ends, a good file is there. What loses its name is the file that was read, and not one that took its
    place meanwhile. A file that lies in the folder already gets its entry.

    Parameters
    ----------
    folder, file : str or Path

    Returns
    -------
    str
        Its name in the catalog.

    Raises
    ------
    StudyError
        If the file is none of ours, is damaged, is there already, or its name is taken.
    """
    folder, file = Path(folder), Path(file)
    _refuse_bad(Catalog.read(folder))
    before = os.lstat(file) if os.path.lexists(file) else None
    entry = describe(file)
    if before is None or _state(os.lstat(file)) != _state(before):
        raise StudyError(f"{file}: this was changed while it was read; add it again")
    with one_at_a_time(folder / "index.lock", PATIENCE):
        catalog = Catalog.read(folder)
        _refuse_bad(catalog)
        name = _name(catalog, file, entry)
        target = catalog.path(name)
        inside = os.path.lexists(target) and os.path.samestat(os.lstat(target), before)
        if not inside:
            _place(file, target, entry)
        _write(Catalog(folder, catalog.entries | {name: entry}))
        if not inside:
            _take_away(file, target, before)
    return name


def _refuse_bad(catalog):
    """Refuse to write an index anew of which a part is not understood."""
    if catalog.bad:
        raise StudyError(next(iter(catalog.bad.values())))


def _state(status):
    """What of a file changes when it is replaced or written to."""
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def _take_away(file, target, before):
    """Remove the name of a file that is in the catalog, unless another file has got it."""
    aside = temporary_name(file)
    try:
        os.rename(file, aside)
    except FileNotFoundError:
        return
    if _state(os.lstat(aside)) == _state(before):
        aside.unlink()
        return
    # Under another name, if a third one came in between.
    with suppress(FileExistsError):
        os.link(aside, file)
        aside.unlink()
    note(f"{file}: another file has taken this place meanwhile and is left here; {target} is the one added")


def describe(file: Path) -> Entry:
    """What the index says of a dataset, from the dataset itself.

    Raises
    ------
    StudyError
        If it is missing, damaged or none of ours.
    """
    if file.is_symlink():
        raise StudyError(f"{file}: this is a link; give the file itself, {file.resolve()}")
    dataset = read_finished(file)
    study, attributes = dataset.study, dataset.attributes
    found = {"sha256": _sha256(file), "bytes": file.stat().st_size}
    # Both must be of the file whose content was proved.
    refuse_changed(dataset.source)
    if "numerics_id" not in attributes:
        raise StudyError(f"{file}: the attribute numerics_id is missing; the file is damaged")
    return Entry(
        title=str(attributes.get("title", study.name))[:LONGEST_TEXT],
        study=study.name,
        study_id=attributes["study_id"],
        numerics_id=attributes["numerics_id"],
        content_hash=attributes["content_hash"],
        date_created=str(attributes.get("date_created", "unknown"))[:LONGEST_TEXT],
        date_added=now(),
        ends=dataset.source.ends,
        states=dataset.states,
        H=_extent(dataset.source.H),
        **{study.grid.control: _extent(dataset.source.prescribed)},
        solve=study.solve.arguments,
        outputs=study.outputs.model_dump(exclude_none=True),
        **found,
    )


def _extent(labels):
    return {"start": labels[0], "stop": labels[-1], "num": labels.size}


def _sha256(path):
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _name(catalog, file, entry):
    """Name that a file gets; that of its own entry if its place there is empty."""
    for name, other in catalog.entries.items():
        if other.content_hash == entry.content_hash:
            if catalog.condition(name) != "gone":
                raise StudyError(f"{file}: the catalogue has this dataset as {name}; there is nothing to add")
            return name
    if file.suffix != SUFFIX:
        raise StudyError(f"{file}: the name of a dataset must end in {SUFFIX}; rename it")
    if not is_name(file.name):
        raise StudyError(f"{file}: this name is no text in UTF-8; rename it")
    target = catalog.path(file.name)
    taken = file.name in catalog.entries or (os.path.lexists(target) and not target.samefile(file))
    if taken:
        raise StudyError(f"{file}: another file has the name {file.name} in {catalog.folder}; rename yours")
    return file.name


def _place(file, target, entry):
    """Give a dataset its name in the catalog as well: a second name, or a copy on another file system."""
    with written_whole(target, replaces=False) as temporary:
        temporary.unlink()
        try:
            os.link(file, temporary)
        except OSError:
            shutil.copyfile(file, temporary)
        if _sha256(temporary) != entry.sha256:
            raise StudyError(f"{file}: this is not what was read before; add it again") from None


def _write(catalog):
    with written_whole(catalog.path(INDEX)) as temporary:
        temporary.write_text(catalog.text(), encoding="utf-8")


def verify(catalog: Catalog, sample: int) -> Iterator[tuple[str, str, list[str]]]:
    """Check every dataset of a catalog.

    Parameters
    ----------
    catalog : Catalog
    sample : int
        Grid points of each to solve again.

    Yields
    ------
    name : str
    verdict : str
        "good", or what was not proved; empty for one with problems.
    problems : list of str
        What is wrong with it.
    """
    for name in sorted(catalog.entries):
        try:
            report, problems = _checked(catalog, name, sample)
        except (StudyError, OSError) as problem:
            report, problems = [], [str(problem)]
        yield name, "" if problems else report[-1].strip(), problems


def _checked(catalog, name, sample):
    """Report and problems of one dataset."""
    entry, path = catalog.entries[name], catalog.path(name)
    condition = catalog.condition(name)
    if condition == "gone":
        return [], ["the file is gone; put it back with `elastica catalog add`"]
    if not path.is_file() or _sha256(path) != entry.sha256:
        return [], ["the file is not the one that was added (its hash differs); `elastica check` says more"]
    attributes = identify(path)
    unlike = [
        f"{key} in the index is not that of the file"
        for key in ("content_hash", "study_id", "numerics_id")
        if attributes.get(key) != getattr(entry, key)
    ]
    report, problems = check(path, sample)
    return report, unlike + problems


def strays(catalog: Catalog) -> list[str]:
    """Names of datasets in the folder that have no entry."""
    return sorted(path.name for path in catalog.folder.glob(f"*{SUFFIX}") if path.name not in catalog.entries)
