"""Places where a solver of this kind goes wrong: separatrix, folds, κ → 0, overhanging shapes, tiny gaps."""

import mpmath
import numpy as np
import pytest
from references.onsets import loads

import elastica
from elastica import Stability, Status

CC, CP, PP = "clamped-clamped", "clamped-pinned", "pinned-pinned"
DISTANCES = np.concatenate([-(10.0 ** -np.arange(4.0, 13)), 10.0 ** -np.arange(12.0, 3, -1)])


@pytest.mark.parametrize("P", [0.26, 0.5, 2.0, 4.5, 10.0, 20.0, 40.0, 90.0])
def test_free_shape_up_to_a_narrow_loop(P):
    """K(m) = π√P, solved for ln(1 − m) with 60 digits; rounding of κ alone would lose 1 − m."""
    s = elastica.solve("B1", P=P, H=0.4999, ends=PP)
    with mpmath.workdps(60):
        K = mpmath.pi * mpmath.sqrt(mpmath.mpf(P))
        x = mpmath.findroot(lambda x: mpmath.ellipk(1 - mpmath.exp(x)) - K, mpmath.log(16) - 2 * K)
        m1 = mpmath.exp(x)
        E = mpmath.ellipe(1 - m1)
        assert s.shortening == pytest.approx(float(2 - 2 * E / K), rel=1e-14)
        assert s.curvature == pytest.approx(float(4 * mpmath.pi * mpmath.sqrt(P * (1 - m1))), rel=2e-14)
        assert s.max_slope == pytest.approx(float(2 * mpmath.asin(mpmath.sqrt(1 - m1))), rel=1e-13)
    assert s.lengths[0] == pytest.approx(1, abs=1e-14)
    assert s.error < 1e-12


def test_free_shapes_exist_at_every_load_above_their_euler_load():
    for state, ends, load in (("B1", PP, 0.25), ("B2", PP, 1.0), ("B1", CC, 1.0), ("B3", CC, 4.0)):
        s = elastica.solve(state, P=load * np.geomspace(1 + 1e-12, 3000, 4000), H=0.45, ends=ends)
        assert np.isin(s.status, (Status.SOLVED, Status.INADMISSIBLE)).all()


@pytest.mark.parametrize(
    ("state", "ends", "fold"), [("B2", CC, 2.3313585407826656), ("B1", CP, 0.5828396351956658)]
)
def test_free_shapes_with_a_fold_exist_exactly_up_to_it(state, ends, fold):
    s = elastica.solve(state, P=fold * (1 + DISTANCES), H=5.0, ends=ends)
    assert np.array_equal(s.status == Status.SOLVED, DISTANCES < 0)
    assert np.array_equal(s.status == Status.NO_EQUILIBRIUM, DISTANCES > 0)


@pytest.mark.parametrize("ends", [CC, CP, PP])
def test_eigenvalues_stay_smooth_as_the_point_becomes_a_line(ends):
    """The contact stiffness μ/κ grows without bound; the eigenvalues tend to those with φ = 0 there."""
    load = float(loads("point_to_line", 0.1, ends))
    s = elastica.solve("U", P=load * (1 - 10.0 ** -np.arange(6.0, 15)), H=0.1, ends=ends)
    solved = s.status == Status.SOLVED
    values = s.eigenvalues(3)[solved]
    line = elastica.solve("U-", P=load * (1 + 1e-13), H=0.1, ends=ends).eigenvalues(3)
    gap = np.abs(values - line) / np.maximum(np.abs(line), np.pi**2)
    assert (gap[:, :1] <= 300 * 10.0 ** -np.arange(6.0, 15)[solved, None] + 1e-11).all()


def test_a_point_on_the_transition_does_not_spoil_the_others():
    s = elastica.solve("U", P=[2.0, 2.5, 3.937821184236157, 4.0], H=[0.1, 0.1, 0.1, 1e-8])
    values = s.eigenvalues(2)
    assert values[1, 0] == pytest.approx(24.8282985, abs=5e-8)
    assert np.isfinite(values[s.status == Status.SOLVED]).all()


@pytest.mark.parametrize(
    ("P", "H", "kappa", "slope"),
    [
        (1.725, 0.389, 10.5576, 114.46),
        (1.73, 0.390, 11.0185, None),
        (1.74, 0.390, 11.3862, None),
        (1.75, 0.390, 11.698, None),
    ],
)
def test_overhanging_one_point_states(P, H, kappa, slope):
    """Found by a search from 400 random starts, beyond the place where d_λ changes sign."""
    s = elastica.solve("U", P=P, H=H)
    assert s.curvature == pytest.approx(kappa, abs=5e-4)
    if slope:
        assert np.degrees(s.max_slope) == pytest.approx(slope, abs=5e-3)


def test_the_region_of_an_overhanging_state_has_no_holes():
    """Along the gap U is found, then pulled on, then gone: no speckles."""
    H = np.linspace(0.25, 0.45, 200)
    for P in (1.0, 1.6, 1.7, 1.725, 1.74, 1.9, 2.15):
        changes = np.flatnonzero(np.diff(elastica.solve("U", P=P, H=H).status))
        assert changes.size <= 2


@pytest.mark.parametrize(
    ("ends", "euler", "slope"), [(CC, 1.0, 1.2337), (PP, 0.25, 1.2337), (CP, 0.5114371289846, 0.9765)]
)
def test_the_wall_is_touched_just_above_the_euler_load_when_it_is_near(ends, euler, slope):
    for H in (1e-2, 1e-3, 1e-4, 1e-5):
        assert loads("touches", H, ends) / euler - 1 == pytest.approx(slope * H**2, rel=2e-2, abs=1e-11)


@pytest.mark.parametrize("ends", [CC, CP, PP])
@pytest.mark.parametrize("H", [1e-6, 1e-3, 0.05, 0.15])
def test_point_and_line_hand_over_without_a_gap(ends, H):
    load = float(loads("point_to_line", H, ends))
    point, line = (elastica.solve(state, P=load * (1 + DISTANCES), H=H, ends=ends) for state in ("U", "U-"))
    below = DISTANCES < -1e-11
    above = DISTANCES > 1e-11
    assert (point.stability[below] == Stability.STABLE).all()
    assert (line.status[below] == Status.INADMISSIBLE).all()
    # What is called U from there on has a further period, and is far from a minimum.
    assert (point.periods.sum(axis=1)[above & (point.status != Status.NO_EQUILIBRIUM)] > 0).all()
    assert (point.stability[above] != Stability.STABLE).all()
    assert (line.status[above] == Status.SOLVED).all()
    assert ((point.status == Status.SOLVED) | (line.status == Status.SOLVED)).all()


@pytest.mark.parametrize("H", [1e-8, 1e-6, 1e-4, 1e-2, 0.3])
def test_loads_from_zero_to_the_largest(H):
    P = np.concatenate([[0.0], np.geomspace(1e-12, 1e6, 200)])
    for ends in (CC, CP, PP):
        for state in ("0", "B1", "B2", "U", "Ua", "U-"):
            s = elastica.solve(state, P=P, H=H, ends=ends)
            assert (s.status != Status.FAILED).all() or state in ("B1", "B2")
            solved = s.status == Status.SOLVED
            assert np.isfinite(s.energy[solved]).all()
            assert (s.index[solved] >= 0).all()
