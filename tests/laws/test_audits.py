"""Random states of every kind: events against dense scans of loads, states against their own shortening."""

import numpy as np
import pytest

import elastica
from elastica import Event, Status
from elastica.state import parse_state

FIND_AGAIN = 4
"""A root may have another number at prescribed shortening."""


def random_end(rng):
    kind = rng.random()
    return "clamped" if kind < 0.35 else "pinned" if kind < 0.7 else f"{np.exp(rng.uniform(-2, 3)):.3g}"


def random_state(rng, contacts):
    """Ends, and a state with this number of contacts that bent strips of these ends have."""
    ends = f"{random_end(rng)}/{random_end(rng)}"
    names = [
        name for name in elastica.states(ends, contacts) if len(parse_state(name, ends).word) == contacts
    ]
    return str(rng.choice([name for name in names if name != "0"])), ends


@pytest.mark.at_least(8, full=40)
def test_events_are_where_a_dense_scan_sees_them(compared, full, rng):
    """Every change of status or index has an event; no event is of the state with itself."""
    cases, wrong = 40 if full else 8, []
    loads = np.linspace(0.02, 12, 801) if full else np.linspace(0.02, 8, 201)
    for case in range(cases):
        contacts = (1, 2, 0, 1, 3)[case % 5]
        state, ends = random_state(rng, contacts)
        H = float(np.exp(rng.uniform(np.log(0.02), np.log(0.3)))) / max(1, 0.8 * contacts)
        s = elastica.solve(state, P=loads, H=H, ends=ends)
        index = np.where(s.status == Status.SOLVED, s.index, -1)
        events = elastica.transitions(state, H, ends, P_max=loads[-1])
        changes = np.diff(index) != 0
        compared(changes)
        for i in np.flatnonzero(changes):
            if not ((events.P >= loads[i] - 1e-9) & (events.P <= loads[i + 1] + 1e-9)).any():
                wrong.append((state, ends, H, loads[i], index[i], index[i + 1]))
        wrong += [(state, ends, H, P) for P in events.P[events.other_state == state]]
    assert not wrong, f"{len(wrong)} changes of {cases} states: {wrong[:5]}"


@pytest.mark.at_least(12, full=300)
def test_stable_states_come_back_from_their_own_shortening(compared, full, rng):
    wanted, seen, lost = 300 if full else 12, 0, []
    while seen < wanted:
        ends = f"{random_end(rng)}/{random_end(rng)}"
        contacts = int(rng.integers(1, 4 if full else 3))
        H, P = np.exp(rng.uniform(np.log(0.01), np.log(0.3))), rng.uniform(0.1, 12, 60)
        names = [name for name in elastica.states(ends, contacts) if name != "0"]
        for state in rng.permutation(names)[:8]:
            s = elastica.solve(state, P=P, H=H, ends=ends)
            some = np.flatnonzero(s.stable & (s.max_slope < np.pi / 2 - 1e-3) & (s.shortening > 1e-9))[:4]
            left = some
            for number in range(1, FIND_AGAIN if parse_state(state, ends).word else 2):
                if not left.size:
                    break
                name = state if number == 1 else f"{state}:{number}"
                back = elastica.solve(name, shortening=s.shortening[left], H=H, ends=ends)
                turned = np.abs(back.curvature - s.curvature[left]) / np.sqrt(1 + 40 * P[left])
                same = (np.abs(back.P / P[left] - 1) < 1e-6) & (turned < 1e-6)
                left = left[~(same & (back.status == Status.SOLVED))]
            compared(s.stable[some])
            seen += some.size
            lost += [(state, ends, float(H), float(P[i])) for i in left]
    assert not lost, f"{len(lost)} of {seen}: {lost[:5]}"


def test_next_to_a_fold_both_roots_are_found():
    """Where a node of the table lies between them, or beside both, by less than the table knows."""
    P = 8.299635272455 * (1 + np.array([1e-7, 1e-6, 2e-6, 1e-5, 1e-4]))
    both = [elastica.solve(name, P=P, H=0.1639, ends="1.79/clamped") for name in ("aUa", "aUa:2")]
    assert [s.index.tolist() for s in both] == [[4] * 5, [3] * 5]
    assert (both[0].curvature < both[1].curvature).all()


def test_a_branch_that_passes_90_degrees_ends_at_its_fold():
    for state, ends, H, P, index in (
        ("UD", "clamped-clamped", 0.1, 6.96156174, 0),
        ("U", "pinned/clamped", 0.1909, None, 0),
    ):
        events = elastica.transitions(state, H, ends, P_max=8)
        passed = np.flatnonzero((events.event == Event.RIGHT_ANGLE) & (events.index_after >= 0))
        assert events.index_before[passed].tolist() == events.index_after[passed].tolist() == [index]
        ended = np.flatnonzero((events.event == Event.FOLD) & (events.index_before == index))
        assert len(ended) == 1 and events.P[ended[0]] > events.P[passed[0]]
        assert P is None or abs(events.P[ended[0]] / P - 1) < 1e-8


def test_a_contact_lost_where_a_wall_is_passed_too_is_no_event():
    events = elastica.transitions("Ua", 0.113, "8.83/clamped", P_max=3)
    assert (events.event[0], events.index_after[0]) == (Event.WALL_TOUCHED, 1)
    assert Event.REACTION_LOST not in events.event
