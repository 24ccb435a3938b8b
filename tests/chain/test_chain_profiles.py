"""Strips that are not uniform, stiffness varying 4 : 1, against IPOPT on the same chain and solve_bvp."""

import casadi
import numpy as np
import pytest
from scipy.integrate import solve_bvp

import elastica
from elastica import Status
from elastica.chain.splitting import mesh_of

CC, PP = "clamped-clamped", "pinned-pinned"


def tapered(s):
    return 1 + 3 * s


def thick_inside(s):
    return 1 + 3 * np.sin(np.pi * s) ** 2


def thick_ends(s):
    return 4 - 3 * np.sin(np.pi * s)


def wavy(s):
    return 4 ** np.sin(5 * s)


SMOOTH = [(tapered, 4.0), (thick_inside, 3.0), (thick_ends, 2.5), (wavy, 2.0)]


def one_contact(profile, P, H, near):
    """Energy, curvature and place of the contact, reaction, all of a clamped strip, by solve_bvp.

    Both free segments are mapped to 0 … 1; unknowns θ, M, y of each, both λ and the place of the contact. The
    moment is continuous at the contact: no energy, no chain, no cut links.
    """
    EI = mesh_of(400, elastica.chain.profile.parse_profile(profile, 400)).profile
    p, chain = 4 * np.pi**2 * P, near.chains[0]
    shape = near.shape(2001)
    x = np.linspace(0, 1, 300)
    middle = chain.cuts[0]

    def rhs(x, z, unknown):
        left, right, contact = unknown
        parts = []
        for (theta, moment, _), begin, length, lam in (
            (z[:3], 0, contact, left),
            (z[3:], contact, 1 - contact, right),
        ):
            slopes = moment / EI(begin + length * x), lam * np.cos(theta) - p * np.sin(theta), np.sin(theta)
            parts += [length * slope for slope in slopes]
        return np.array(parts)

    def ends(a, b, unknown):
        held = a[0], a[2], b[0], b[2] - H, a[3], a[5] - H, b[3], b[5]
        return np.array([*held, b[1] - a[4]])

    guess = []
    for s, length in ((middle * x, middle), (middle + (1 - middle) * x, 1 - middle)):
        theta = np.interp(s, shape.s, shape.theta)
        guess += [theta, np.gradient(theta, x) / length * EI(s), np.interp(s, shape.s, shape.y)]
    found = solve_bvp(rhs, ends, x, np.array(guess), p=[*chain.lam, middle], tol=1e-9, max_nodes=50_000)
    assert found.success
    left, right, contact = found.p
    nodes, weights = np.polynomial.legendre.leggauss(400)
    x, weights = 0.5 * (nodes + 1), 0.5 * weights
    z = found.sol(x)
    energy = 0.0
    for (theta, moment, _), begin, length in ((z[:3], 0, contact), (z[3:], contact, 1 - contact)):
        density = 0.5 * moment**2 / EI(begin + length * x) - 2 * p * np.sin(theta / 2) ** 2
        energy += length * weights @ density
    kappa = abs(found.sol(1.0)[1]) / EI(np.array(contact))
    return np.array([energy / (4 * np.pi**2), kappa, (left - right) / (4 * np.pi**2), contact])


@pytest.mark.parametrize(("profile", "P"), SMOOTH)
def test_a_contact_is_where_solve_bvp_finds_it(profile, P):
    links = np.array([100, 200, 400, 800])
    chains = [elastica.solve("U", P=P, H=0.1, method="chain", links=int(n), stiffness=profile) for n in links]
    exact = one_contact(profile, P, 0.1, chains[-1])
    found = np.array([[c.energy, c.curvature, c.reaction[0], c.contact_position[0]] for c in chains])
    error = np.abs(found - exact)
    assert error[-1] == pytest.approx(0, abs=2e-4)
    sized = error[-1] > 1e-8
    assert -np.polyfit(np.log(links), np.log(error[:, sized]), 1)[0] == pytest.approx(2, abs=0.2)
    assert [c.error for c in chains[-2:]] >= [
        np.max([e[1] / (2 * np.pi * P**0.5), e[3], abs(e[0] / exact[0])]) for e in error[-2:]
    ]


def minimise(chain, p, H, start):
    """IPOPT on the links of a chain, any corner within the walls: energy and angles."""
    n = chain.lengths.size
    theta, y = casadi.SX.sym("theta", n), casadi.SX.sym("y", n - 1)
    bends = theta[1:] - theta[:-1]
    V = casadi.dot(chain.springs, bends**2) / 2 + casadi.dot(chain.holds, theta**2) / 2
    V -= p * casadi.dot(chain.lengths, 1 - casadi.cos(theta))
    rises = casadi.vertcat(y, 0) - casadi.vertcat(0, y) - chain.lengths * casadi.sin(theta)
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10, "mu_init": 1e-6}}
    solver = casadi.nlpsol("chain", "ipopt", {"x": casadi.vertcat(theta, y), "f": V, "g": rises}, options)
    walls = np.concatenate([np.full(n, np.inf), np.full(n - 1, H)])
    heights = np.clip(np.cumsum(chain.lengths * np.sin(start))[:-1], -H, H)
    found = solver(x0=np.concatenate([start, heights]), lbx=-walls, ubx=walls, lbg=0, ubg=0)
    assert solver.stats()["success"]
    return float(found["f"]) / (4 * np.pi**2), found["x"].full().ravel()[:n]


