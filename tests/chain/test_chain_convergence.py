"""Chains of 50 to 3,200 links, odd and even, against the exact state: order of convergence by regression."""

import numpy as np
import pytest

import elastica
from elastica.chain.properties import outline

CC, PP = "clamped-clamped", "pinned-pinned"
EVEN = np.round(np.geomspace(50, 3200, 13) / 2).astype(int) * 2


def errors(exact, links, **kind):
    """Errors of y at the nodes, κ, energy, reaction and the three lowest eigenvalues."""
    chain = elastica.solve(
        exact.state.name, P=exact.P, H=exact.H, ends=exact.ends, method="chain", links=links, **kind
    )
    assert chain.status == 0, chain.reasons
    nodes = np.linspace(0, 1, links + 1)
    polygon = outline(chain.chains[0])
    return [
        np.abs(np.interp(nodes, polygon.s, polygon.y) - exact.shape(links + 1).y).max(),
        abs(chain.curvature - exact.curvature),
        abs(chain.energy - exact.energy),
        np.abs(chain.reaction - exact.reaction).max(),
        *np.abs(chain.eigenvalues(3) - exact.eigenvalues(3)),
    ]


def orders(found, links):
    return -np.polyfit(np.log(links), np.log(found), 1)[0]


@pytest.mark.parametrize(
    ("name", "P", "ends"),
    [
        ("U", 1.5, CC),
        ("U", 2.5, CC),
        ("U", 3.5, CC),
        ("U", 3.9, CC),
        ("UD", 4.5, CC),
        ("Ua", 3.0, CC),
        ("U", 0.5, PP),
        ("UD", 2.0, PP),
        ("UD", 3.0, "clamped/0.05"),
    ],
)
def test_the_consistent_chain_is_of_second_order(name, P, ends):
    exact = elastica.solve(name, P=P, H=0.1, ends=ends)
    # The larger error of an odd and an even chain: where in its link the contact lies changes the constant.
    found = [np.maximum(errors(exact, int(n)), errors(exact, int(n) + 1)) for n in EVEN]
    assert orders(np.array(found), EVEN) == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize(("name", "P", "ends"), [("U-", 2.0, PP), ("U-", 5.0, CC), ("UD-", 14.0, CC)])
def test_lines_are_of_second_order(name, P, ends):
    exact = elastica.solve(name, P=P, H=0.1 if ends == PP else 0.05, ends=ends)
    found = []
    for n in EVEN:
        pair = [
            elastica.solve(name, P=P, H=exact.H, ends=ends, method="chain", links=int(n) + odd)
            for odd in (0, 1)
        ]
        found.append(
            np.max(
                [
                    [
                        abs(c.energy - exact.energy),
                        np.abs(c.reaction - exact.reaction).max(),
                        abs(c.flat_length - exact.flat_length),
                        np.abs(c.contact_position - exact.contact_position).max(),
                    ]
                    for c in pair
                ],
                axis=0,
            )
        )
    assert orders(np.array(found), EVEN) == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize("P", [1.5, 2.5])
def test_the_published_chain_is_of_first_order(P):
    exact = elastica.solve("U", P=P, H=0.1)
    odd = np.array([401, 801, 1601, 3201])
    found = np.array([errors(exact, int(n), clamp="published") for n in odd])
    assert orders(found, odd) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("links", [4, 5, 50, 51, 100])
@pytest.mark.parametrize("kind", ["frozen", "half-link", "pinned"])
def test_euler_loads_of_the_chain_are_those_of_the_theory(links, kind):
    n, ends = links, PP if kind == "pinned" else CC
    clamp = "published" if kind == "frozen" else "consistent"
    s = elastica.solve("0", P=0.2, H=0.1, ends=ends, method="chain", links=links, clamp=clamp)
    load = 0.2 + s.eigenvalues(1)[0] / (4 * np.pi**2)
    angle = {"frozen": np.pi / (n - 1), "half-link": np.pi / n, "pinned": np.pi / (2 * n)}[kind]
    assert load == pytest.approx((n / np.pi) ** 2 * np.sin(angle) ** 2, rel=1e-12)


@pytest.mark.parametrize(("name", "P", "ends"), [("U", 2.5, CC), ("U-", 2.0, PP), ("UD", 2.0, PP)])
def test_natural_frequencies_are_of_second_order(name, P, ends):
    exact = elastica.solve(name, P=P, H=0.1, ends=ends).frequencies(3)
    links = np.array([100, 200, 400, 800])
    found = [
        np.abs(
            elastica.solve(name, P=P, H=0.1, ends=ends, method="chain", links=int(n)).frequencies(3) - exact
        )
        for n in links
    ]
    assert orders(np.array(found), links) == pytest.approx(2, abs=0.1)


def test_a_contact_passes_from_link_to_link_without_a_step():
    P = np.linspace(2.9, 3.3, 61)
    exact = elastica.solve("Ua", P=P, H=0.1)
    chain = elastica.solve("Ua", P=P, H=0.1, method="chain", links=60)
    link = np.floor(60 * chain.contact_position[:, 0])
    assert np.unique(link).size > 2 and (chain.status == 0).all() and (chain.index == 1).all()
    error = chain.energy - exact.energy
    assert np.abs(np.diff(error, 2)).max() < 0.02 * np.abs(error).max()
    assert np.abs(np.diff(chain.eigenvalues(2)[:, 0] - exact.eigenvalues(2)[:, 0])).max() < 0.02
