"""Join finished datasets of the same numerics along ends, H, what is prescribed, and states.

Not here: what they hold (`reuse`), the copying (`joining`).
"""

from dataclasses import replace

from elastica.state import is_canonical
from studies.design.plan import Plan
from studies.design.study import Study
from studies.errors import StudyError
from studies.messages import note, readable_time
from studies.running.output import refuse_unwritable
from studies.running.runner import compute
from studies.schema import STATES_NOT_COMPUTED, TRANSITIONS_FAILED
from studies.store.joining import joined_labels, reduce, survey
from studies.store.provenance import describe
from studies.store.reuse import missing, read_finished, refuse_conflicts, refuse_unlike, reusable


def merge(paths, out, fill=False):
    """Join datasets to one; the best states are found anew. Nothing is computed unless `fill` says so.

    Parameters
    ----------
    paths : sequence of Path
    out : Path
    fill : bool
        Compute what some of the datasets have and others lack at points of theirs: states, which they did
        not search or have left out since they are solved nowhere there, and events of the transition table.

    Returns
    -------
    Study
        Of the grid that has every label of them all. Points that none holds are not computed; nor, without
        `fill`, are the states above, which the attribute `states_not_computed` names. There is then a
        transition table only if those of the datasets make up that of the whole.

    Raises
    ------
    StudyError
        If the output exists, the datasets are not of the same numerics, or differ at a point that both hold.
    """
    if out.exists():
        raise StudyError(f"{out}: this exists; choose another output or move it away")
    refuse_unwritable(out)
    files = [read_finished(path) for path in paths]
    first = files[0].attributes
    numerics = {name: first[name] for name in ("numerics_version", "numerics_id") if name in first}
    for file in files:
        refuse_unlike(files[0].study, numerics.get("numerics_version"), file)
    study = _united(files)
    for number, file in enumerate(files):
        for other in files[:number]:
            refuse_conflicts(other, file)
    merged_from = ", ".join(file.attributes["study_id"] for file in files)
    reuse = reusable(files, study.grid, numerics | {"merged_from": merged_from})
    if lacking := int((~reuse.held).sum()):
        reuse.about["points_not_computed"] = lacking
    surveyed = survey(reuse.sources, study.grid)
    rest = missing(reuse, study, surveyed.names)
    tables = _tables(files, study, joined_labels(study, surveyed))
    if fill and (rest[0] or tables is None):
        # What no file holds stays so.
        compute(replace(Plan.of(study, reuse=reuse), blocks=()), out)
        return study
    if rest[0]:
        reuse.about[STATES_NOT_COMPUTED] = " ".join(rest[0])
        _tell_of_states(study, *rest)
    if tables is None:
        _tell_of_events(study, joined_labels(study, surveyed))
        outputs = study.outputs.model_copy(update={"transitions": None})
        study, tables = study.model_copy(update={"outputs": outputs}), []
    reduce(study, list(reuse.sources), surveyed, out, describe(study) | reuse.about, tables)
    return study


def _tell_of_states(study, names, points):
    """Say which states are not computed, at how many points, and what it would take."""
    seconds = Plan.of_rest(study, names, points).seconds
    note(
        f"{' '.join(names)}: not computed at {points.sum():,} of {points.size:,} points, whose datasets lack "
        f"them; --fill (in Python fill=True) computes them, in {readable_time(seconds)} of work"
    )


def _tell_of_events(study, names):
    seconds = Plan.of_events(study, names).seconds
    note(
        "transitions: left out, since the tables of the datasets do not make up that of the whole; --fill "
        f"(in Python fill=True) finds them, in {readable_time(seconds)} of work"
    )


def _tables(files, study, names):
    """Datasets whose transition tables make up that of the whole; None if they do not."""
    if not study.outputs.transitions:
        return []
    grid, held = study.grid, set()
    for file in files:
        labels = set(file.states)
        ends = {name: [label for label in names if is_canonical(label, name)] for name in file.source.ends}
        whole = (
            file.study.outputs.transitions
            and TRANSITIONS_FAILED not in file.attributes
            and (file.study.grid.prescribed[0], file.study.grid.prescribed[-1])
            == (grid.prescribed[0], grid.prescribed[-1])
        )
        held |= {
            (name, gap)
            for name in file.source.ends
            for gap in file.study.grid.H
            if whole and labels.issuperset(ends[name])
        }
    return [file.source.path for file in files] if len(held) == len(grid.ends) * len(grid.H) else None


def _united(files):
    """The study whose grid has the labels of all."""
    studies = [file.study for file in files]
    content = studies[0].model_dump(mode="json", exclude_none=True)
    control = studies[0].grid.control
    content["grid"] = {
        "ends": list(dict.fromkeys(ends for study in studies for ends in study.grid.ends)),
        "H": sorted({label for study in studies for label in study.grid.H}),
        control: sorted({label for study in studies for label in study.grid.prescribed}),
    }
    if all(study.task.every_root for study in studies):
        content["states"] = {"max_contacts": max(study.states.max_contacts for study in studies)}
    else:
        labels = [name for file in files for name in file.states]
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
