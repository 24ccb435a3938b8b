"""Frequencies, the conventional method and eigenvalues at held shortening against what is known otherwise."""

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

import elastica
from elastica.control import LOAD, SHORTENING
from elastica.stability.spectrum import eigenvalues
from elastica.stability.vibration import frequencies

CC, PP = "clamped-clamped", "pinned-pinned"
FOUR_PI_SQUARED = 4 * np.pi**2
SCATTERED = [
    ("0", CC),
    ("0", "0.3/2.5"),
    ("B1", "0.3/2.5"),
    ("B2", "clamped-pinned"),
    ("U", CC),
    ("Ua", "pinned-clamped"),
    ("aUa", "0.3/2.5"),
    ("U-", "clamped-pinned"),
    ("aU-", PP),
    ("UD", "clamped-pinned"),
    ("UU", PP),
    ("UDa", CC),
    ("UD-", CC),
    ("UDU", "clamped-pinned"),
    ("UDU-", PP),
    ("UUD", CC),
]


def scattered(name, ends, rng, points=3):
    """A few solved points of a state anywhere in its plane; steep ones and those with further periods too."""
    P, H = np.exp(rng.uniform(np.log([[0.2], [0.01]]), np.log([[25], [0.45]]), (2, 60)))
    solved = np.flatnonzero(elastica.solve(name, P=P, H=H, ends=ends).status == 0)[:points]
    assert solved.size
    return elastica.solve(name, P=P[solved], H=H[solved], ends=ends)


@pytest.mark.parametrize(
    ("ends", "beta"), [(CC, [4.730040744862704, 7.853204624095838]), (PP, [np.pi, 2 * np.pi])]
)
def test_unloaded_beam(ends, beta):
    assert elastica.solve("0", P=0, H=0.1, ends=ends).frequencies(2) == pytest.approx(
        np.square(beta), rel=1e-12
    )


def test_loaded_straight_strip_between_pins():
    """Mode n: ω² = q²(q² − p), q = nπ."""
    P = np.array([0.2, 3.0, 30.0, 500.0])
    q = np.arange(1, 200) * np.pi
    squares = np.sort(q**2 * (q**2 - FOUR_PI_SQUARED * P[:, None]), axis=1)[:, :4]
    found = elastica.solve("0", P=P, H=0.1, ends=PP).frequencies(4)
    assert np.sign(found) * found**2 == pytest.approx(squares, rel=1e-9)


@pytest.mark.parametrize(("name", "ends"), SCATTERED)
def test_frequencies_have_the_signs_of_the_energy_method(name, ends, rng):
    """Sylvester: other weights change the values of eigenvalues, not their signs."""
    s = scattered(name, ends, rng)
    count = int(s.index.max()) + 4
    flat = s.state.line & (s.flat_length * np.sqrt(s.P) > 1)
    for control in (LOAD, SHORTENING):
        omega, nu = frequencies(s, count, control), eigenvalues(s, count, control)
        assert (np.diff(omega) >= 0).all()
        assert np.sign(omega).tolist() == np.sign(nu).tolist()
        if control == LOAD:
            assert (omega < 0).sum(axis=1).tolist() == (s.index - flat).tolist()
    # One constraint moves each eigenvalue up, not beyond the next.
    free = s.frequencies(count + 1)
    assert (omega >= free[:, :-1] - 1e-4).all()
    assert (omega <= free[:, 1:] + 1e-4).all() or s.state.straight


@pytest.mark.parametrize("count", [1, 3, 6])
def test_the_zeros_of_a_line_state_come_after_its_negative_eigenvalues(count):
    """With an extra period in each segment four are negative; only then follow the exact zeros of both."""
    s = elastica.solve("U-", P=19.91770682206908, H=0.1492310724517735)
    assert (s.periods == 1).all()
    for values in s.eigenvalues(count), s.frequencies(count):
        assert (values[:4] < -10).all()
        assert values[4:6].tolist() == [0, 0][: max(count - 4, 0)]


