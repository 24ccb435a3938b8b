"""Join finished datasets of the same numerics along ends, H, what is prescribed, and states.

Left out: what they hold (`known`), the copying (`reduction`).
"""

from dataclasses import replace

import numpy as np

from elastica.codes import Status
from studies.errors import StudyError
from studies.known import known_from, read_finished, refuse_unlike, state_labels
from studies.plan import Plan
from studies.reduction import positions
from studies.runner import compute
from studies.schema import per_state
from studies.sources import reading
from studies.study import Study

AGREE = 1e-9
"""Values of the same point from different processors differ by less."""
NAMED = 5


def merge(paths, out):
    """Join datasets to one; the best states are found anew.

    Parameters
    ----------
    paths : sequence of Path
    out : Path

    Returns
    -------
    Study
        Of the grid that has every label of them all. Points that none holds are not computed; states that
        some of them left out are, where others solve them. If any has a transition table, that of all labels
        is computed anew, since gaps, loads and states may be more than each has.

    Raises
    ------
    StudyError
        If the datasets are not of the same numerics, or differ at a point that both hold.
    """
    files = [read_finished(path) for path in paths]
    first = files[0].attributes
    numerics = {name: first[name] for name in ("numerics_version", "numerics_id") if name in first}
    for file in files:
        refuse_unlike(files[0].study, numerics.get("numerics_version"), file)
    study = _united(files)
    for number, file in enumerate(files):
        for other in files[:number]:
            _refuse_conflicts(other, file)
    merged_from = ", ".join(file.attributes["study_id"] for file in files)
    known = known_from(files, study.grid, numerics | {"merged_from": merged_from})
    if missing := int((~known.held).sum()):
        known.about["points_not_computed"] = missing
    # What no file holds stays so; states that only some of them know are computed for the others.
    compute(replace(Plan.of(study, known=known), blocks=()), out)
    return study


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
        labels = [name for file in files for name in state_labels(file.source)]
        content["states"] = {"names": list(dict.fromkeys(labels))}
    outputs = [study.outputs.model_dump(exclude_none=True) for study in studies]
    if len({some["shapes"] for some in outputs} - {0}) > 1:
        raise StudyError(
            f"{files[0].source.path}: shapes have other samples in another file; they cannot join"
        )
    content["outputs"] = {
        name: max(some.get(name, False) for some in outputs) for name in set().union(*outputs)
    }
    return Study.from_dict(content)


def _refuse_conflicts(a, b):
    """Refuse two datasets that say different things of the same state at the same point."""
    control = a.study.grid.control
    rows, columns = positions(a.source.H, b.source.H), positions(a.source.given, b.source.given)
    if not (rows[0].size and columns[0].size):
        return
    states = [state_labels(file.source) for file in (a, b)]
    common = np.intersect1d(*states, assume_unique=True, return_indices=True)[1:]
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
