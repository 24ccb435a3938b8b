"""Check a dataset: whether it is whole, means what it says, and its numbers can be found again.

Not here: repairing. A file that fails is reported, never changed.
"""

import json
import secrets
from pathlib import Path

import numpy as np

from elastica.codes import Stability, Status
from elastica.control import CONTROLS
from elastica.state import is_canonical
from studies.archive.repeat import Repeated, repeat_events, repeat_points
from studies.design.refinement import UNKNOWN, first_points, next_points
from studies.design.request import NUMERICS_VERSION
from studies.design.study import Study
from studies.design.tables import Outputs
from studies.messages import cut
from studies.schema import (
    STATES_NOT_COMPUTED,
    control_of,
    first_root,
    word_failed,
)
from studies.store.content import content_hash, read_content
from studies.store.datasets import identify
from studies.store.files import as_damage_error, read_apart
from studies.store.joining import summarise
from studies.store.sources import Source, StableStates

SAMPLE = 200
"""Grid points to solve again; all of them would take as long as the study."""
LINE = 400
"""Characters of a line of the report that texts of a file may fill."""
MOST_ERROR = 1e-3
"""Relative, of a solved state in closed form; rounding alone is a millionth of it. Chains may be coarse."""


def check(path: str | Path, sample: int = SAMPLE, seed: int | None = None) -> tuple[list[str], list[str]]:
    """Check a dataset and describe it.

    Parameters
    ----------
    path : str or Path
    sample : int
        Grid points to solve again.
    seed : int, optional
        Which ones; by default others at every call, for whoever knows them can make only those right.

    Returns
    -------
    report : list of str
        What is in the file, what was solved again and, if nothing is wrong, the verdict, which is "good"
        only if values were found again, and without reserve only if everything is computed.
    problems : list of str
        What is wrong with it; empty for a good file.

    Raises
    ------
    StudyError
        If the file is missing, unreadable or not one of ours.

    Notes
    -----
    The content hash shows that a file is not damaged and was not edited by accident. It does not show who
    wrote it: whoever edits a file can compute the hash again. What shows that values are right is solving
    them again. A sample of 200 points finds values that are wrong at every tenth point with a probability of
    1 - 7e-10, at a single one hardly; `sample` may be the number of all points. Failed points, points that
    are not computed and texts claim nothing that could be checked, so they are counted instead.
    """
    seed = secrets.randbelow(1 << 32) if seed is None else seed
    attributes = identify(path)
    problems = []
    with as_damage_error(path):
        if read_apart(content_hash, path) != attributes.get("content_hash"):
            problems.append("the values are not those that were written (content_hash differs)")
    study = _study(path, attributes, problems)
    held = read_content(path, Outputs() if study is None else study.outputs)
    labels, values = held.labels, held.values
    problems += held.problems
    if (version := attributes.get("numerics_version")) not in range(1, NUMERICS_VERSION + 1):
        problems.append(f"numerics_version is {cut(version)}; this release knows 1 to {NUMERICS_VERSION}")
    problems += _verdicts(values) + _ranges(values, labels, study) + _counts(values, control_of(labels))
    problems += _excuses(values, labels, held.failures, attributes, study)
    points, transitions = Repeated(0, 0, {}, []), Repeated(0, 0, {}, [])
    if study is not None:
        foreign = _agreement(study, labels, attributes)
        if not foreign:
            older = not _of_this_version(attributes)
            unsearched = attributes.get(STATES_NOT_COMPUTED, "").split()
            points = repeat_points(study, labels, values, sample, seed, older, unsearched)
            transitions = repeat_events(study, labels, held.events, held.without_events, sample, seed)
        problems += foreign + points.problems + transitions.problems
        if study.grid.refine and not foreign:
            problems += _refinement(path, study, labels)
        if sample and not points.compared and not problems:
            problems.append("no value could be compared with one that was solved again: nothing is proved")
    report = _describe(path, attributes, labels, values, held.events)
    report.append(f"  seed        {seed}")
    report += _told(points, transitions, attributes)
    if not problems:
        everything = STATES_NOT_COMPUTED not in attributes and (values["status"] >= 0).any(axis=-1).all()
        good = "good" if everything else "good as far as it is computed"
        report.append(f"  {good}" if points.compared else "  whole, but nothing was solved again")
    return report, problems