@pytest.mark.parametrize(("profile", "P"), [*SMOOTH, ([1.0, 0.25, 0.5], 0.9)])
@pytest.mark.parametrize("ends", [CC, "1/pinned"])
def test_ipopt_finds_the_same_minimum_of_the_same_chain(profile, P, ends, rng):
    P = P if ends == CC else P / 2
    s = elastica.solve("U", P=P, H=0.1, ends=ends, method="chain", links=200, stiffness=profile)
    assert s.status == 0 and s.stability == elastica.Stability.STABLE
    state = s.chains[0]
    n = state.theta.size
    start = state.theta + 0.05 * np.cos(np.pi * np.outer(np.arange(8), np.arange(n) / n)).T @ rng.normal(
        size=8
    )
    energy, theta = minimise(state.pieces.chain, state.p, 0.1, start)
    assert energy == pytest.approx(float(s.energy), rel=1e-5)
    assert theta == pytest.approx(state.theta, abs=5e-3)


def test_a_uniform_profile_only_scales_loads_and_energies():
    soft = elastica.solve("Ua", P=3.0, H=0.1, method="chain", links=100)
    stiff = elastica.solve("Ua", P=6.0, H=0.1, method="chain", links=100, stiffness=[2.0, 2.0])
    for name, factor in (
        ("energy", 2),
        ("reaction", 2),
        ("curvature", 1),
        ("contact_position", 1),
        ("error", 1),
    ):
        assert getattr(stiff, name) == pytest.approx(factor * getattr(soft, name), rel=1e-6), name
    assert stiff.eigenvalues(3) == pytest.approx(2 * soft.eigenvalues(3), rel=1e-9)
    assert stiff.frequencies(3) == pytest.approx(2**0.5 * soft.frequencies(3), rel=1e-9)


def test_a_profile_nearly_uniform_is_near_the_uniform_strip():
    for name, P, ends in (("UD", 4.5, CC), ("U-", 2.0, PP), ("B1", 0.3, PP), ("UU", 6.0, CC)):
        place = {"P": P, "H": 0.1 if name != "B1" else 0.4, "ends": ends, "method": "chain", "links": 200}
        plain = elastica.solve(name, **place)
        wavy = elastica.solve(name, **place, stiffness=lambda s: 1 + 1e-4 * np.cos(3 * s))
        assert wavy.energy == pytest.approx(plain.energy, rel=1e-3) and wavy.energy != plain.energy
        assert wavy.eigenvalues(2) == pytest.approx(plain.eigenvalues(2), rel=1e-3, abs=0.05)
        assert (wavy.index, wavy.stability) == (plain.index, plain.stability)


def test_a_list_is_read_as_equidistant_values_linear_between():
    place = {"P": 1.2, "H": 0.1, "method": "chain", "links": 100}
    listed = elastica.solve("U", **place, stiffness=[1.0, 0.5, 1.0])
    called = elastica.solve("U", **place, stiffness=lambda s: 0.5 + np.abs(s - 0.5))
    assert listed.energy == pytest.approx(float(called.energy), rel=1e-12)


def test_a_reversed_profile_gives_the_mirrored_state():
    place = {"P": 4.0, "H": 0.1, "method": "chain", "links": 150}
    one, other = (elastica.solve("U", **place, stiffness=f) for f in (tapered, lambda s: tapered(1 - s)))
    assert one.energy == pytest.approx(float(other.energy), rel=1e-10)
    assert one.contact_position == pytest.approx(1 - other.contact_position, rel=1e-8)


def test_a_line_beside_a_clamp_is_stable_where_the_strip_is_softer_at_the_clamp():
    links = np.array([100, 200, 400, 800])
    found = [
        elastica.solve("U-", P=9.0, H=0.1, method="chain", links=int(n), stiffness=thick_inside)
        for n in links
    ]
    assert all(s.stability == elastica.Stability.STABLE and s.nullity == 0 for s in found)
    energies = np.array([s.energy for s in found])
    assert np.diff(energies)[:-1] / np.diff(energies)[1:] == pytest.approx(4, rel=0.1)
    assert np.abs([s.eigenvalues(1)[0] for s in found]).min() > 50
    refused = elastica.solve("U-", P=9.0, H=0.1, method="chain", links=100, stiffness=thick_ends)
    assert refused.status == elastica.Status.FAILED and "stiffer at a clamp" in refused.reasons[0]


def test_the_lowest_eigenvalue_vanishes_where_the_state_does():
    """Newton's method knows nothing of the second variation, but both are singular at a fold."""
    P = np.array([6.4, 6.6, 6.75])
    s = elastica.solve("U", P=[*P, 6.79], H=0.1, method="chain", links=800, stiffness=tapered)
    assert s.status.tolist() == [0, 0, 0, elastica.Status.FAILED]
    squares = s.eigenvalues(1)[:3, 0] ** 2
    assert P[1] + (P[2] - P[1]) * squares[1] / (squares[1] - squares[2]) == pytest.approx(6.767, abs=0.01)


def test_shortening_of_a_strip_that_is_not_uniform():
    pressed = elastica.solve("U", P=3.0, H=0.1, method="chain", links=200, stiffness=thick_inside)
    held = elastica.solve(
        "U", shortening=pressed.shortening, H=0.1, method="chain", links=200, stiffness=thick_inside
    )
    assert held.P == pytest.approx(3.0, rel=1e-8) and held.energy == pytest.approx(
        float(pressed.energy), rel=1e-8
    )


def test_a_published_chain_of_a_profile_comes_near_the_other_with_its_links():
    """Its error is that of first order, found with half as many links."""
    chain = {"P": 3.0, "H": 0.1, "method": "chain", "stiffness": [1, 1.2, 1]}
    fine = elastica.solve("U", links=1600, **chain)
    away = []
    for links in (101, 201, 401):
        s = elastica.solve("U", links=links, clamp="published", **chain)
        assert s.status == Status.SOLVED
        away.append(abs(float(s.energy / fine.energy) - 1))
        assert away[-1] <= 2 * s.error
    assert away[0] > 1.8 * away[1] > 3.2 * away[2]
