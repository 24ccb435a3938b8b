"""Check a dataset: whether it is whole, means what it says, and its numbers can be found again.

Left out: repairing. A file that fails is reported, never changed.
"""

import json
from itertools import product
from pathlib import Path

import numpy as np

from elastica.codes import Event, Stability, Status
from studies.errors import StudyError
from studies.evaluate import solve_points, unknown, word_failed
from studies.events import Gaps, find_events, in_order, place_of, read_events
from studies.files import (
    content_hash,
    damage_told,
    identify,
    opened,
    read_labels,
    reading_limit,
    refuse_more_than_memory,
)
from studies.reduction import potential, summarise
from studies.refinement import UNKNOWN, StableStates, first_points, next_points
from studies.sandbox import call
from studies.schema import (
    COORDINATES,
    TRANSITIONS,
    VARIABLES,
    control_of,
    coordinates,
    per_state,
    variables,
)
from studies.sources import Source
from studies.study import NUMERICS_VERSION, Study
from studies.tables import Outputs

SAMPLE, SAMPLE_GAPS = 200, 3
"""Grid points to solve again; under prescribed shortening, at how many gaps, since each is traced."""
SAMPLE_EVENTS = 3
"""States at one gap whose transitions are found again."""
AGREE = 1e-9
"""Relative difference between events from different processors."""
ROUNDING = 1e-12
ROOM = 100.0
"""Values differ between processors by rounding; `error` bounds it for κ, lengths and energy, the others
follow from these with a factor."""
RELATIVE = ("energy", "bending_energy", "shortening", "P")


def check(path: str | Path, sample: int = SAMPLE, seed: int = 0) -> tuple[list[str], list[str]]:
    """Check a dataset and describe it.

    Parameters
    ----------
    path : str or Path
    sample : int
        Grid points to solve again.
    seed : int
        Which ones.

    Returns
    -------
    report : list of str
        What is in the file.
    problems : list of str
        What is wrong with it; empty for a good file.

    Raises
    ------
    StudyError
        If the file is missing, unreadable or not one of ours.
    """
    attributes = identify(path)
    problems = []
    with damage_told(path):
        if call(content_hash, path, limit=reading_limit(path)) != attributes.get("content_hash"):
            problems.append("the values are not those that were written (content_hash differs)")
    study = _study(path, attributes, problems)
    if not _of_this_version(attributes):
        sample = 0
    with opened(path) as dataset:
        control = control_of(dataset.dimensions)
        axes = ("ends", "H", control, "state")
        shapes = {name: variable.shape for name, variable in dataset.variables.items()}
        labels = {name: read_labels(dataset.variables[name], path) for name in axes}
        outputs = Outputs() if study is None else study.outputs
        whole = coordinates(labels["ends"], labels["H"], control, labels[control], labels["state"], outputs)
        expected = variables(whole, outputs)
        missing = [
            name
            for name, variable in expected.items()
            if shapes.get(name) != tuple(whole[dim].size for dim in variable.dims)
        ]
        if missing:
            raise StudyError(f"{path}: {', '.join(missing)} missing or of another shape; damaged")
        refuse_more_than_memory(path, [dataset.variables[name] for name in expected])
        values = {name: dataset.variables[name][:] for name in expected}
        table = _table(dataset, path)
        problems += _conventions(dataset, expected | table)
    events, without_events = read_events(path)
    problems += _verdicts(values) + _ranges(values, labels) + _counts(values, control)
    if study is not None:
        foreign = _agreement(study, labels)
        problems += foreign or _recompute(study, labels, values, sample, seed)
        problems += foreign or _events(
            study, labels, events, without_events, min(sample, SAMPLE_EVENTS), seed
        )
        if study.grid.refine and not foreign:
            problems += _refinement(path, study, labels)
    return _describe(path, attributes, labels, values, events, sample), problems


def _table(dataset, path):
    """Columns of the transition table, if there is one."""
    if "transition" not in dataset.dimensions:
        return {}
    for name, variable in TRANSITIONS.items():
        found = dataset.variables.get(name)
        if found is None or found.dimensions[:1] != variable.dims or found.dtype != np.dtype(variable.dtype):
            raise StudyError(f"{path}: {name} missing or without its dimensions; damaged")
    return TRANSITIONS


def _of_this_version(attributes):
    """Whether the numerics that computed a dataset are those that would solve it again."""
    return attributes.get("numerics_version") == NUMERICS_VERSION