def linear_elements(name, P, H, ends, finer, fixed_shortening=False):
    """The four lowest ω² with linear φ on links, positions summed up link by link, from the sampled shape."""
    s = elastica.solve(name, P=P, H=H, ends=ends)
    state, p = s.state, FOUR_PI_SQUARED * P
    flat = s.flat_length / max(len(state.word), 1)
    pieces = np.insert(s.lengths, np.arange(1, s.lengths.size), flat) if state.line else s.lengths
    lam = s.lam * [1 if c == "U" else -1 for c in state.word + state.word[-1:]]
    lam[-1] *= -1
    lam = np.insert(lam, np.arange(1, lam.size), 0.0) if state.line else lam
    each = finer * np.rint(100 * pieces).astype(int)
    piece = np.repeat(np.arange(each.size), each)
    h, lam = (pieces / each)[piece], lam[piece]
    joints = np.append(0, np.cumsum(h))
    fine = s.shape(100_001)
    theta = np.interp(joints[:-1] + h / 2, fine.s, fine.theta)

    n = h.size
    mean = (np.eye(n, n + 1) + np.eye(n, n + 1, 1)) / 2
    bend = np.eye(n, n + 1, 1) - np.eye(n, n + 1)
    thrust = p * np.cos(theta) + lam * np.sin(theta)
    Q = bend.T / h @ bend - mean.T * (thrust * h) @ mean
    x, y = (
        np.vstack([np.zeros(n + 1), np.cumsum((part * h)[:, None] * mean, axis=0)])
        for part in (-np.sin(theta), np.cos(theta))
    )
    weights = (np.append(h, 0) + np.append(0, h)) / 2
    mass = x.T * weights @ x + y.T * weights @ y
    cuts = np.append(0, np.cumsum(each))
    fixed = [0] * s.ends.A.clamped + [n] * s.ends.B.clamped
    for end, at in zip(s.ends, (0, n), strict=True):
        Q[at, at] += 0 if end.clamped else end.stiffness
    if state.line:
        held = range(0, each.size, 2)
        fixed += [joint for i in range(1, each.size, 2) for joint in range(cuts[i], cuts[i + 1] + 1)]
    else:
        held = range(each.size)
        Q[cuts[1:-1], cuts[1:-1]] += FOUR_PI_SQUARED * s.reaction / s.curvature
    rows = [y[cuts[i + 1]] - y[cuts[i]] for i in held] + [x[-1]] * fixed_shortening
    free = np.setdiff1d(np.arange(n + 1), fixed)
    basis = null_space(np.array(rows)[:, free])
    Q, mass = (basis.T @ matrix[np.ix_(free, free)] @ basis for matrix in (Q, mass))
    shift = 9 * (5 * p) ** 2
    return 1 / eigh(mass, Q + shift * mass, eigvals_only=True)[:-5:-1] - shift


@pytest.mark.parametrize(
    ("name", "P", "H", "ends", "held"),
    [
        ("U", 2.5, 0.1, CC, False),
        ("Ua", 2.5, 0.1, CC, False),
        ("Ua", 2.5, 0.1, CC, True),
        ("UD", 4.5, 0.1, CC, True),
        ("UU", 6.0, 0.1, CC, False),
        ("U", 1.2, 0.15, "0.3/2.5", False),
        ("U-", 2.0, 0.1, PP, False),
        ("UD-", 5.0, 0.05, PP, True),
    ],
)
def test_frequencies_against_a_chain_of_links(name, P, H, ends, held):
    coarse, fine = (linear_elements(name, P, H, ends, finer, held) for finer in (1, 2))
    omega = frequencies(elastica.solve(name, P=P, H=H, ends=ends), 4, SHORTENING if held else LOAD)
    exact = omega * np.abs(omega)
    assert fine == pytest.approx(exact, rel=0.01, abs=20)
    # Second order: the error is a quarter with links of half the length.
    assert (4 * fine - coarse) / 3 == pytest.approx(exact, rel=1e-4, abs=1)


