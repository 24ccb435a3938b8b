"""Published and derived numbers that the exact solver must reproduce to the digits given."""

import numpy as np
import pytest
from references.onsets import loads
from scipy.optimize import brentq

import elastica
from elastica import Stability, Status

CC, PP = "clamped-clamped", "pinned-pinned"


def test_lowest_eigenvalue_with_the_contact_free_to_move():
    s = elastica.solve("U", P=[1.5, 2.5, 3.5, 3.9], H=0.1)
    expected = [37.0744467, 24.8282985, 8.5092666, 0.7652699]
    assert s.eigenvalues(1)[:, 0] == pytest.approx(expected, abs=6e-8)
    assert (s.stability == Stability.STABLE).all()


def test_one_point_state():
    s = elastica.solve("U", P=2.5, H=0.05)
    assert s.curvature == pytest.approx(0.585906, abs=5e-7)
    assert s.reaction[0] == pytest.approx(0.383812, abs=5e-7)
    assert s.shortening == pytest.approx(0.00662053, abs=5e-9)
    assert s.eigenvalues(1)[0] == pytest.approx(24.9359203, abs=5e-8)


def test_asymmetric_one_point_state():
    s = elastica.solve("Ua", P=3.0, H=0.1)
    assert s.curvature == pytest.approx(1.91976, abs=5e-6)
    assert s.lengths == pytest.approx([0.425, 0.575], abs=5e-4)
    assert (s.index, s.eigenvalues(1)[0]) == (1, pytest.approx(-15.2061, abs=5e-5))


def test_second_free_mode():
    s = elastica.solve("B2", P=2.06, H=0.4)
    alpha = np.arctan2(s.lam[0], 4 * np.pi**2 * 2.06)
    assert (s.curvature, alpha) == (pytest.approx(2.4489, abs=5e-5), pytest.approx(-0.06128, abs=5e-6))


@pytest.mark.parametrize(
    ("H", "touches", "line", "buckles", "buckles_pinned"),
    [
        (0.02, 1.0004940594593, 3.9975966930104, 8.9918702175, 3.9951660372),
        (0.05, 1.003107058816, 3.984869364316, 8.9481758993, 3.9685924505),
        (0.10, 1.0127127055026, 3.9378211842362, 8.7758689760, 3.8506274993),
    ],
)
def test_transition_loads(H, touches, line, buckles, buckles_pinned):
    assert loads("touches", H) == pytest.approx(touches, abs=1e-12)
    assert loads("point_to_line", H) == pytest.approx(line, abs=1e-12)
    assert loads("touches", H, PP) == pytest.approx(touches / 4, abs=1e-12)
    assert loads("point_to_line", H, PP) == pytest.approx(line / 4, abs=1e-12)
    assert loads("flat_buckles", H) == pytest.approx(buckles, abs=6e-11)
    assert loads("flat_buckles", H, PP) == pytest.approx(buckles_pinned, abs=6e-11)


@pytest.mark.parametrize(("ends", "scale"), [(CC, 1), (PP, 4)])
def test_each_transition_changes_the_verdict_and_nothing_else_does(ends, scale):
    """Both sides of every load, and the state that takes over."""
    H, step = 0.07, 1e-9
    touches, line, buckles = (loads(event, H, ends) for event in ("touches", "point_to_line", "flat_buckles"))

    def around(state, load):
        s = elastica.solve(state, P=load * np.array([1 - step, 1 + step]), H=H, ends=ends)
        there = ~s.periods.any(axis=-1)
        status = np.where(there, s.status, Status.NO_EQUILIBRIUM)
        return status.tolist(), np.where(there, s.stability, -1).tolist()

    line_verdict = Stability.UNSTABLE_THIRD_ORDER if ends == CC else Stability.STABLE
    euler = 1 / scale
    assert around("0", euler) == ([0, 0], [Stability.STABLE, Stability.UNSTABLE])
    assert around("B1", euler) == ([Status.NO_EQUILIBRIUM, 0], [-1, Stability.STABLE])
    assert around("B1", touches) == ([0, Status.INADMISSIBLE], [Stability.STABLE, -1])
    assert around("U", touches) == ([Status.INADMISSIBLE, 0], [-1, Stability.STABLE])
    assert around("U", line) == ([0, Status.NO_EQUILIBRIUM], [Stability.STABLE, -1])
    assert around("U-", line) == ([Status.INADMISSIBLE, 0], [-1, line_verdict])
    assert around("U-", buckles) == ([0, 0], [line_verdict, Stability.UNSTABLE])


