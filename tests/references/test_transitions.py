"""Events against the closed formulas of their loads, against both sides of each, and along the shortening."""

import numpy as np
import pytest
from references.onsets import loads

import elastica
from elastica import Event, Stability, Status

CC, PP = "clamped-clamped", "pinned-pinned"


def only(events, event, after=None):
    """Rows of one kind of event, as a dictionary of columns; at the lowest load."""
    rows = np.flatnonzero(events.event == event)
    if after is not None:
        rows = rows[events.index_after[rows] == after]
    return rows[np.argmin(events.P[rows])]


@pytest.mark.parametrize(("ends", "scale"), [(CC, 1), (PP, 4)])
def test_the_one_contact_sequence(ends, scale):
    """Touching, point to line and the buckling of the flat stretch have closed forms."""
    H = np.array([0.02, 0.05, 0.1])
    point, line = elastica.transitions("U", H, ends), elastica.transitions("U-", H, ends)
    touches = {0.02: 1.0004940594593, 0.05: 1.003107058816, 0.10: 1.0127127055026}
    to_line = {0.02: 3.9975966930104, 0.05: 3.984869364316, 0.10: 3.9378211842362}
    buckles = {
        CC: {0.02: 8.9918702175, 0.05: 8.9481758993, 0.10: 8.7758689760},
        PP: {0.02: 3.9951660372, 0.05: 3.9685924505, 0.10: 3.8506274993},
    }[ends]
    for gap in H:
        here = point.H == gap
        first = np.flatnonzero(here)[:2]
        assert point.event[first].tolist() == [Event.REACTION_LOST, Event.POINT_TO_LINE]
        assert scale * point.P[first] == pytest.approx([touches[gap], to_line[gap]], abs=1e-10)
        assert point.index_before[first].tolist() == [-1, 0]
        assert point.index_after[first].tolist() == [0, -1]
        assert point.other_state[first].tolist() == ["B1", "U-"]
        begins, flat = np.flatnonzero(line.H == gap)[:2]
        assert line.P[begins] == pytest.approx(point.P[first[1]], abs=1e-10)
        assert (line.event[flat], line.index_before[flat], line.index_after[flat]) == (
            Event.FLAT_BUCKLES,
            0,
            1,
        )
        assert line.P[flat] == pytest.approx(buckles[gap], abs=2e-10)
        assert line.other_state[flat] == "UU"


def test_the_free_mode_between_its_euler_load_and_the_wall():
    events = elastica.transitions("B1", 0.07, "0.3/0.3")
    assert events.event.tolist() == [Event.BUCKLES, Event.WALL_TOUCHED]
    assert events.P[0] == pytest.approx(0.74527395279, abs=1e-10)
    assert events.other_state.tolist() == ["0", "U"]


def test_the_asymmetric_branch():
    """It runs back from the point-to-line load to where it meets the second free mode at both walls."""
    events = elastica.transitions("Ua", 0.05)
    lost, line = only(events, Event.REACTION_LOST), only(events, Event.POINT_TO_LINE)
    assert events.P[lost] == pytest.approx(2.066078, abs=1e-6)
    assert events.P[line] == pytest.approx(float(loads("point_to_line", 0.05)), abs=1e-10)
    assert (events.other_state[lost], events.index_after[lost]) == ("B2", 1)
    second = elastica.transitions("B2", 0.05)
    assert second.P[-1] == pytest.approx(events.P[lost], abs=1e-10)


@pytest.mark.parametrize(("state", "ends"), [("U", CC), ("UD", PP)])
def test_what_is_met_is_known_at_narrow_gaps_too(state, ends):
    events = elastica.transitions(state, H=[1e-4, 0.002, 0.01, 0.03], ends=ends)
    alone = np.isin(events.event, (Event.FOLD, Event.RIGHT_ANGLE))
    assert events.other_state[~alone].all()
    first = {"U": "B1", "UD": "B2"}[state]
    assert events.other_state[np.unique(events.H, return_index=True)[1]].tolist() == [first] * 4


def test_the_fold_at_prescribed_shortening():
    events = elastica.transitions("Ua", 0.05, control="shortening")
    fold = only(events, Event.FOLD, after=1)
    assert events.P[fold] == pytest.approx(3.65445, abs=5e-6)
    assert events.shortening[fold] == pytest.approx(0.007386777, abs=5e-10)
    edge = events.shortening[fold]
    above = elastica.solve("Ua", shortening=edge * (1 + 1e-8), H=0.05)
    below = elastica.solve("Ua", shortening=edge * (1 - 1e-8), H=0.05)
    assert (above.status, below.status) == (Status.SOLVED, Status.NO_EQUILIBRIUM)


@pytest.mark.parametrize("state", ["U", "Ua", "UD", "UU"])
def test_each_event_is_seen_by_solving_on_both_sides(state):
    """Where a state begins or ends, solve finds it on one side only; where it goes on, with both indices."""
    events = elastica.transitions(state, [0.03, 0.08])
    assert len(events) > 3
    for row in range(len(events)):
        P = events.P[row] * (1 + np.array([-1e-6, 1e-6]))
        s = elastica.solve(state, P=P, H=events.H[row])
        for side, index in enumerate((events.index_before[row], events.index_after[row])):
            if index >= 0:
                assert (s.status[side], s.index[side]) == (Status.SOLVED, index)
                assert s.stability[side] in (Stability.STABLE, Stability.UNSTABLE)
            else:
                # Another root may have taken the number; it is no neighbour of this one.
                other = 1 - side
                there = s.status[side] == Status.SOLVED
                assert not there or abs(s.energy[side] - s.energy[other]) > 1e-5


def test_mistakes_say_what_is_allowed():
    with pytest.raises(ValueError, match='use "P" or "shortening"'):
        elastica.transitions("U", 0.1, control="force")
    with pytest.raises(ValueError, match="half gaps from"):
        elastica.transitions("U", [0.1, -1.0])
    with pytest.raises(ValueError, match="state = "):
        elastica.transitions("X", 0.1)
