"""What a chain refuses, what it warns of, and what it never returns."""

import warnings

import numpy as np
import pytest

import elastica
from elastica import Status


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("B1", {"links": 3}, "at least 4"),
        ("U", {"links": 7}, "at least 8"),
        ("UDUD", {"links": 19}, "at least 20"),
        ("U", {"links": 40.5}, "whole number"),
        ("U", {"links": True}, "whole number"),
        ("U", {"clamp": "hard"}, "consistent, published"),
        ("UD", {"clamp": "published"}, "single contact"),
        ("U", {"stiffness": [1, 0, 1]}, "0 at s = 0.5"),
        ("U", {"stiffness": [1, -2.0]}, "-2 at s = 1"),
        ("U", {"stiffness": [1, np.nan, 1]}, "nan at s = 0.5"),
        ("U", {"stiffness": [1, np.inf]}, "inf at s = 1"),
        ("U", {"stiffness": np.ones(402)}, "links = 401"),
        ("U", {"stiffness": np.ones((2, 3))}, "1 to links"),
        ("U", {"stiffness": []}, "1 to links"),
        ("U", {"stiffness": "thick"}, "'thick' is text"),
        ("U", {"stiffness": lambda s: s[:2]}, "number for each"),
        ("U", {"stiffness": lambda s: -s}, "every value"),
        ("UD-", {"stiffness": [1, 2]}, "between two lines"),
        ("U", {"method": "springs"}, "use exact or chain"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_remedy(name, arguments, message):
    with pytest.raises(ValueError, match=message):
        elastica.solve(name, **{"P": 2.5, "H": 0.1, "method": "chain"} | arguments)


def test_arguments_of_the_chain_are_for_the_chain():
    with pytest.raises(ValueError, match="add method='chain'"):
        elastica.solve("U", P=2.5, H=0.1, links=100)


def test_few_links_work():
    for name, links, P in (("0", 4, 0.5), ("B1", 12, 1.4), ("U", 8, 1.5)):
        for clamp in ("consistent", "published"):
            s = elastica.solve(
                name, P=P, H=0.6 if name == "B1" else 0.1, method="chain", links=links, clamp=clamp
            )
            assert s.status == Status.SOLVED, (name, clamp, s.reasons)


def test_bad_numbers_spoil_their_points_only():
    s = elastica.solve("U", P=[2.5, np.nan, -1, 2.5], H=[0.1, 0.1, 0.1, 0], method="chain", links=50)
    assert s.status.tolist() == [0, 3, 3, 3] and set(s.reasons) == {1, 2, 3}


def test_too_few_links_for_the_load_are_reported():
    with pytest.warns(UserWarning, match="use links = 25"):
        elastica.solve("B1", P=7.5, H=0.4, ends="pinned-pinned", method="chain", links=20)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        elastica.solve("B1", P=7.5, H=0.4, ends="pinned-pinned", method="chain", links=26)
    lost = elastica.solve("UD", P=100, H=0.1, method="chain", links=50)
    assert lost.status == Status.FAILED and "use links = " in lost.reasons[0]
    wanted = int(lost.reasons[0].split("=")[-1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert elastica.solve("UDU", P=100, H=0.05, method="chain", links=2 * wanted).status == Status.SOLVED


@pytest.mark.filterwarnings("ignore:links = ")
def test_no_parasitic_equilibrium_is_returned():
    """20 links at 30 Euler loads have some 90 equilibria, the strip 11: what is found is one of those."""
    names = [f"B{mode}" for mode in range(1, 12)]
    for name in names:
        exact, chain = (
            elastica.solve(name, P=7.5, H=0.4, ends="pinned-pinned", **method)
            for method in ({}, {"method": "chain", "links": 20})
        )
        assert (chain.status == Status.NO_EQUILIBRIUM) == (exact.status == Status.NO_EQUILIBRIUM)
        if exact.status in (Status.SOLVED, Status.INADMISSIBLE):
            theta, far = chain.shape(200).theta, exact.shape(200).theta
            assert np.abs(theta - far).max() < 0.5 * np.abs(far).max()
            assert (np.diff(np.sign(theta[2:-2])) != 0).sum() == (np.diff(np.sign(far[2:-2])) != 0).sum()
