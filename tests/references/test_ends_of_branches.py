"""What happens between the last load looked at and the end of a branch."""

import numpy as np
import pytest

import elastica
from elastica import Event, Status

CC, PP, CP = "clamped-clamped", "pinned-pinned", "clamped-pinned"


@pytest.mark.parametrize(
    ("state", "ends", "H", "event", "P", "before", "after"),
    [
        ("U-", PP, 0.2879, Event.POINT_TO_LINE, 0.803374926, -1, 0),
        ("U-", PP, 0.27, Event.FOLD, (0.264080153659 / 0.27) ** 2, 0, -1),
        ("U-", CC, 0.19, Event.FLAT_BUCKLES, 7.6171202007, 0, 1),
        ("U-", "1.5/1.5", 0.2, Event.FLAT_BUCKLES, 6.739473, 0, 1),
        ("UD", CC, 0.143, Event.FOLD, 3.183620177, 0, -1),
        ("UD", CC, 0.143, Event.RIGHT_ANGLE, 2.941537379, 0, 0),
        ("U", CC, 0.19, Event.RIGHT_ANGLE, 7.655401784, 2, -1),
        ("B1", PP, 0.45, Event.ENDS_MEET, 0.54584476, 0, 1),
        ("B1", CC, 0.45, Event.ENDS_MEET, 2.18337904, 0, 1),
    ],
)
def test_events_next_to_the_end_of_a_branch(state, ends, H, event, P, before, after):
    events = elastica.transitions(state, H, ends)
    here = np.flatnonzero((events.event == event) & (np.abs(events.P / P - 1) < 2e-6))
    assert [(events.index_before[i], events.index_after[i]) for i in here] == [(before, after)]


@pytest.mark.parametrize(("state", "ends", "H"), [("UD", CC, 0.143), ("U-", PP, 0.27), ("U", CC, 0.19)])
def test_a_right_angle_is_one(state, ends, H):
    events = elastica.transitions(state, H, ends)
    rows = np.flatnonzero(events.event == Event.RIGHT_ANGLE)
    assert rows.size
    for row in rows:
        P = events.P[row] * (1 + np.array([-1e-7, 1e-7]))
        slope = np.degrees(elastica.solve(state, P=P, H=H, ends=ends).max_slope)
        assert np.nanmax(np.abs(slope - 90)) < 0.2


SCANNED = [
    ("U-", CC, 0.19),
    ("U-", PP, 0.28),
    ("Ua-", "0.5/0.5", 0.17),
    ("aUa-", "1.5/1.5", 0.19),
    ("UD", CC, 0.143),
    ("B1", PP, 0.45),
    ("UU", CP, 0.12),
    ("Ua", CC, 0.08),
]


@pytest.mark.parametrize(("state", "ends", "H"), SCANNED)
def test_a_dense_scan_sees_no_change_without_an_event(state, ends, H):
    """Wherever status or index changes between neighbouring loads, an event lies between them."""
    P = np.linspace(0.05, 12, 601)
    s = elastica.solve(state, P=P, H=H, ends=ends)
    there = s.status == Status.SOLVED
    index = np.where(there, s.index, -1)
    changes = np.flatnonzero(index[1:] != index[:-1])
    events = elastica.transitions(state, H, ends)
    without = [
        (P[i], index[i], index[i + 1])
        for i in changes
        if not ((events.P >= P[i] - 1e-9) & (events.P <= P[i + 1] + 1e-9)).any()
    ]
    assert (without, len(changes) >= 2) == ([], True)


@pytest.mark.parametrize(
    ("state", "ends", "H", "P"),
    [
        ("U-", PP, 0.28791846545, 0.8146160641),
        ("U-", CC, 0.19, 7.7),
        ("aUa", CC, 0.293876, 3.11911),
        ("UD", CC, 0.143, 3.18),
    ],
)
def test_a_state_comes_back_from_its_own_shortening(state, ends, H, P):
    loaded = elastica.solve(state, P=P, H=H, ends=ends)
    assert loaded.status == Status.SOLVED
    # Roots are numbered by curvature, and another may have the first number at this shortening.
    roots = [
        elastica.solve(name, shortening=loaded.shortening, H=H, ends=ends) for name in (state, f"{state}:2")
    ]
    away = [abs(root.P / P - 1) + abs(root.curvature - loaded.curvature) for root in roots]
    assert np.nanmin(away) < 1e-6