def _of_this_version(attributes):
    """Whether the numerics that computed a dataset are those that would solve it again."""
    return attributes.get("numerics_version") == NUMERICS_VERSION


def _agreement(study, labels, attributes):
    """Labels that are not those of the study."""
    grid = study.grid
    asked = {"control": grid.control, "states_searched": " ".join(study.task.names)}
    if unlike := [name for name, text in asked.items() if attributes.get(name) != text]:
        return [f"the attribute {unlike[0]} does not belong to the study in config_json"]
    if grid.control not in labels:
        return [f"the study prescribes {grid.control}, the dataset does not"]
    wanted = {"ends": grid.ends, "H": grid.H, grid.control: grid.prescribed}
    problems = [
        f"the labels of {axis} are not those of the study"
        for axis, expected in wanted.items()
        if not np.array_equal(labels[axis], np.array(expected))
    ]
    asked = set(study.task.names)
    first_roots = {first_root(name) if study.task.every_root else name for name in labels["state"]}
    if not first_roots <= asked:
        problems.append("there are states that the study did not ask for")
    return problems


def _counts(values, control):
    """Summaries over the states that do not follow from the states."""
    stable, preferred = summarise(values["status"], values["stability"], values[CONTROLS[control].potential])
    problems = []
    if not np.array_equal(stable, values["stable_count"]):
        problems.append("stable_count is not the number of stable states")
    if not np.array_equal(preferred, values["preferred_state"]):
        problems.append("preferred_state is not the stable state of least energy")
    return problems


def _refinement(path, study, labels):
    """Points that a refined study should have, and that are not computed."""
    grid = study.grid
    stable = StableStates(grid)
    stable.learn(Source(path, grid.ends, labels["H"], labels[grid.control], (), every_root=False))
    first = first_points(stable.codes.shape[1:], grid.refine)
    missing = sum(
        int((first & (codes == UNKNOWN) | next_points(codes, grid.refine)).sum()) for codes in stable.codes
    )
    return [f"{missing} points that the refinement needs are not computed"] if missing else []


def _study(path, attributes, problems):
    """The study that the file was computed from, if its description is intact."""
    try:
        study = Study.from_dict(json.loads(attributes["config_json"]), path)
    except (KeyError, ValueError, RecursionError) as problem:
        problems.append(f"the study in config_json cannot be read ({problem})")
        return None
    identities = ("study_id", "numerics_id") if _of_this_version(attributes) else ("study_id",)
    for name in identities:
        if attributes.get(name) != getattr(study, name):
            problems.append(f"{name} does not belong to the study in config_json")
            return None
    return study


def _verdicts(values):
    """Verdicts where there is no state, and states without one."""
    solved = values["status"] == Status.SOLVED
    return [
        f"{name} is not given exactly where status is solved"
        for name in ("stability", "index", "nullity")
        if ((values[name] >= 0) != solved).any()
    ]


def _excuses(values, labels, failures, attributes, study):
    """Points that say nothing, and do not say why."""
    problems = []
    status = values["status"]
    rows = np.unique(failures, axis=0)
    if len(rows) < len(failures) or not np.array_equal(rows, np.argwhere(status == Status.FAILED)):
        problems.append("the points with status failed are not those of the table of failures")
    names = [str(name) for name in labels["state"]]
    absent = status == Status.NOT_COMPUTED
    points = absent.all(axis=-1)
    for number, ends in enumerate(labels["ends"]):
        has_meaning = [is_canonical(first_root(name), ends) for name in names]
        absent[number, ..., ~np.array(has_meaning)] = False
    absent &= ~word_failed(status, names) & ~points[..., None]
    refined = study is not None and study.grid.refine
    if points.any() and not refined and attributes.get("points_not_computed") != points.sum():
        problems.append(f"{points.sum():,} points are not computed, and the file does not say so")
    unsearched = attributes.get(STATES_NOT_COMPUTED, "").split()
    absent[..., [first_root(name) in unsearched or name in unsearched for name in names]] = False
    if absent.any():
        problems.append(f"{absent.sum():,} states are not computed at points that are")
    return problems


