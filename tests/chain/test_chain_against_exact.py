"""Chains and the exact solver, two independent ways, must tell the same about the same strip."""

import numpy as np
import pytest
from scipy.linalg import eigh

import elastica
from elastica import Stability, Status
from elastica.chain.bordered import count_below
from elastica.chain.consistent import contact_curvatures, second_variation

CC, PP = "clamped-clamped", "pinned-pinned"
ENDS = (CC, "clamped-pinned", "pinned-clamped", PP, "0.3/2.5", "clamped/0.05")
LINKS = 800


def draw(rng, control):
    """A random solved state below 90°, with its name, ends, gap and what is prescribed."""
    while True:
        ends = str(rng.choice(ENDS))
        name = str(rng.choice(elastica.states(ends, 3)[control == "shortening" :]))
        P, H = rng.uniform(0.1, 12, 6), rng.uniform(0.02, 0.15)
        drawn = elastica.solve(name, P=P, H=H, ends=ends)
        good = (drawn.status == Status.SOLVED) & (drawn.max_slope < np.pi / 2)
        if good.any():
            given = getattr(drawn, control)[good][0]
            exact = elastica.solve(name, **{control: given}, H=H, ends=ends)
            if exact.status == Status.SOLVED:
                return exact, {control: given, "H": H, "ends": ends}


@pytest.mark.parametrize("control", ["P", "shortening"])
def test_index_and_verdict_agree_at_random_states(rng, full, control):
    judged = 0
    for _ in range((200 if control == "P" else 100) if full else (30 if control == "P" else 5)):
        exact, place = draw(rng, control)
        chain = elastica.solve(exact.state.name, **place, method="chain", links=LINKS)
        if Stability.CRITICAL in (chain.stability, exact.stability):
            continue
        if chain.status == Status.FAILED:
            # Beyond a fold that a chain of few links reaches before the strip does.
            chain = elastica.solve(exact.state.name, **place, method="chain", links=8 * LINKS)
        judged += 1
        assert chain.status == Status.SOLVED, (exact.state.name, place, chain.reasons)
        assert (chain.index, chain.stability) == (exact.index, exact.stability), (exact.state.name, place)
        if chain.nullity != exact.nullity:
            # An eigenvalue too small for a chain of that many links to tell from zero.
            values = np.abs(exact.eigenvalues(int(exact.index) + 1))
            assert values.min() < 1e-3 * values.max(), (exact.state.name, place)
        assert chain.energy == pytest.approx(exact.energy, rel=3e-3, abs=1e-6)
        assert chain.lam == pytest.approx(exact.lam, rel=5e-3, abs=1e-2)
    assert judged > 3


@pytest.mark.parametrize(
    ("P", "moving", "held", "slope_held"),
    [
        (1.5, 37.0744467, 22.2511772, 99.1320428),
        (2.5, 24.8282985, -18.0519525, 58.4675925),
        (3.5, 8.5092666, -58.2150914, 17.7927701),
        (3.9, 0.7652699, -74.1965033, 1.5360762),
    ],
)
def test_the_table_of_section_4(P, moving, held, slope_held):
    coarse, fine = (elastica.solve("U", P=P, H=0.1, method="chain", links=n) for n in (800, 1600))
    for found, expected in (
        ([s.eigenvalues(1)[0] for s in (coarse, fine)], moving),
        ([s.conventional().eigenvalues[0] for s in (coarse, fine)], held),
        # The antisymmetric mode does not turn the contact.
        ([s.eigenvalues(2)[1] for s in (coarse, fine)], slope_held),
    ):
        assert (4 * found[1] - found[0]) / 3 == pytest.approx(expected, abs=2e-4)


def test_the_conventional_method_gives_way_at_2_05():
    s = elastica.solve("U", P=[2.03, 2.07], H=0.1, method="chain")
    assert s.conventional().stable.tolist() == [1, 0] and s.stability.tolist() == [0, 0]


@pytest.mark.parametrize("links", [100, 101, 397, 800])
@pytest.mark.parametrize("clamp", ["consistent", "published"])
def test_line_states_of_clamped_strips_are_unstable_at_third_order(links, clamp):
    s = elastica.solve("U-", P=[4.5, 5.0, 7.0], H=0.1, method="chain", links=links, clamp=clamp)
    assert (s.index == 0).all() and (s.nullity == 2).all()
    assert (s.stability == Stability.UNSTABLE_THIRD_ORDER).all()
    assert (s.eigenvalues(2) == 0).all()


