"""Laws that every state obeys, on random states."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import elastica
from elastica import Stability, Status
from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root

FOUR_PI_SQUARED = 4 * np.pi**2
ALLOWED = ["clamped-clamped", "clamped-pinned", "pinned-clamped", "pinned-pinned"]
ENDS = st.sampled_from(ALLOWED)
LOADS = st.floats(0.02, 12)
GAPS = st.floats(0.005, 0.25)
CONTACT = st.sampled_from(["U", "Ua", "aU", "aUa", "U-"])


def draw(state, ends, n, highest, rng):
    """At most n states of eight times as many points; half of a free shape's are just above its own load."""
    P, H = rng.uniform(0.5, 12, 8 * n), highest * rng.uniform(0.2, 1, 8 * n) ** 3
    if state.startswith("B"):
        euler = float(euler_root(int(state[1:]), parse_ends(ends))) ** 2 / FOUR_PI_SQUARED
        P[::2] = euler * (1 + 10 ** rng.uniform(-4, -1, P[::2].size))
    there = elastica.solve(state, P=P, H=H, ends=ends).status == Status.SOLVED
    return elastica.solve(state, P=P[there][:n], H=H[there][:n], ends=ends)


def solved(state, P, H, ends):
    s = elastica.solve(state, P=P, H=H, ends=ends)
    assume(np.isin(s.status, (Status.SOLVED, Status.INADMISSIBLE)).all())
    return s


@pytest.mark.at_least(20)
@given(CONTACT, LOADS, GAPS, ENDS)
def test_energy_falls_with_load_by_the_shortening_and_with_gap_by_the_reaction(compared, state, P, H, ends):
    at = solved(state, P, H, ends)
    # On a branch that is about to fold or to leave the point regime differences say nothing.
    assume(at.error < 1e-12)
    steps = 1e-5 * np.array([1, -1, 0.5, -0.5])
    load = solved(state, P * (1 + steps), H, ends)
    gap = solved(state, P, H * (1 + steps), ends)
    assume(np.abs(np.diff(load.curvature)).max() < 1e-2 * (1 + at.curvature))
    compared(1)
    assert slope(load.energy, steps * P) == pytest.approx(-float(at.shortening), rel=1e-6, abs=1e-9)
    assert slope(gap.energy, steps * H) == pytest.approx(-float(at.reaction.sum()), rel=1e-6, abs=1e-7)


def slope(values, steps):
    """Derivative from values at ±h and ±h/2, without the error of second order."""
    wide, narrow = (values[::2] - values[1::2]) / (steps[::2] - steps[1::2])
    return (4 * narrow - wide) / 3


@pytest.mark.at_least(5)
@given(CONTACT, LOADS, GAPS)
def test_a_strip_seen_from_its_other_end_is_the_same_strip(compared, state, P, H):
    mirrored = state[-2::-1] + "-" if state.endswith("-") else state[::-1]
    a = elastica.solve(state, P=P, H=H, ends="clamped-pinned")
    b = elastica.solve(mirrored, P=P, H=H, ends="pinned-clamped")
    for field in ("status", "stability", "index", "nullity", "curvature", "energy", "max_slope", "clearance"):
        assert np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True), field
    compared(a.status == Status.SOLVED)
    if a.status == Status.SOLVED:
        left, right = a.shape(41), b.shape(41)
        assert left.y == pytest.approx(right.y[::-1], abs=1e-13)
        assert left.theta == pytest.approx(-right.theta[::-1], abs=1e-12)


@pytest.mark.at_least(15)
@given(st.sampled_from(["U", "U-", "B1"]), LOADS, GAPS)
def test_a_pinned_strip_is_half_of_a_clamped_one(compared, state, P, H):
    """Two pinned half shapes make one clamped segment of twice the size."""
    pinned = elastica.solve(state, P=P, H=H, ends="pinned-pinned")
    clamped = elastica.solve(state, P=4 * P, H=H, ends="clamped-clamped")
    assume(not (pinned.periods.any() or clamped.periods.any()))
    compared(np.isfinite(pinned.curvature))
    if state == "U-":
        assert pinned.lengths == pytest.approx(clamped.lengths, rel=1e-11, nan_ok=True)
    elif Status.NOT_FOLLOWED in (pinned.status, clamped.status):
        # The longer strip has room for more periods, some of which end the search.
        assert {int(pinned.status), int(clamped.status)} <= {Status.NO_EQUILIBRIUM, Status.NOT_FOLLOWED}
    else:
        assert pinned.status == clamped.status
    assert 2 * pinned.curvature == pytest.approx(float(clamped.curvature), rel=1e-9, nan_ok=True)
    assert pinned.max_slope == pytest.approx(float(clamped.max_slope), rel=1e-9, nan_ok=True)


