"""What finished datasets hold of a study that is yet to be computed.

A dataset leaves out the states that are solved nowhere in it. Where another part of the study does solve
one, its points lack it: what is missing there remains to be computed.

Not here: the copying (`joining`), the computing (`runner`).
"""

import json
from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.state import is_canonical
from studies.design.plan import NOTHING, Reusable
from studies.design.request import NUMERICS_VERSION
from studies.design.study import Study
from studies.errors import StudyError
from studies.messages import note
from studies.schema import STATES_NOT_COMPUTED, VARIABLES, control_of, first_root, per_state, word_failed
from studies.store.content import content_hash
from studies.store.datasets import identify
from studies.store.files import as_damage_error, mark_of, opened, read_apart, read_labels
from studies.store.sources import Source, positions, read_points, read_rows, reading, refuse_changed, shared

AGREE = 1e-9
"""Values of the same point from different processors differ by less."""
NAMED = 5
BAND = 10_000_000
"""States that are looked for at a time."""


class Finished(NamedTuple):
    """A dataset whose content is what was written: its study, its points, the states it has, and the rest."""

    study: Study
    source: Source
    states: tuple[str, ...]
    attributes: dict


def read_finished(path):
    """A finished dataset, proved intact.

    Raises
    ------
    StudyError
        If it is damaged or not one of ours.
    """
    mark = mark_of(path)
    attributes = identify(path)
    with as_damage_error(path):
        content = read_apart(content_hash, path)
        study = Study.from_dict(json.loads(attributes["config_json"]), path)
        if study.study_id != attributes["study_id"]:
            raise StudyError(f"{path}: study_id does not belong to the study in config_json; damaged")
        with opened(path) as file:
            axes = ("ends", "H", control_of(file.dimensions))
            ends, H, prescribed = (read_labels(file.variables[axis], path) for axis in axes)
            states = tuple(map(str, read_labels(file.variables["state"], path)))
        # A search leaves out what is solved nowhere: of that nothing is known here, it may be inadmissible.
        known = states if study.task.every_root else study.task.names
    if content != attributes.get("content_hash"):
        raise StudyError(f"{path}: the values are not those that were written; `elastica check` says more")
    source = Source(path, tuple(map(str, ends)), H, prescribed, known, every_root=False, mark=mark)
    refuse_changed(source)
    return Finished(study, source, states, attributes)


def reusable(files, grid, about):
    """What finished datasets hold of a grid."""
    sources = tuple(file.source for file in files)
    searched = frozenset.intersection(*map(_searched, files))
    return Reusable(sources, _held(grid, sources), searched, about)


def _searched(file):
    """States that were asked for at every point of a dataset."""
    return frozenset(file.study.task.names) - {*file.attributes.get(STATES_NOT_COMPUTED, "").split()}


def borrow(path, study):
    """What a finished dataset holds of a study; nothing, and a line to the user, if it lacks outputs.

    Parameters
    ----------
    path : Path or None
        None for no dataset.
    study : Study

    Returns
    -------
    Reusable

    Raises
    ------
    StudyError
        If its values are not those that the study would have.
    """
    if path is None:
        return NOTHING
    file = read_finished(path)
    refuse_unlike(study, NUMERICS_VERSION, file)
    old, new = file.study.outputs, study.outputs
    lacking = [name for name in ("eigenvalues", "frequencies") if getattr(old, name) < getattr(new, name)]
    if new.shapes not in (0, old.shapes):
        lacking.append("shapes")
    if lacking:
        note(f"{path}: {' and '.join(lacking)} of the study are not there, so all its points are computed")
        return NOTHING
    if file.study.task.every_root != study.task.every_root:
        note(f"{path}: max_contacts searches, names do not; so all points of the study are computed")
        return NOTHING
    about = {
        "reused": file.attributes["study_id"],
        "reused_versions": str(file.attributes.get("library_versions", "unknown")),
    }
    return reusable([file], study.grid, about)