@pytest.mark.parametrize("links", [301, 400, 801])
def test_segments_between_lines_are_neutral(links):
    s = elastica.solve("UD-", P=7.0, H=0.02, ends=PP, method="chain", links=links)
    assert s.stability == Stability.NEUTRAL_FAMILY and s.nullity == 1 and s.eigenvalues(1) == 0


def test_a_flat_stretch_buckles_off_the_wall():
    s = elastica.solve("U-", P=[3.84, 3.86], H=0.1, ends=PP, method="chain", links=800)
    assert s.index.tolist() == [0, 1]
    s = elastica.solve("U-", P=[8.76, 8.79], H=0.1, method="chain", links=800)
    assert s.index.tolist() == [0, 1]


def test_near_a_change_of_index_the_verdict_is_critical():
    s = elastica.solve("0", P=[1.0, 1.001], H=0.1, method="chain", links=400)
    assert s.stability.tolist() == [Stability.CRITICAL, Stability.UNSTABLE]
    coarse = elastica.solve("U", P=[3.9, 3.93], H=0.1, method="chain", links=51)
    assert coarse.stability.tolist() == [Stability.CRITICAL, -1]
    assert coarse.status.tolist() == [Status.SOLVED, Status.NO_EQUILIBRIUM]


def test_published_links_do_not_judge_a_contact_about_to_become_a_line():
    exact = elastica.solve("U", P=[2.5, 3.5, 3.9], H=0.1)
    s = elastica.solve("U", P=exact.P, H=0.1, method="chain", links=101, clamp="published")
    assert s.stability.tolist() == [Stability.STABLE, Stability.STABLE, Stability.CRITICAL]
    # What they would say: −2547 in place of 0.765.
    assert s.eigenvalues(1)[2, 0] < -1000


def test_shallow_states_are_judged_like_deep_ones():
    s = elastica.solve("U", P=2.5, H=[1e-1, 1e-3, 1e-6, 1e-8], method="chain", links=400)
    assert (s.stability == Stability.STABLE).all() and (s.nullity == 0).all()
    assert s.eigenvalues(1)[1:, 0] == pytest.approx(24.968, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "P", "H"), [("UD" * 5, 60.0, 0.02), ("UD" * 5 + "-", 160.0, 0.01), ("UUD", 12.0, 0.04)]
)
def test_words_with_many_contacts(name, P, H):
    exact = elastica.solve(name, P=P, H=H)
    chain = elastica.solve(name, P=P, H=H, method="chain", links=4000)
    assert exact.status == chain.status == Status.SOLVED, chain.reasons
    assert (exact.index, exact.nullity, exact.stability) == (chain.index, chain.nullity, chain.stability)
    assert chain.reaction == pytest.approx(exact.reaction, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "P", "H"), [("Ua", 3.0, 0.1), ("UU", 6.0, 0.1), ("B2", 2.1, 0.2), ("U-", 5.0, 0.1)]
)
def test_the_room_between_a_bump_and_the_wall(name, P, H):
    exact = elastica.solve(name, P=P, H=H)
    chain = elastica.solve(name, P=P, H=H, method="chain", links=400)
    assert chain.clearance == pytest.approx(float(exact.clearance), rel=1e-3)
    assert chain.max_slope == pytest.approx(float(exact.max_slope), rel=1e-3)


