"""Input that makes no sense is refused, with a message that names it."""

import pytest

import elastica
from elastica import Status


@pytest.mark.parametrize("call", [elastica.find_states, lambda **given: elastica.solve("U", **given)])
@pytest.mark.parametrize("given", [{}, {"P": 2.0, "shortening": 0.01}])
def test_load_and_shortening_both_or_neither(call, given):
    with pytest.raises(ValueError, match="either P or shortening"):
        call(H=0.1, **given)


@pytest.mark.parametrize("ends", ["-1/clamped", "clamped/-0.5", "nan/nan", "pinned/-1e-9"])
def test_negative_springs(ends):
    with pytest.raises(ValueError, match="k >= 0"):
        elastica.solve("U", P=2.0, H=0.1, ends=ends)


@pytest.mark.parametrize(
    "state", ["UX", "UaD", "U-D", "-U", "U-a", "aB1", "B1a", "0a", "UDD-", "aU-", "U" * 51]
)
def test_names_without_meaning(state):
    with pytest.raises(ValueError, match="state = "):
        elastica.solve(state, P=2.0, H=0.1)


@pytest.mark.parametrize("contacts", [11, -1, 2.0])
def test_too_many_contacts_to_enumerate(contacts):
    with pytest.raises(ValueError, match="max_contacts"):
        elastica.find_states(P=2.0, H=0.1, max_contacts=contacts)


def test_a_shortening_that_a_state_cannot_have():
    s = elastica.solve("U", shortening=[1e-6, 0.02, -1.0], H=0.05)
    assert s.status.tolist() == [Status.NO_EQUILIBRIUM, Status.SOLVED, Status.FAILED]
    assert list(s.reasons) == [2]