def _agreement(study, labels):
    """Labels that are not those of the study."""
    grid = study.grid
    if grid.control not in labels:
        return [f"the study prescribes {grid.control}, the dataset does not"]
    wanted = {"ends": grid.ends, "H": grid.H, grid.control: grid.given}
    problems = [
        f"the labels of {axis} are not those of the study"
        for axis, expected in wanted.items()
        if not np.array_equal(labels[axis], np.array(expected))
    ]
    asked = set(study.task.names)
    first_roots = {name.partition(":")[0] if study.task.every_root else name for name in labels["state"]}
    if not first_roots <= asked:
        problems.append("there are states that the study did not ask for")
    return problems


def _counts(values, control):
    """Summaries over the states that do not follow from the states."""
    stable, preferred = summarise(values["status"], values["stability"], values[potential(control)])
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


def _conventions(dataset, expected):
    """Attributes that give numbers their meaning, where they are not those of the format."""
    problems = []
    coordinates = {dim: COORDINATES[dim] for dim in dataset.dimensions if dim in dataset.variables}
    attributes = {name: variable.attributes for name, variable in expected.items()} | coordinates
    for name, wanted in attributes.items():
        variable = dataset.variables[name]
        if getattr(variable, "units", None) != wanted.get("units"):
            problems.append(f"{name} has not the units of this format")
        # Which code has which name is part of the structure, without which no dataset is opened.
        described = getattr(variable, "flag_values", ())
        if "flag_values" in wanted and (unknown := np.setdiff1d(variable[:], described)).size:
            problems.append(f"{name} has codes without a meaning: {unknown.tolist()}")
    if "CF-" not in str(getattr(dataset, "Conventions", "")):
        problems.append("the attribute Conventions does not name CF")
    return problems


def _verdicts(values):
    """Verdicts where there is no state, and states without one."""
    solved = values["status"] == Status.SOLVED
    return [
        f"{name} is not given exactly where status is solved"
        for name in ("stability", "index", "nullity")
        if ((values[name] >= 0) != solved).any()
    ]


def _ranges(values, labels):
    """Numbers that no equilibrium can have."""
    problems = []
    solved = values["status"] == Status.SOLVED
    H = labels["H"][:, None, None]
    slack = 1e-9
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
        ("error", values["error"] >= 0),
    ):
        if (solved & ~good).any():
            problems.append(f"{name} is out of range at {(solved & ~good).sum()} solved states")
    return problems


def _recompute(study, labels, values, sample, seed):
    """Solve some grid points again and compare: flags exactly, numbers within `error`."""
    names = [str(name) for name in labels["state"]]
    control = study.grid.control
    computed = (values["status"] != Status.NOT_COMPUTED).any(axis=-1)
    e, i, j = _chosen(computed, control, sample, seed)
    problems = []
    for number, ends in enumerate(study.grid.ends):
        here = (number, i[e == number], j[e == number])
        H, given = labels["H"][here[1]], labels[control][here[2]]
        found, solved, _ = solve_points(ends, H, control, given, study.task)
        again = _labelled(solved, found, names, study, ends)
        old = {name: values[name][here] for name in again}
        absent = old["status"] == Status.NOT_COMPUTED
        sure = ~(word_failed(old["status"], names) | word_failed(again["status"], names) | absent)
        differing = {name: _differs(name, old, again, sure) for name in again}
        lost = [name for name in found if name not in names]
        status = solved["status"][:, [found.index(name) for name in lost]]
        whole = ~(absent & (again["status"] != Status.NOT_COMPUTED)).any(axis=1)
        differing["state"] = (status == Status.SOLVED).any(axis=1) & whole
        for name, differs in differing.items():
            if differs.any():
                point = int(np.flatnonzero(differs)[0])
                problems.append(
                    f"{name} cannot be found again at {differs.sum()} of {H.size} points of {ends}, "
                    f"first at H={H[point]:g}, {control}={given[point]:g}"
                )
    return problems


