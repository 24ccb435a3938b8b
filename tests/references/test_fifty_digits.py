"""A thousand states of all kinds and ends against 50-digit references made by an independent program."""

import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from references.make_states import reference

import elastica
from elastica import Status

RECORDS = json.loads((Path(__file__).parent / "states.json").read_text())["states"]
SAMPLE = 6
GROUPS = defaultdict(list)
for record in RECORDS:
    GROUPS[record["state"], record["ends"]].append(record)


def numbers(records, key):
    return np.array([np.array(record[key], float) for record in records])


@pytest.fixture(scope="module")
def errors():
    """Relative errors of every quantity over all records, and of `error` itself."""
    found = defaultdict(list)
    for (state, ends), records in GROUPS.items():
        P, H = (np.array([record[key] for record in records]) for key in "PH")
        s = elastica.solve(state, P=P, H=H, ends=ends)
        assert np.isin(s.status, (Status.SOLVED, Status.INADMISSIBLE)).all()
        kappa, lengths, energy = (numbers(records, key) for key in ("kappa", "lengths", "energy"))
        curvature = np.abs(s.curvature - kappa)
        found["curvature"] += list(curvature / np.where(kappa > 0, kappa, 1))
        found["lengths"] += list(np.abs(s.lengths / lengths - 1).max(axis=1))
        for key in ("energy", "bending_energy", "shortening", "max_slope"):
            found[key] += list(np.abs(getattr(s, key) / numbers(records, key) - 1))
        if s.reaction.size:
            reaction = numbers(records, "reaction")
            found["reaction"] += list(np.abs(s.reaction[:, 0] - reaction) / np.maximum(np.abs(reaction), P))
            position = numbers(records, "contact_position")
            found["contact_position"] += list(np.abs(s.contact_position[:, 0] - position))
        solved = s.status == Status.SOLVED
        exact = numbers(records, "eigenvalues")[solved]
        scale = np.maximum(np.abs(exact), np.pi**2)
        found["eigenvalues"] += list((np.abs(s.eigenvalues(4)[solved] - exact) / scale).max(axis=1))
        true = np.max(
            [
                curvature / (2 * np.pi * np.sqrt(P)),
                np.abs(s.lengths - lengths).max(axis=1),
                np.abs(s.energy / energy - 1),
            ],
            axis=0,
        )
        found["true error over its bound"] += list(true / s.error)
        found["negative eigenvalues minus index"] += list(
            (exact < -1e-9).sum(axis=1) + _flat_buckled(s, P)[solved] - s.index[solved]
        )
    return {name: np.array(values) for name, values in found.items()}


def _flat_buckled(s, P):
    """The flat stretch, whose direction is not among the eigenvalues of the free segments."""
    return np.sqrt(P) * s.flat_length > 1


@pytest.mark.parametrize(
    "quantity",
    [
        "curvature",
        "lengths",
        "energy",
        "bending_energy",
        "shortening",
        "max_slope",
        "reaction",
        "contact_position",
        "eigenvalues",
    ],
)
def test_accuracy(errors, quantity):
    assert errors[quantity].max() <= 1e-10
    assert np.median(errors[quantity]) <= 1e-12


def test_error_estimate_bounds_the_true_error_and_is_not_idle(errors):
    ratio = errors["true error over its bound"]
    assert (ratio <= 1).mean() >= 0.99
    assert np.median(ratio) >= 1e-3


def test_index_counts_the_negative_eigenvalues(errors):
    assert not errors["negative eigenvalues minus index"].any()


def test_stored_references_can_be_computed_again(full, rng):
    chosen = RECORDS if full else rng.choice(RECORDS, SAMPLE, replace=False)
    for record in chosen:
        again = reference(record["state"], record["ends"], record["P"], record["H"])
        assert {key: again[key] for key in record} == record