def test_clamped_line_state_has_an_exact_zero_for_each_clamped_segment():
    s = elastica.solve("U-", P=5.0, H=0.1)
    assert (s.index, s.nullity, s.stability) == (0, 2, Stability.UNSTABLE_THIRD_ORDER)
    assert s.lam[0] ** 2 / 6 == pytest.approx(359.15, abs=5e-3)
    assert s.eigenvalues(2).tolist() == [0.0, 0.0]
    mixed = elastica.solve("U-", P=5.0, H=0.1, ends="clamped-pinned")
    assert (mixed.index, mixed.nullity, mixed.stability) == (0, 1, Stability.UNSTABLE_THIRD_ORDER)
    pinned = elastica.solve("U-", P=2.0, H=0.1, ends=PP)
    assert (pinned.index, pinned.nullity, pinned.stability) == (0, 0, Stability.STABLE)
    assert pinned.eigenvalues(1)[0] > 1


def test_family_of_line_states_ends_in_its_fold():
    for ends, fold in ((CC, 0.528160307318), (PP, 0.264080153659)):
        H = 0.15
        load = (fold / H) ** 2
        assert loads("line_ends", H, ends) == pytest.approx(load, rel=1e-12)
        found = elastica.solve("U-", P=[load * (1 - 1e-9), load * (1 + 1e-8)], H=H, ends=ends)
        assert (found.status == Status.NO_EQUILIBRIUM).tolist() == [False, True]
        assert np.degrees(found.max_slope[0]) == pytest.approx(2 * 47.761, abs=0.02)


def test_asymmetric_branch_runs_from_the_line_transition_back_to_the_second_free_mode():
    H = 0.05

    def slack(P):
        return float(elastica.solve("Ua", P=P, H=H).clearance)

    end = brentq(slack, 2.06, 2.2, xtol=1e-12)
    assert end == pytest.approx(2.066078, abs=5e-7)
    at_end = elastica.solve("Ua", P=end, H=H)
    assert at_end.reaction[0] == pytest.approx(0, abs=1e-10)
    free = elastica.solve("B2", P=end, H=H)
    assert at_end.curvature == pytest.approx(2.92647, abs=5e-6)
    assert free.curvature == pytest.approx(float(at_end.curvature), rel=1e-9)
    begin = float(loads("point_to_line", H))
    branch = elastica.solve("Ua", P=np.linspace(end + 1e-9, begin - 1e-9, 50), H=H)
    assert (branch.status == Status.SOLVED).all()
    assert (branch.index == 1).all()
    assert elastica.solve("Ua", P=begin + 1e-9, H=H).status == Status.NO_EQUILIBRIUM


def test_free_elastica():
    """Steepest angle 60°: P/P_Euler = (2K/π)², y_max = k/K, ΔL = 2(1 − E/K), k = sin 30°."""
    for mode, ends, euler in (("B1", PP, 0.25), ("B1", CC, 1.0)):
        P = 1.15171962 * euler
        s = elastica.solve(mode, P=P, H=0.45, ends=ends)
        assert np.degrees(s.max_slope) == pytest.approx(60, abs=2e-7)
        assert s.shortening == pytest.approx(0.2589803939, abs=5e-9)
        assert 0.45 - s.clearance == pytest.approx(0.2966038231, abs=2e-9)


@pytest.mark.parametrize(("ends", "free"), [(CC, (1, 1)), ("clamped-pinned", (1, 0.5)), (PP, (0.5, 0.5))])
def test_small_deflection_limit(ends, free):
    """H → 0: point contact up to √P = Σ, free lengths ½/√P (pinned) and 1/√P (clamped), buckling at Σ + 1."""
    total = sum(free)
    for H in (1e-3, 1e-5, 1e-8):
        assert loads("point_to_line", H, ends) == pytest.approx(total**2, rel=20 * H**2 + 1e-12)
        assert loads("flat_buckles", H, ends) == pytest.approx((total + 1) ** 2, rel=20 * H**2 + 1e-12)
        s = elastica.solve("U-", P=total**2 + 1, H=H, ends=ends)
        assert s.lengths * np.sqrt(total**2 + 1) == pytest.approx(free, rel=20 * H**2 + 1e-12)