def _events(study, labels, events, without, sample, seed):
    """Rows of the transition table that cannot be; and those of some states at some gaps, found again."""
    if not study.outputs.transitions:
        return ["there is a transition table, for which the study did not ask"] if events else []
    names = [str(name) for name in labels["state"]]
    first, last = study.grid.given[0], study.grid.given[-1]
    codes = [event.value for event in Event]
    wrong = [
        row
        for row in events
        if row.ends not in study.grid.ends
        or row.H not in study.grid.H
        or row.state not in names
        or row.event not in codes
        or not first <= row.P <= last
    ]
    if wrong:
        return [f"{len(wrong)} rows of the transition table do not belong to the dataset, first {wrong[0]}"]
    problems = (
        [] if in_order(events, study.grid.ends, names) == events else ["the transitions are not in order"]
    )
    searched = list(product(study.grid.ends, study.grid.H, names))
    for number in np.random.default_rng(seed).permutation(len(searched))[:sample]:
        ends, H, name = searched[number]
        if f"{place_of(ends, H, name)}: " in without:
            continue
        block = Gaps((0, 0, 0), ends, (H,), "P", (first, last))
        new = in_order(find_events(block, [name])[0], study.grid.ends, names)
        old = [row for row in events if (row.ends, row.H, row.state) == (ends, H, name)]
        if [row[4:] for row in old] != [row[4:] for row in new] or not np.allclose(
            [row[2:4] for row in old], [row[2:4] for row in new], rtol=AGREE, atol=AGREE
        ):
            problems.append(f"the transitions of {name} cannot be found again at {ends} H={H:g}")
    return problems


def _chosen(computed, control, sample, seed):
    """Indices along ends, H and the control of those points computed that are to be solved again."""
    rng = np.random.default_rng(seed)
    if control != "P":
        gaps = rng.permutation(np.flatnonzero(computed.any(axis=(0, 2))))[:SAMPLE_GAPS]
        computed = computed & np.isin(np.arange(computed.shape[1]), gaps)[:, None]
    points = np.argwhere(computed)
    chosen = np.sort(rng.choice(len(points), min(sample, len(points)), replace=False))
    return points[chosen].T


def _labelled(solved, found, names, study, ends):
    """What was solved now, with the states in the order of the dataset."""
    labels = coordinates((ends,), (), study.grid.control, (), names, study.outputs)
    common = [(state, found.index(name)) for state, name in enumerate(names) if name in found]
    arrays = {}
    for name, variable in per_state(labels, study.outputs).items():
        sizes = (len(solved["status"]), *(labels[dim].size for dim in variable.dims[3:]))
        arrays[name] = unknown(name, variable, sizes, names, ends)
        for state, place in common if name in solved else ():
            extra = tuple(slice(min(both)) for both in zip(sizes[2:], solved[name].shape[2:], strict=True))
            arrays[name][(slice(None), state, *extra)] = solved[name][(slice(None), place, *extra)]
    return arrays


def _differs(name, old, new, sure):
    """Points where a variable differs by more than rounding, of those that are sure, shape (n,)."""
    sure = sure & (old["stability"] != Stability.CRITICAL) & (new["stability"] != Stability.CRITICAL)
    a, b = old[name], new[name]
    if VARIABLES[name].dtype != "f8":
        return ((a != b) & sure).any(axis=1)
    extra = (1,) * (a.ndim - 2)
    scale = np.abs(a) if name in RELATIVE else np.maximum(np.abs(a), 1.0)
    room = ROOM * np.maximum(old["error"], ROUNDING).reshape(*sure.shape, *extra) * scale
    same = (np.abs(a - b) <= room) | (np.isnan(a) & np.isnan(b)) | ~sure.reshape(*sure.shape, *extra)
    return ~same.all(axis=tuple(range(1, a.ndim)))


def _describe(path, attributes, labels, values, events, sample):
    """What is in the file, on one screen."""
    status = values["status"]
    lines = [
        f"{path}",
        f"  title       {attributes.get('title', '')}",
        "  study       {:.8}   numerics {:.8}   content {:.8}".format(
            *(str(attributes.get(name, "?")) for name in ("study_id", "numerics_id", "content_hash"))
        ),
        f"  computed    {attributes.get('date_created', 'unknown')} by {attributes.get('source', 'unknown')}",
        f"  ends        {', '.join(labels['ends'])}",
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
    lines.append(f"  {min(sample, points):,} grid points solved again")
    if not _of_this_version(attributes):
        then = attributes.get("numerics_version", "unknown")
        lines.append(
            f"  computed by version {then} of the numerics, which version {NUMERICS_VERSION} cannot repeat"
        )
    return lines