@pytest.mark.at_least(10, full=1_000)
@pytest.mark.parametrize("ends", ALLOWED)
@pytest.mark.parametrize("state", ["B1", "B2", "U", "Ua", "aU", "aUa"])
def test_index_is_the_number_of_negative_eigenvalues(compared, state, ends, full, rng):
    """Up to H = 0.45, where the strip overhangs and the general formula for the index is needed."""
    s = draw(state, ends, 5_000 if full else 50, 0.45, rng)
    sure = s.stability != Stability.CRITICAL
    compared(sure)
    assert np.array_equal((s.eigenvalues(8)[sure] < 0).sum(axis=1), s.index[sure])


@pytest.mark.at_least(10, full=300)
@pytest.mark.parametrize("ends", ALLOWED)
@pytest.mark.parametrize("state", ["B1", "B2", "U", "Ua", "aU", "aUa", "U-"])
def test_shape_fits_between_the_walls_and_agrees_with_the_numbers(compared, state, ends, full, rng):
    s = draw(state, ends, 1_600 if full else 50, 0.25, rng)
    compared(s.status == Status.SOLVED)
    shape = s.shape(2001)
    theta, x, y = shape.theta, shape.x, shape.y
    step = 1 / 2000
    assert (np.abs(y).max(axis=1, initial=0) <= s.H * (1 + 1e-12)).all()
    assert y[:, [0, -1]] == pytest.approx(0, abs=1e-11)
    assert x[:, 0] == pytest.approx(0, abs=1e-14)
    assert x[:, -1] == pytest.approx(1 - s.shortening, abs=1e-9)
    middle = (theta[:, 1:] + theta[:, :-1]) / 2
    assert np.diff(y) == pytest.approx(step * np.sin(middle), abs=1e-7)
    assert np.diff(x) == pytest.approx(step * np.cos(middle), abs=1e-7)
    assert np.abs(theta).max(axis=1, initial=0) == pytest.approx(s.max_slope, abs=1e-4)
    bending = 0.5 * np.sum(np.diff(theta) ** 2, axis=1) / step / FOUR_PI_SQUARED
    assert bending == pytest.approx(s.bending_energy, rel=1e-4)
    force = np.hypot(4 * np.pi**2 * s.P, np.abs(s.lam).max(axis=1))
    for end, angle, turn in zip(
        ends.split("-"), theta[:, [0, -1]].T, np.diff(theta)[:, [0, -1]].T, strict=True
    ):
        if end == "clamped":
            assert angle == pytest.approx(0, abs=1e-12)
        else:
            assert (np.abs(turn) <= step**2 * force).all()


@pytest.mark.at_least(20)
@given(st.lists(st.tuples(st.floats(0, 20), st.floats(1e-6, 0.49)), min_size=2, max_size=40), ENDS)
def test_a_point_does_not_depend_on_its_neighbours(compared, points, ends):
    P, H = np.array(points).T
    for state in ("B2", "U", "aUa", "U-"):
        together = elastica.solve(state, P=P, H=H, ends=ends)
        alone = elastica.solve(state, P=P[1], H=H[1], ends=ends)
        compared(np.isfinite(alone.curvature))
        for field in ("status", "index", "curvature", "energy", "error", "lengths", "lam"):
            assert np.array_equal(getattr(together, field)[1], getattr(alone, field), equal_nan=True), field
        assert np.array_equal(together.eigenvalues(3)[1], alone.eigenvalues(3), equal_nan=True)


@pytest.mark.at_least(20)
@given(st.floats(allow_nan=True, allow_infinity=True), st.floats(allow_nan=True, allow_infinity=True), ENDS)
def test_any_number_gives_an_answer_or_a_reason(compared, P, H, ends):
    for state in ("0", "B1", "U", "Ua", "U-"):
        s = elastica.solve(state, P=[P, 2.5], H=[H, 0.1], ends=ends)
        good = 0 <= P <= 1e6 and 0 < H < np.inf
        assert (s.status[0] == Status.FAILED) == (0 in s.reasons)
        compared(not good)
        if not good:
            assert s.status[0] == Status.FAILED
        assert 1 not in s.reasons
        assert np.isnan(s.curvature[0]) == (
            s.status[0] in (Status.FAILED, Status.NO_EQUILIBRIUM, Status.NOT_FOLLOWED)
        )
