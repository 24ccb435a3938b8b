"""How datasets enter a catalogue, and whether they are still what they were.

Left out: repairing. A dataset that is gone or changed is reported; its entry stays as it is.
"""

import hashlib
import os
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from studies.catalog import INDEX, Catalog, Entry
from studies.checking import check
from studies.errors import StudyError
from studies.files import identify, opened, read_labels
from studies.lock import one_at_a_time
from studies.merging import read_finished
from studies.whole_files import sync, written_whole

SUFFIX = ".nc"
PATIENCE = 60.0
"""Seconds to wait while other processes add their datasets."""


def add(folder: str | Path, file: str | Path) -> str:
    """Move a dataset into a catalogue.

    It has its name in the catalogue, and its entry in the index, before it loses its own: however this
    ends, a good file is there. A file that lies in the folder already gets its entry.

    Parameters
    ----------
    folder, file : str or Path

    Returns
    -------
    str
        Its name in the catalogue.

    Raises
    ------
    StudyError
        If the file is none of ours, is damaged, is there already, or its name is taken.
    """
    folder, file = Path(folder), Path(file)
    Catalog.read(folder)
    entry = describe(file)
    with one_at_a_time(folder / "index.lock", PATIENCE):
        catalog = Catalog.read(folder)
        name = _name(catalog, file, entry)
        target = catalog.path(name)
        inside = target.exists() and target.samefile(file)
        if not inside:
            _place(file, target, entry)
        _write(Catalog(folder, catalog.entries | {name: entry}))
        if not inside:
            file.unlink()
    return name


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
    with opened(file) as opened_file:
        states = [str(name) for name in read_labels(opened_file.variables["state"], file)]
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return Entry(
        title=str(attributes.get("title", study.name)),
        study=study.name,
        study_id=attributes["study_id"],
        numerics_id=attributes["numerics_id"],
        content_hash=attributes["content_hash"],
        sha256=_sha256(file),
        bytes=file.stat().st_size,
        date_created=str(attributes.get("date_created", "unknown")),
        date_added=now,
        ends=dataset.source.ends,
        states=tuple(states),
        H=_extent(dataset.source.H),
        **{study.grid.control: _extent(dataset.source.given)},
        solve=study.solve.arguments,
        outputs=study.outputs.model_dump(exclude_none=True),
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
    target = catalog.path(file.name)
    taken = file.name in catalog.entries or (target.exists() and not target.samefile(file))
    if taken:
        raise StudyError(f"{file}: another file has the name {file.name} in {catalog.folder}; rename yours")
    return file.name


def _place(file, target, entry):
    """Give a dataset its name in the catalogue as well: a second name, or a copy on another file system."""
    try:
        os.link(file, target)
    except OSError:
        with written_whole(target) as temporary:
            shutil.copyfile(file, temporary)
            if _sha256(temporary) != entry.sha256:
                raise StudyError(f"{file}: the copy is not what was read; add it again") from None
    else:
        sync(target)
        sync(target.parent)


def _write(catalog):
    with written_whole(catalog.path(INDEX)) as temporary:
        temporary.write_text(catalog.text(), encoding="utf-8")


def verify(catalog: Catalog, sample: int) -> Iterator[tuple[str, str, list[str]]]:
    """Check every dataset of a catalogue.

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
        except StudyError as problem:
            report, problems = [], [str(problem)]
        yield name, "" if problems else report[-1].strip(), problems


def _checked(catalog, name, sample):
    """Report and problems of one dataset."""
    entry, path = catalog.entries[name], catalog.path(name)
    if catalog.condition(name) == "gone":
        return [], ["the file is gone; put it back with `elastica catalog add`"]
    if _sha256(path) != entry.sha256:
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