def test_condensing_the_contacts_angle_changes_nothing(rng):
    state = elastica.solve("UDa", P=5.0, H=0.1, method="chain", links=40).chains[0]
    pieces, n = state.pieces, state.theta.size
    conventional = second_variation(state, contacts_move=False)
    T = np.diag(conventional.diagonal) + np.diag(conventional.off, 1) + np.diag(conventional.off, -1)
    contacts = state.cuts.size
    K = np.zeros((n + contacts, n + contacts))
    K[:n, :n] = T
    g = state.reactions / np.abs(contact_curvatures(state))
    for c, (i, j) in enumerate(zip(pieces.last[:-1], pieces.first[1:], strict=True)):
        a_l, a_r = pieces.half[i], pieces.half[j]
        K[[i, i, j, j], [i, j, j, i]] -= np.array([1, -1, 1, -1]) / (a_l + a_r)
        for side, a in ((i, a_l), (j, a_r)):
            K[[side, n + c, side, n + c], [side, n + c, n + c, side]] += np.array([1, 1, -1, -1]) / a
        K[n + c, n + c] += g[c]
    condensed = K[:n, :n] - K[:n, n:] @ np.linalg.solve(K[n:, n:], K[n:, :n])
    form = second_variation(state)
    split = np.diag(form.diagonal) + np.diag(form.off, 1) + np.diag(form.off, -1)
    assert split == pytest.approx(condensed, rel=1e-9, abs=1e-7)


def test_eigenvalues_and_index_are_those_of_the_dense_procedure():
    for name, P, ends in (("U", 3.5, CC), ("Ua", 3.0, CC), ("UD", 2.0, PP), ("UU", 6.0, CC)):
        s = elastica.solve(name, P=P, H=0.1, ends=ends, method="chain", links=101)
        form = second_variation(s.chains[0])
        T = np.diag(form.diagonal) + np.diag(form.off, 1) + np.diag(form.off, -1)
        Z = np.linalg.svd(form.border.T)[2][form.constraints :].T
        values = eigh(Z.T @ T @ Z, Z.T @ np.diag(form.mass) @ Z, eigvals_only=True)
        assert s.eigenvalues(6) == pytest.approx(values[:6], rel=1e-9, abs=1e-8)
        assert count_below(form) == (values < 0).sum() == s.index


@pytest.mark.parametrize("name", ["U", "Ua", "UD", "B1", "U-"])
def test_prescribed_shortening(name):
    H = 0.4 if name == "B1" else 0.05
    exact = elastica.solve(name, P=5.0 if name == "U-" else 1.2 if name == "B1" else 3.0, H=H)
    chain = elastica.solve(name, shortening=exact.shortening, H=H, method="chain", links=801)
    reference = elastica.solve(name, shortening=exact.shortening, H=H)
    assert chain.shortening == pytest.approx(float(exact.shortening), rel=1e-9)
    assert chain.P == pytest.approx(float(exact.P), rel=1e-3)
    assert (chain.index, chain.stability) == (reference.index, reference.stability)
    assert chain.eigenvalues(3) == pytest.approx(reference.eigenvalues(3), rel=5e-3, abs=0.05)


def test_a_solution_has_what_an_exact_one_has():
    kwargs = {"P": [[1.5], [2.5]], "H": [0.05, 0.1, 0.6]}
    exact, chain = elastica.solve("U", **kwargs), elastica.solve("U", **kwargs, method="chain", links=801)
    assert (chain.status == exact.status).all() and chain.status[0, 2] == Status.NO_EQUILIBRIUM
    for name in ("curvature", "energy", "bending_energy", "shortening", "reaction", "contact_position"):
        assert getattr(chain, name) == pytest.approx(getattr(exact, name), rel=1e-3, nan_ok=True), name
    for name in ("flat_length", "max_slope", "clearance", "lam", "lengths", "P", "periods"):
        assert getattr(chain, name) == pytest.approx(getattr(exact, name), rel=1e-3, nan_ok=True), name
    assert chain.frequencies(2) == pytest.approx(exact.frequencies(2), rel=1e-3, nan_ok=True)
    for field in ("theta", "x", "y"):
        ours, theirs = getattr(chain.shape(41), field), getattr(exact.shape(41), field)
        assert ours == pytest.approx(theirs, abs=2e-4, nan_ok=True)
    assert np.nanmax(chain.error) < 1e-3


def test_a_flat_stretch_buckles_with_contacts_held_too():
    P = np.array([2.0, 3.5, 3.95, 5.0])
    exact = elastica.solve("U-", P=P, H=0.1, ends="pinned-pinned").conventional()
    chain = elastica.solve("U-", P=P, H=0.1, ends="pinned-pinned", method="chain", links=200).conventional()
    assert exact.stable.tolist() == [1, 1, 0, 0]
    assert chain.stable.tolist() == exact.stable.tolist()
    assert chain.index.tolist() == exact.index.tolist()
