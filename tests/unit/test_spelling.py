import pytest

import elastica
from elastica.ends import parse_ends
from elastica.spelling import did_you_mean, meant
from elastica.state import parse_state


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("ENERGY", "energy"),
        ("enrgy", "energy"),
        ("shorten", "shortening"),
        ("x", None),
        ("", None),
        (7, None),
    ],
)
def test_the_nearest_name_is_meant_or_none(text, name):
    assert meant(text, ["energy", "shortening", "P"]) == name
    assert did_you_mean(text, ["energy", "shortening", "P"]) == (f" (did you mean {name!r}?)" if name else "")


STATES = {"u": "U", "u-": "U-", "b1": "B1", "Au": "aU", "uda:2": "UDa:2", "U–": "U-", " UD ": "UD"}
STATES |= {"UPPER": "U", "straight": "0", 0: "0", "Q": None, "U3": None, "": None, None: None}
ENDS = {"clamp": "clamped-clamped", "Clamped-Pinned": "clamped-pinned", "clampd/pined": "clamped-pinned"}
ENDS |= {"0.5": "0.5/0.5", "pinned 2": "pinned/2", "fixed—hinged": "clamped-pinned", "free": None}
ENDS |= {"clamped-free": None, "-1/2": None, "a-b-c": None, None: None}


@pytest.mark.parametrize(("text", "name"), STATES.items())
def test_a_state_that_is_misspelled(text, name):
    with pytest.raises(ValueError, match="is not known") as problem:
        parse_state(text)
    assert (f" (did you mean {name!r}?); use 0" in str(problem.value)) == (name is not None)
    assert ("did you mean" in str(problem.value)) == (name is not None)


@pytest.mark.parametrize(("text", "ends"), ENDS.items())
def test_ends_that_are_misspelled(text, ends):
    with pytest.raises(ValueError, match="is not known") as problem:
        parse_ends(text)
    assert (f" (did you mean {ends!r}?); write" in str(problem.value)) == (ends is not None)
    assert ("did you mean" in str(problem.value)) == (ends is not None)


def test_methods_and_controls_that_are_misspelled():
    with pytest.raises(ValueError, match=r"method = 'Chain' is not known \(did you mean 'chain'\?\)"):
        elastica.solve("U", P=2, H=0.1, method="Chain")
    with pytest.raises(ValueError, match=r"clamp = 'publish' is not known \(did you mean 'published'\?\)"):
        elastica.solve("U", P=2, H=0.1, method="chain", clamp="publish")
    with pytest.raises(ValueError, match=r"control = 'p' is not known \(did you mean 'P'\?\)"):
        elastica.transitions("U", H=0.1, control="p")
