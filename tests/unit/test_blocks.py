"""How many points are computed at a time changes nothing but the time."""

import numpy as np
import pytest

import elastica
from elastica import blocks
from elastica.codes import Status
from elastica.solution import QUANTITIES

POINTS = 100
SIZES = 9, 64
"""Of blocks, beside one block of all points."""
CASES = [
    ("U", "clamped-clamped", (0.5, 12)),
    ("UD", "clamped-clamped", (2, 40)),
    ("UDU", "clamped-clamped", (9, 60)),
    ("U:2", "clamped-clamped", (5, 60)),
    ("Ua", "clamped-pinned", (1, 20)),
    ("U-", "clamped-clamped", (3, 30)),
    ("B1", "clamped-clamped", (1, 30)),
    ("U", "0.3/2.5", (0.5, 10)),
]


@pytest.mark.parametrize(("state", "ends", "loads"), CASES)
def test_the_size_of_blocks_changes_no_bit(state, ends, loads, rng, monkeypatch):
    P = rng.uniform(*loads, POINTS)
    H = np.exp(rng.uniform(np.log(0.003), np.log(0.4), POINTS))
    whole = elastica.solve(state, P=P, H=H, ends=ends)
    assert (whole.status == Status.SOLVED).sum() > 10
    for size in SIZES:
        monkeypatch.setattr(blocks, "POINTS", size)
        in_blocks = elastica.solve(state, P=P, H=H, ends=ends)
        for name in QUANTITIES:
            assert getattr(whole, name).tobytes() == getattr(in_blocks, name).tobytes(), (name, size)


def test_all_states_in_blocks(rng, monkeypatch):
    P, H = rng.uniform(1, 12, 12), rng.uniform(0.02, 0.2, 12)
    whole = elastica.find_states(P=P, H=H, max_contacts=2)
    assert whole.point.size > 40
    monkeypatch.setattr(blocks, "POINTS", 5)
    in_blocks = elastica.find_states(P=P, H=H, max_contacts=2)
    for name in ("point", "state", *elastica.finding.COLUMNS):
        assert getattr(whole, name).tobytes() == getattr(in_blocks, name).tobytes(), name


def test_blocks_make_up_all_points(monkeypatch):
    monkeypatch.setattr(blocks, "POINTS", 4)
    assert [np.arange(9)[block].tolist() for block in blocks.blocks(9)] == [[0, 1, 2, 3], [4, 5, 6, 7], [8]]
    assert blocks.blocks(0) == []
