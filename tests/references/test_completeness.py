"""`find_states` against all equilibria that a dense search, written independently, finds at random points.

The stored points (`references/search.py` made them) have random ends, gaps and loads or shortenings; every
equilibrium below 90° is listed, at prescribed shortening those with P ≤ 12.
"""

import json
from collections import Counter, defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import elastica
from elastica.state import parse_state

pytestmark = pytest.mark.long

REFERENCES = json.loads((Path(__file__).parent / "equilibria.json").read_text())
LARGEST_LOAD = 12.0
TOLERANCE = 1e-8
TIE = 1e-7
"""Reactions (of P), clearances (of H), distances from 90° and from the largest load below which a state may
be on either side of what is listed."""


def end_name(k):
    return {"inf": "clamped", 0.0: "pinned"}.get(k, k)


def ends_of(point):
    return "/".join(str(end_name(k)) for k in point["ends"])


def stored(point):
    """Stored equilibria of a point as rows of name, P, κ, V, ΔL and whether they are next to a transition."""
    rows = []
    for row in point["states"]:
        label, *load, kappa, V, shortening, margin = row
        rows.append(
            {
                "name": name_of(label, ends_of(point)),
                "P": load[0] if load else point["P"],
                "numbers": np.array([kappa, V / (4 * np.pi**2), shortening]),
                "tie": margin < TIE,
            }
        )
    return [
        row for row in rows if int(row["name"][1:] if row["name"][0] == "B" else 0) <= point["contacts"] + 1
    ]


def name_of(label, ends):
    """Canonical name for labels such as "UDU SA 0010 point", "4 SA 1 free" and "0 straight"."""
    word, *kinds, regime = label.split()
    if regime == "straight":
        return "0"
    if regime == "free":
        return f"B{word}"
    a, b = ("a" * (kind == "A") for kind in kinds[0])
    return parse_state(a + word + b + "-" * (regime == "line"), ends).name


def listed(found, at, point):
    """The same rows of what `find_states` found at its point number `at`."""
    rows = []
    for i in np.flatnonzero((found.point == at) & (found.max_slope < np.pi / 2 + TIE)):
        if "shortening" in point and found.P[i] > LARGEST_LOAD * (1 + TIE):
            continue
        reaction = found.reaction[i][np.isfinite(found.reaction[i])].min(initial=np.inf)
        near = reaction / found.P[i], found.clearance[i] / point["H"], np.pi / 2 - found.max_slope[i]
        edge = LARGEST_LOAD - found.P[i] if "shortening" in point else np.inf
        rows.append(
            {
                "name": str(found.state[i]).split(":")[0],
                "P": found.P[i],
                "numbers": np.array([found.curvature[i], found.energy[i], found.shortening[i]]),
                "tie": np.nanmin([*near, edge]) < TIE,
            }
        )
    return rows


def same(a, b):
    return (
        a["name"] == b["name"]
        and abs(a["P"] - b["P"]) <= TOLERANCE * (1 + b["P"])
        and (np.abs(a["numbers"] - b["numbers"]) <= TOLERANCE * (1 + np.abs(b["numbers"]))).all()
    )


def compare(point, found, at):
    """Stored equilibria that were missed and found ones that are not stored, each as lists of rows."""
    missed, rest = [], listed(found, at, point)
    for row in stored(point):
        match = next((i for i, other in enumerate(rest) if same(other, row)), None)
        if match is None:
            missed.append(row)
        else:
            del rest[match]
    return missed, rest


def fewer_contacts(point, contacts):
    """A point without its longest words."""
    states = [row for row in point["states"] if len(row[0].split()[0].strip("0123456789")) <= contacts]
    return point | {"contacts": contacts, "states": states}


def find(points):
    """`find_states` at several points that differ in load or shortening and gap only."""
    control = "shortening" if "shortening" in points[0] else "P"
    given = {control: [point[control] for point in points]}
    return elastica.find_states(
        **given,
        H=[point["H"] for point in points],
        ends=ends_of(points[0]),
        max_contacts=points[0]["contacts"],
    )


def numbered_by_curvature(found):
    """Whether the roots of each word at each point are numbered 1, 2, … with growing curvature."""
    roots = defaultdict(list)
    for at, name, curvature in zip(found.point, found.state, found.curvature, strict=True):
        word, _, number = str(name).partition(":")
        roots[int(at), word].append((int(number or 1), float(curvature)))
    for values in roots.values():
        values.sort()
        if len({number for number, _ in values}) < len(values):
            return False
        if any(after[1] < before[1] * (1 - 1e-12) for before, after in pairwise(values)):
            return False
    return True


@pytest.mark.parametrize("control", ["P", "shortening"])
def test_nothing_is_missed_and_nothing_invented(control, full, rng):
    groups = defaultdict(list)
    for point in REFERENCES["points"]:
        if control in point:
            groups[ends_of(point), point["contacts"]].append(point)
    groups = sorted(groups.values(), key=len, reverse=True)
    # What costs is the number of different ends; at prescribed shortening, that of contacts.
    if control == "shortening":
        contacts = 2 if full else 1
        groups = [[fewer_contacts(point, contacts) for point in points] for points in groups]
        groups = groups if full else [groups[0][:3]]
    elif not full:
        many = sum(len(points) > 4 for points in groups)
        chosen = [*range(many), *rng.choice(np.arange(many, len(groups)), 2, replace=False)]
        groups = [
            [points[i] for i in rng.permutation(len(points))[:6]]
            for points in map(groups.__getitem__, chosen)
        ]
    wrong, ties, compared = [], 0, 0
    for points in groups:
        found = find(points)
        assert numbered_by_curvature(found), points
        for at, point in enumerate(points):
            compared += len(point["states"])
            for what, rows in zip(("missed", "invented"), compare(point, found, at), strict=True):
                ties += sum(row["tie"] for row in rows)
                place = {key: value for key, value in point.items() if key != "states"}
                wrong += [(what, place, row) for row in rows if not row["tie"]]
    assert not wrong, f"{len(wrong)} of {compared}: {wrong[:5]}"
    assert ties <= 2 + compared // 1000


def test_the_stored_points_are_of_every_sort():
    """Every regime, word, control and kind of end turns up often enough to matter."""
    labels = Counter(row[0].split()[-1] for point in REFERENCES["points"] for row in point["states"])
    assert min(labels[regime] for regime in ("straight", "free", "point", "line")) >= 100
    further = sum(
        any(set(part) & set("123456789") for part in row[0].split()[2:3])
        for point in REFERENCES["points"]
        for row in point["states"]
    )
    assert further >= 100
    kinds = Counter(tuple(end_name(k) for k in point["ends"]) for point in REFERENCES["points"])
    assert all(kinds[pair] >= 5 for pair in (("clamped", "clamped"), ("pinned", "pinned")))
