"""Use again what finished datasets hold: join several to one, or lend their points to a wider study.

Results of the same numerics join along ends, H, what is prescribed, and states. Left out: the copying
(`reduction`).
"""

import json
from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.states import is_canonical
from studies.errors import StudyError
from studies.files import content_hash, damage_told, identify, opened, read_labels, reading_limit
from studies.provenance import describe
from studies.reduction import Source, positions, reduce
from studies.sandbox import call
from studies.schema import control_of, per_state
from studies.study import NUMERICS_VERSION, Study

AGREE = 1e-9
"""Values of the same point from different processors differ by less."""
NAMED = 5


class Finished(NamedTuple):
    """A dataset whose content is what was written: its study and what it holds."""

    study: Study
    source: Source
    attributes: dict


def read_finished(path):
    """A finished dataset, proved intact.

    Raises
    ------
    StudyError
        If it is damaged or not one of ours.
    """
    attributes = identify(path)
    with damage_told(path):
        content = call(content_hash, path, limit=reading_limit(path))
        study = Study.from_dict(json.loads(attributes["config_json"]), path)
        with opened(path) as file:
            axes = ("ends", "H", control_of(file.dimensions))
            ends, H, given = (read_labels(file.variables[axis], path) for axis in axes)
        # A search leaves out what is solved nowhere: of that nothing is known here, it may be inadmissible.
        known = tuple(_state_labels(path)) if study.task.every_root else study.task.names
    if content != attributes.get("content_hash"):
        raise StudyError(f"{path}: the values are not those that were written; `elastica check` says more")
    source = Source(path, tuple(map(str, ends)), H, given, known, every_root=False)
    return Finished(study, source, attributes)


def merge(paths, out):
    """Join datasets to one; the best states are found anew.

    Parameters
    ----------
    paths : sequence of Path
    out : Path

    Returns
    -------
    Study
        Of the grid that has every label of them all. Points that none holds are not computed.

    Raises
    ------
    StudyError
        If the datasets are not of the same numerics, or differ at a point that both hold.
    """
    files = [read_finished(path) for path in paths]
    for file in files[1:]:
        _refuse_unlike(files[0].study, files[0].attributes.get("numerics_version"), file)
    study = _united(files)
    for number, file in enumerate(files):
        for other in files[:number]:
            _refuse_conflicts(other, file)
    sources = [file.source for file in files]
    missing = int((~_computed(study.grid, sources)).sum())
    about = {"merged_from": ", ".join(file.attributes["study_id"] for file in files)}
    if missing:
        about["points_not_computed"] = missing
    reduce(study, sources, out, describe(study) | about)
    return study


def lend(path, study):
    """A finished dataset as a source of points for a study that is yet to be computed.

    Raises
    ------
    StudyError
        If its values are not those that the study would have, or it lacks what the study asks for.
    """
    file = read_finished(path)
    _refuse_unlike(study, NUMERICS_VERSION, file)
    old, new = file.study, study
    shared = [ends for ends in new.grid.ends if ends in old.grid.ends]
    wanted = {name for name in new.task.names if any(is_canonical(name, ends) for ends in shared)}
    asked = wanted <= set(old.task.names) and new.task.every_root == old.task.every_root
    modes = all(
        getattr(old.outputs, name) >= getattr(new.outputs, name) for name in ("eigenvalues", "frequencies")
    )
    if not (asked and modes and new.outputs.shapes in (0, old.outputs.shapes)):
        raise StudyError(f"{path}: this lacks states or outputs that the study asks for; leave --reuse out")
    if "points_not_computed" in file.attributes:
        raise StudyError(f"{path}: points are not computed there; reuse the datasets it was merged from")
    return file.source


def _refuse_unlike(study, version, file):
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


def _united(files):
    """The study whose grid has the labels of all."""
    studies = [file.study for file in files]
    content = studies[0].model_dump(mode="json", exclude_none=True)
    control = studies[0].grid.control
    content["grid"] = {
        "ends": list(dict.fromkeys(ends for study in studies for ends in study.grid.ends)),
        "H": sorted({label for study in studies for label in study.grid.H}),
        control: sorted({label for study in studies for label in study.grid.given}),
    }
    if all(study.task.every_root for study in studies):
        content["states"] = {"max_contacts": max(study.states.max_contacts for study in studies)}
    else:
        labels = [name for file in files for name in _state_labels(file.source.path)]
        content["states"] = {"names": list(dict.fromkeys(labels))}
    outputs = [study.outputs.model_dump() for study in studies]
    if len({some["shapes"] for some in outputs} - {0}) > 1:
        raise StudyError(
            f"{files[0].source.path}: shapes have other samples in another file; they cannot join"
        )
    content["outputs"] = {name: max(some[name] for some in outputs) for name in outputs[0]}
    return Study.from_dict(content)


def _state_labels(path):
    with opened(path) as file:
        return [str(name) for name in read_labels(file.variables["state"], path)]


def _computed(grid, sources):
    """Grid points that some source holds, bool, shape (ends, H, given)."""
    held = np.zeros((len(grid.ends), len(grid.H), len(grid.given)), bool)
    for source in sources:
        from_rows, rows = positions(source.H, grid.H)
        from_columns, columns = positions(source.given, grid.given)
        for number, ends in enumerate(source.ends):
            with opened(source.path) as file:
                status = file.variables["status"][number]
            known = (status != Status.NOT_COMPUTED).any(axis=-1)[np.ix_(from_rows, from_columns)]
            held[np.ix_([grid.ends.index(ends)], rows, columns)] |= known
    return held


def _refuse_conflicts(a, b):
    """Refuse two datasets that say different things of the same state at the same point."""
    control = a.study.grid.control
    rows, columns = positions(a.source.H, b.source.H), positions(a.source.given, b.source.given)
    if not (rows[0].size and columns[0].size):
        return
    states = [_state_labels(file.source.path) for file in (a, b)]
    common = positions(np.array(states[0]), np.array(states[1]))
    found = []
    for ends in set(a.source.ends) & set(b.source.ends):
        for row_a, row_b in zip(*rows, strict=True):
            with opened(a.source.path) as one, opened(b.source.path) as two:
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
                    H, given = a.source.H[row_a], a.source.given[columns[0][column]]
                    label = states[0][common[0][state]]
                    found.append(f"{name} of {label} at {ends} H={H:g} {control}={given:g}")
    if found:
        named = ", ".join(found[:NAMED]) + (f" and {len(found) - NAMED} more" if len(found) > NAMED else "")
        raise StudyError(f"{b.source.path}: this differs from {a.source.path} in {named}")


def _differ(left, right):
    """Where two arrays (points, states, …) differ by more than rounding, shape (points, states)."""
    size = tuple(slice(min(sizes)) for sizes in zip(left.shape, right.shape, strict=True))
    left, right = left[size], right[size]
    same = np.isclose(left, right, rtol=AGREE, atol=AGREE, equal_nan=True)
    return ~same.all(axis=tuple(range(2, left.ndim)))
