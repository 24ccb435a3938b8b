"""What `elastica accuracy` says of the cost of each quantity of a state."""

import numpy as np
import pytest

from elastica.codes import Status
from studies.accuracy import floor, report


@pytest.fixture(scope="module")
def measured():
    with pytest.MonkeyPatch.context() as few:
        for name, value in {
            "SIZES": (30, 60),
            "SOLVED": 40,
            "DENSE": 4,
            "OF_CONTACTS": 5,
            "REPEATS": 1,
        }.items():
            few.setattr(floor, name, value)
        few.setattr(floor, "CONTACTS", (1, 2, 5))
        yield floor.floor()


def test_every_row_and_column_is_measured(measured):
    for name in ("solve_seconds", "floor_seconds", "quantity_seconds", "contact_seconds"):
        assert (measured[name] > 0).all(), name
    assert measured["floor_state"].values.tolist()[:4] == ["U", "UD", "UDU", "(UD)×10"]
    assert measured["quantity"].values.tolist() == ["eigenvalues", "frequencies", "shape"]


def test_segments_and_dense_matrices_agree(measured):
    assert (measured["difference"].sel(quantity="eigenvalues") <= 1e-10).all()
    assert (measured["difference"].sel(quantity="frequencies") <= 1e-9).all()
    assert np.isnan(measured["difference"].sel(quantity="shape")).all()


def test_tables_and_figure(measured):
    text = "\n".join([*report._floor(measured), *report._quantities(measured), *report._contacts(measured)])
    for state in measured["floor_state"].values:
        assert f"| {state} | eigenvalues |" in text
    assert "nan" not in text
    (axes,) = report.figure_of_contacts(measured).axes
    assert [line.get_xdata().tolist() for line in axes.lines] == 5 * [[1, 2, 5]]


@pytest.mark.parametrize("contacts", floor.CONTACTS)
def test_states_are_there(contacts):
    solved = floor._solved(floor.alternating(contacts), 10)
    assert len(solved.state.word) == contacts
    assert solved.P.size == 10
    assert (solved.status == Status.SOLVED).all()
