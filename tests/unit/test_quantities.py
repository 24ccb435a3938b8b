"""The one table of quantities, from which solutions, found states, datasets and their units follow."""

import numpy as np
import pytest

import elastica
from elastica.control import CONTROLS
from elastica.properties import ON_DEMAND, QUANTITIES, straight
from elastica.scene import Scene
from elastica.solution import QUANTITIES as OF_SOLUTIONS
from elastica.strip import PHYSICAL
from studies.schema import VARIABLES
from studies.units import SCALES


@pytest.mark.parametrize("state", ["0", "B1", "U", "Ua", "U-", "UD", "UUU"])
@pytest.mark.parametrize("method", ["exact", "chain"])
def test_arrays_are_as_the_table_says(state, method):
    H = np.full(2, 0.1)
    for control, given in (("P", [5.0, np.nan]), ("shortening", [0.03, np.nan])):
        s = elastica.solve(state, H=H, method=method, **{control: given})
        contacts = len(s.state.word)
        widths = {"": (), "contact": (contacts,), "segment": (0 if s.state.straight else contacts + 1,)}
        for name, quantity in OF_SOLUTIONS.items():
            array = getattr(s, name)
            assert array.dtype == quantity.dtype and array.shape == (2, *widths[quantity.along]), name
            if name not in ("status", "H", "P"):
                assert np.array_equal(array[1], np.full(array.shape[1:], quantity.missing), equal_nan=True)


def test_a_solution_says_all_that_is_known():
    known = straight(np.array([50.0]), Scene(elastica.solve("0", P=1.0, H=0.1).ends, np.array([0.1])))
    assert known.keys() == QUANTITIES.keys()
    own = elastica.Solution.__annotations__.keys() - {"state", "ends", "control", "reasons"}
    assert OF_SOLUTIONS.keys() == QUANTITIES.keys() | own


def test_found_states_and_datasets_have_the_quantities_of_the_table():
    found = elastica.find_states(P=3.0, H=0.1, max_contacts=1)
    assert set(found.columns) == {"point", "state", *QUANTITIES}
    assert VARIABLES.keys() == (QUANTITIES.keys() - {"H"}) | ON_DEMAND.keys() | {
        *("stable_count", "preferred_state")
    }
    assert CONTROLS.keys() <= VARIABLES.keys()
    assert set(SCALES.values()) <= PHYSICAL.keys()


@pytest.mark.parametrize("answer", [elastica.Solution, elastica.FoundStates])
def test_docstrings_list_every_quantity(answer):
    for name in QUANTITIES:
        assert f"\n    {name} : ndarray" in answer.__doc__
    assert "{quantities}" not in answer.__doc__