def _ranges(values, labels, study):
    """Numbers that no equilibrium can have."""
    problems = []
    solved = values["status"] == Status.SOLVED
    H = labels["H"][:, None, None]
    slack = 1e-9
    chain = study is not None and study.solve.method == "chain"
    # Beside a load at which the energy passes zero nothing of it is left but rounding.
    bent = values["bending_energy"] > 0
    share = np.minimum(np.abs(values["energy"]) / np.where(bent, values["bending_energy"], 1), 1)
    share = np.where(bent, share, 1)
    for name, good in (
        ("curvature", values["curvature"] >= 0),
        ("bending_energy", values["bending_energy"] >= 0),
        *(
            (name, (values[name] >= -slack) & (values[name] <= most))
            for name, most in (("shortening", 2), ("P", np.inf))
            if name in values
        ),
        ("flat_length", (values["flat_length"] >= -slack) & (values["flat_length"] <= 1)),
        ("clearance", (values["clearance"] >= -slack) & (values["clearance"] <= H + slack)),
        ("error", (values["error"] >= 0) & (values["error"] * share <= (np.inf if chain else MOST_ERROR))),
    ):
        if (solved & ~good).any():
            problems.append(f"{name} is out of range at {(solved & ~good).sum()} solved states")
    return problems


def _describe(path, attributes, labels, values, events):
    """What is in the file, on one screen."""
    status = values["status"]
    lines = [
        f"{path}",
        f"  title       {cut(attributes.get('title', ''), LINE // 2)}",
        "  study       {:.8}   numerics {:.8}   content {:.8}".format(
            *(str(attributes.get(name, "?")) for name in ("study_id", "numerics_id", "content_hash"))
        ),
        "  computed    {} by {}".format(
            *(cut(attributes.get(key, "unknown"), LINE // 2) for key in ("date_created", "source"))
        ),
        f"  ends        {cut(', '.join(labels['ends']), LINE)}",
    ]
    for axis in ("H", control_of(labels)):
        label = labels[axis]
        lines.append(f"  {axis:<11} {label.size} values from {label[0]:g} to {label[-1]:g}")
    computed = (status != Status.NOT_COMPUTED).any(axis=-1)
    points = int(computed.sum())
    if points < computed.size:
        lines.append(f"  points      {points:,} of {computed.size:,} are computed")
    lines.append("  state         solved   stable  inadmissible  no equilibrium  not followed  failed")
    for number, name in enumerate(labels["state"]):
        here, verdict = status[..., number], values["stability"][..., number]
        counts = [
            (here == Status.SOLVED).sum(),
            (verdict == Stability.STABLE).sum(),
            (here == Status.INADMISSIBLE).sum(),
            (here == Status.NO_EQUILIBRIUM).sum(),
            (here == Status.NOT_FOLLOWED).sum(),
            (here == Status.FAILED).sum(),
        ]
        lines.append("  {:<10} {:>9,} {:>8,} {:>13,} {:>15,} {:>13,} {:>7,}".format(name, *counts))
    if events:
        lines.append(f"  {len(events):,} transitions")
    return lines


def _told(points, transitions, attributes):
    """What was solved again, and what could not be compared."""
    lines = [f"  {points.points:,} grid points solved again"]
    if not _of_this_version(attributes):
        then = attributes.get("numerics_version", "unknown")
        lines[0] += f" by version {NUMERICS_VERSION} of the numerics, computed by version {then}"
    if transitions.points:
        lines.append(f"  transitions of {transitions.points:,} states at one gap searched again")
    for repeated in (points, transitions):
        if repeated.not_compared:
            counts = ", ".join(f"{count:,} {reason}" for reason, count in repeated.not_compared.items())
            lines.append(f"  not compared: {counts}")
    return lines
