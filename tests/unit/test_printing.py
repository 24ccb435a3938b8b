"""What answers print: names of codes, one line a point, a state or an event."""

import numpy as np
import pytest
import xarray as xr

import elastica
from elastica import Event, Stability, Status


def test_codes_print_as_their_names():
    assert f"{Stability.STABLE} {Status.SOLVED} {Event.FOLD}" == "stable solved fold"
    assert str(Stability(-1)) == "not_solved"
    codes = np.array([[0, 1], [-1, 4]], np.int8)
    assert Stability.names(codes).tolist() == [["stable", "unstable"], ["not_solved", "critical"]]
    assert Status.names(np.zeros(0, np.int8)).tolist() == []


def test_a_solution_prints_names_and_its_first_points():
    s = elastica.solve("U", P=[2.5, 0.2, -1.0, 4.5], H=0.1)
    head, names, *lines, failed = repr(s).splitlines()
    assert failed == f"failed at 1 point: {s.reasons[2]}"
    assert head == "Solution of U, clamped-clamped, at 4 points, P prescribed"
    assert names.split()[:4] == ["P", "H", "status", "stability"]
    assert [line.split()[2:4] for line in lines] == [
        [str(Status(status)), str(Stability(stability))]
        for status, stability in zip(s.status, s.stability, strict=True)
    ]
    assert lines[0].split()[:4] == ["2.5", "0.1", "solved", "stable"]
    many = repr(elastica.solve("0", P=np.linspace(0, 1, 1000), H=0.1)).splitlines()
    assert len(many) == 13 and many[-1] == "… 990 more"
    assert "1 point," in repr(elastica.solve("0", P=0.5, H=0.1, method="chain", links=20))
    assert repr(elastica.solve("0", P=xr.DataArray([0.5], dims="day"), H=0.1)).endswith("along day")


def test_what_failed_is_printed_with_its_reason():
    found = elastica.find_states(P=[-1.0, 2.0, -1.0], H=0.1, max_contacts=1)
    assert str(found).splitlines()[-1] == f"failed at 2 points: {found.reasons[0]}"


def test_stable_means_the_same_by_every_method():
    # At P = 2.5 the exact verdict is stable and the conventional one is not.
    s = elastica.solve("U", P=[1.5, 2.5, 0.1], H=0.1)
    assert s.stable.dtype == s.conventional().stable.dtype == bool
    assert s.stable.tolist() == [True, True, False] and s.conventional().stable.tolist() == [
        True,
        False,
        False,
    ]
    chain = elastica.solve("U", P=[1.5, 2.5, 0.1], H=0.1, method="chain", links=50)
    assert chain.stable.tolist() == [True, True, False] and chain.conventional().stable.dtype == bool


@pytest.mark.parametrize("control", ["P", "shortening"])
def test_found_states_are_iterated_printed_and_made_a_table(control):
    found = elastica.find_states(H=[0.1, 0.05], max_contacts=2, **{control: 6.0 if control == "P" else 0.02})
    rows, table = list(found), found.to_dataframe()
    assert len(rows) == len(found) == len(table) > 4
    least = "energy" if control == "P" else "bending_energy"
    assert str(found) == repr(found) and least in str(found).splitlines()[0].split()
    printed = [line.split() for line in str(found).splitlines()[1 : len(found) + 1]]
    for i, (row, line) in enumerate(zip(rows, printed, strict=True)):
        assert row.state == table.state[i] == line[2] == found.state[i]
        assert isinstance(row.stability, Stability) and isinstance(row.status, Status)
        assert str(row.stability) == table.stability[i] == line[3]
        assert float(line[5]) == pytest.approx(getattr(row, least), rel=1e-8)
        assert row.reaction[0] == table.reaction_1[i] or np.isnan(row.reaction[0])
    for point in (0, 1):
        energies = [float(line[5]) for row, line in zip(rows, printed, strict=True) if row.point == point]
        assert energies == sorted(energies)
    labelled = elastica.find_states(
        H=xr.DataArray([0.1, 0.05], dims="wall", coords={"wall": list("ab")}), P=6.0
    )
    assert set(labelled.to_dataframe().wall) == {"a", "b"}


def test_transitions_are_iterated_and_made_a_table():
    events = elastica.transitions("U", H=0.1)
    rows, table = list(events), events.to_dataframe()
    assert [str(row.event) for row in rows] == table.event.tolist() and "point_to_line" in set(table.event)
    assert [row.P for row in rows] == table.P.tolist() and repr(events) == str(events)
    assert isinstance(rows[0].event, Event) and rows[0].state == "U"


def test_completion_shows_what_is_for_users():
    assert [name for name in dir(elastica) if not name.startswith("_")] == sorted(elastica.__all__)
    for name in elastica.__all__:
        assert name in elastica.__doc__ or name[0].isupper()