def test_frequencies_of_a_clamped_line_state():
    s = elastica.solve("U-", P=[5.0, 3.0], H=0.1)
    omega = s.frequencies(4)
    assert omega[0, :2].tolist() == [0.0, 0.0]
    assert omega[0, 2] > 100
    assert np.isnan(omega[1]).all()


def test_conventional_method():
    s = elastica.solve("U", P=[1.5, 2.5, 3.5, 3.9, 0.5], H=0.1)
    held = s.conventional()
    expected = [22.2511772, -18.0519525, -58.2150914, -74.1965033, np.nan]
    assert held.eigenvalues[:, 0] == pytest.approx(expected, abs=6e-8, nan_ok=True)
    assert held.index.tolist() == [0, 1, 1, 1, -1]
    assert held.stable.tolist() == [True, False, False, False, False]
    assert elastica.solve("U", P=2.5, H=0.05).conventional().eigenvalues[0] == pytest.approx(
        -17.9608, abs=5e-5
    )
    around = elastica.solve("U", P=[2.04, 2.06], H=0.05)
    assert around.conventional().stable.tolist() == [1, 0]
    assert (around.index == 0).all()


def test_conventional_method_counts_every_negative_eigenvalue():
    s = elastica.solve("UDU", P=[8.0, 10.0, 12.0], H=0.05)
    held = s.conventional(2)
    many = s.conventional(12)
    assert held.index.tolist() == many.index.tolist() == (many.eigenvalues < 0).sum(axis=1).tolist()
    assert (held.index > 2).any() and (s.index == 0).all()
    assert held.eigenvalues == pytest.approx(many.eigenvalues[:, :2], rel=1e-9)


def test_conventional_method_where_no_contact_can_move():
    for name, P in (("U-", [5.0, 9.0]), ("0", [0.5, 2.5]), ("B1", [1.005, 1.01])):
        s = elastica.solve(name, P=P, H=0.1)
        held = s.conventional(2)
        assert held.eigenvalues.tolist() == s.eigenvalues(2).tolist()
        assert held.index.tolist() == s.index.tolist()


def test_asymmetric_branch_at_held_shortening():
    """One negative direction under load control; at held shortening only beyond the least shortening."""
    turns = 3.65445
    s = elastica.solve("Ua", P=[2.06609, 2.5, 3.0, turns - 1e-5, turns + 1e-5, 3.8, 3.98486], H=0.05)
    assert (s.eigenvalues(2) < 0).sum(axis=1).tolist() == [1] * 7
    held = eigenvalues(s, 2, SHORTENING)
    assert (held < 0).sum(axis=1).tolist() == [0] * 4 + [1] * 3
    assert np.abs(held[3:5, 0]).max() < 1e-3


def test_sliding_of_a_line_keeps_the_shortening():
    s = elastica.solve("U-", P=5.0, H=0.1)
    free, held = s.eigenvalues(4), eigenvalues(s, 4, SHORTENING)
    assert held[:2].tolist() == frequencies(s, 2, SHORTENING).tolist() == [0.0, 0.0]
    # The two segments bend against each other at no change of the shortening.
    assert held[2] == pytest.approx(free[2], rel=1e-12)
    assert held[3] > free[3] + 100


def test_symmetric_state_at_held_shortening():
    """About the middle sin θ is odd: odd rotations feel the constraint, even ones do not."""
    s = elastica.solve("U", P=2.5, H=0.1)
    free, held = s.eigenvalues(6), eigenvalues(s, 6, SHORTENING)
    kept = np.isclose(free[:, None], held, rtol=1e-10).any(axis=1)
    assert 0 < kept.sum() < 6
    assert (held >= free * (1 - 1e-10)).all()


@pytest.mark.parametrize("count", [0, -1, 1.5])
def test_impossible_counts(count):
    s = elastica.solve("U", P=2.5, H=0.1)
    for of in (s.eigenvalues, s.frequencies, s.conventional):
        with pytest.raises(ValueError, match="count"):
            of(count)
