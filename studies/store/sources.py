"""Files that hold points of a dataset: shards of a run, or finished datasets that must stay what was proved.

Not here: which values are taken from them (`reduction`).
"""

from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.errors import StudyError
from studies.running.evaluate import Scattered
from studies.store.files import mark_of, opened


class Source(NamedTuple):
    """A file that holds some points of a dataset.

    `searched` are the states that were asked for there, of words the first root if every root was sought.
    If the points are `scattered`, `H` and `given` have the labels of each, and in the file they are one row.
    `mark` is that of the file (`files.mark_of`) when its content was proved; None for a shard of ours.
    """

    path: Path
    ends: tuple[str, ...]
    H: np.ndarray
    given: np.ndarray
    searched: tuple[str, ...]
    every_root: bool
    scattered: bool = False
    mark: tuple | None = None


@contextmanager
def reading(source):
    """A source as an open dataset, which is still what was proved, from the beginning to the end.

    Raises
    ------
    StudyError
        If it is not.
    """
    refuse_changed(source)
    try:
        with opened(source.path) as file:
            yield file
    finally:
        refuse_changed(source)


def refuse_changed(source):
    """Refuse a file that is not the one whose content was proved, as `reading` does."""
    if source.mark not in (None, mark_of(source.path)):
        raise StudyError(
            f"{source.path}: this file was changed, or replaced by another, since its content was proved; "
            "nothing of it is taken, the same command reads it anew, and what is computed is kept"
        )


def source_of(block, path, task):
    """A shard as a source."""
    labels = (np.array(block.H), np.array(block.given))
    scattered = isinstance(block, Scattered)
    return Source(path, (block.ends,), *labels, task.names, task.every_root, scattered)