def missing(reuse, study, found):
    """States that are in the study and unknown at some points that are held.

    Parameters
    ----------
    reuse : Reusable
    study : Study
    found : set of str
        Names of the states that are solved, or failed, anywhere.

    Returns
    -------
    names : tuple of str
        Of words the first root, if every root is sought.
    points : ndarray of bool, shape (ends, H, prescribed)
        Where any of them is unknown.
    """
    grid, task = study.grid, study.task

    def word(name):
        return first_root(name) if task.every_root else name

    asked = set(task.names)
    new = asked - reuse.searched
    names = sorted({name for name in found if word(name) in asked} | new)
    lacking, points = np.zeros(len(names), bool), np.zeros_like(reuse.held)
    height = max(1, BAND // (len(grid.prescribed) * max(1, len(names))))
    for number, ends in enumerate(grid.ends):
        has_meaning = np.array([is_canonical(word(name), ends) for name in names], bool)
        for first in range(0, len(grid.H), height):
            rows = slice(first, first + height)
            status = _status(reuse.sources, ends, grid.H[rows], grid.prescribed, names)
            unknown = (status == Status.NOT_COMPUTED) & has_meaning & ~word_failed(status, names)
            unknown &= reuse.held[number, rows, :, None]
            points[number, rows] = unknown.any(axis=-1)
            lacking |= unknown.any(axis=(0, 1))
    words = {word(name) for name, lacks in zip(names, lacking, strict=True) if lacks}
    return tuple(name for name in task.names if name in words), points


def _status(sources, ends, H, prescribed, names):
    """Status of states in some rows as sources tell it, shape (H, prescribed, names)."""
    values = {"status": np.full((len(H), len(prescribed), len(names)), Status.NOT_COMPUTED, "i1")}
    for source in sources:
        if ends in source.ends:
            read_rows(source, {"status": VARIABLES["status"]}, ends, H, prescribed, names, values)
    return values["status"]


def refuse_unlike(study, version, file):
    """Refuse a dataset by another method or version of the numerics, or with something else prescribed."""
    path, control = file.source.path, file.study.grid.control
    if control != study.grid.control:
        raise StudyError(
            f"{path}: {control} is prescribed there, here {study.grid.control}; they cannot join"
        )
    there = file.study.solve.model_dump() | {"numerics_version": file.attributes.get("numerics_version")}
    here = study.solve.model_dump() | {"numerics_version": version}
    unlike = [
        f"{name} is {there.get(name)} there, here {here.get(name)}"
        for name in sorted(here.keys() | there.keys())
        if here.get(name) != there.get(name)
    ]
    if unlike:
        raise StudyError(f"{path}: {', '.join(unlike)}; only results of the same numerics join")


def refuse_conflicts(a, b):
    """Refuse two datasets that say different things of the same state at the same point."""
    control = a.study.grid.control
    rows, columns = positions(a.source.H, b.source.H), positions(a.source.prescribed, b.source.prescribed)
    if not (rows[0].size and columns[0].size):
        return
    common = np.intersect1d(a.states, b.states, assume_unique=True, return_indices=True)[1:]
    found = []
    for ends in set(a.source.ends) & set(b.source.ends):
        for row_a, row_b in zip(*rows, strict=True):
            with reading(a.source) as one, reading(b.source) as two:
                names = [name for name in per_state(one.dimensions, a.study.outputs) if name in two.variables]
                values = {
                    name: [
                        file.variables[name][side.source.ends.index(ends), row][which_columns][:, which]
                        for file, side, row, which_columns, which in zip(
                            (one, two), (a, b), (row_a, row_b), columns, common, strict=True
                        )
                    ]
                    for name in names
                }
            known = np.all([status != Status.NOT_COMPUTED for status in values["status"]], axis=0)
            for name, (left, right) in values.items():
                for column, state in np.argwhere(_differ(left, right) & known):
                    H, prescribed = a.source.H[row_a], a.source.prescribed[columns[0][column]]
                    label = a.states[common[0][state]]
                    found.append(f"{name} of {label} at {ends} H={H:g} {control}={prescribed:g}")
    if found:
        named = ", ".join(found[:NAMED]) + (f" and {len(found) - NAMED} more" if len(found) > NAMED else "")
        raise StudyError(f"{b.source.path}: this differs from {a.source.path} in {named}")


def _differ(left, right):
    """Where two arrays (points, states, …) differ by more than rounding, shape (points, states)."""
    size = tuple(slice(min(sizes)) for sizes in zip(left.shape, right.shape, strict=True))
    left, right = left[size], right[size]
    same = np.isclose(left, right, rtol=AGREE, atol=AGREE, equal_nan=True)
    return ~same.all(axis=tuple(range(2, left.ndim)))


def _held(grid, sources):
    """Grid points that some source holds, bool, shape (ends, H, prescribed)."""
    held = np.zeros((len(grid.ends), len(grid.H), len(grid.prescribed)), bool)
    for source in sources:
        there, here = shared(source, np.array(grid.H), np.array(grid.prescribed))
        for number, ends in enumerate(source.ends):
            if ends not in grid.ends:
                continue
            with reading(source) as file:
                status = read_points(file.variables["status"], number, there)
            computed = (status != Status.NOT_COMPUTED).any(axis=-1)
            held[grid.ends.index(ends)][tuple(place[computed] for place in here)] = True
    return held
