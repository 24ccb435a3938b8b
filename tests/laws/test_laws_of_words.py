"""Laws of words of several contacts, with springs, further periods and prescribed shortening."""

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from references.onsets import loads

import elastica
from elastica import Stability, Status
from elastica.control import SHORTENING
from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root
from elastica.finding import search
from elastica.scene import Scene

FOUR_PI_SQUARED = 4 * np.pi**2
ALLOWED = ("clamped-clamped", "clamped-pinned", "pinned-pinned", "0.3/2.5", "2.5/0.3", "clamped/0.05", "1/1")
ENDS = st.sampled_from(ALLOWED)
QUICK = st.sampled_from(ALLOWED[:3])
"""Ends whose branches at prescribed shortening take no seconds to trace."""
FEW = settings(max_examples=max(5, settings().max_examples // 20))
SEEDS = st.integers(0, 2**32 - 1)
THERE = (Status.SOLVED, Status.INADMISSIBLE)
WORDS = [word for word in elastica.states("0.3/2.5", 3) if word.strip("a-")[0] == "U"]
POINTS = st.sampled_from([*WORDS, "UU:2", "UUa:2", "UDa:2", "Ua:2"])


def draw(seed, n=8, largest=12):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.2, largest, n), rng.uniform(0.01, 0.13, n)


def meaningful(state, ends):
    """Whether a line word has a meaning for these ends."""
    a, b = parse_ends(ends)
    assume(not state.endswith("-") or not ((state[0] == "a" and a.clamped) or ("a-" in state and b.clamped)))


def smooth(s, near):
    """Points where a state and its neighbours (2, n) are the same smooth branch, away from folds."""
    there = np.isin(s.status, THERE) & np.isin(near.status, THERE).all(axis=0)
    bend = np.abs(near.curvature.sum(axis=0) - 2 * s.curvature)
    same = (near.periods == s.periods).all(axis=(0, -1))
    return there & same & (bend < 1e-6 * (1 + s.curvature)) & (s.error < 1e-11)


def slope(values, width):
    return (values[0] - values[1]) / (2 * width)


@pytest.mark.at_least(10)
@FEW
@given(POINTS, ENDS, SEEDS)
def test_energy_falls_with_load_by_the_shortening_and_with_gap_by_the_reactions(compared, state, ends, seed):
    meaningful(state, ends)
    P, H = draw(seed)
    step = 2e-5 * np.array([[1], [-1]])
    at = elastica.solve(state, P=P, H=H, ends=ends)
    load = elastica.solve(state, P=P * (1 + step), H=H, ends=ends)
    gap = elastica.solve(state, P=P, H=H * (1 + step), ends=ends)
    along_P, along_H = (smooth(at, near) for near in (load, gap))
    compared(along_P & along_H)
    expected = -at.shortening[along_P]
    assert slope(load.energy, 2e-5 * P)[along_P] == pytest.approx(expected, rel=2e-6, abs=1e-9)
    expected = -at.reaction.sum(axis=-1)[along_H]
    assert slope(gap.energy, 2e-5 * H)[along_H] == pytest.approx(expected, rel=2e-6, abs=1e-6)


@pytest.mark.at_least(20)
@FEW
@given(st.sampled_from(["U", "Ua", "UU", "UD", "UDa", "U-", "B1", "B2"]), QUICK, SEEDS)
def test_bending_energy_grows_with_the_prescribed_shortening_by_the_load(compared, state, ends, seed):
    H = np.random.default_rng(seed).uniform(0.02, 0.1)
    shortening = np.linspace(0.5, 8, 16) * H**2
    step = 2e-5 * np.array([[0], [1], [-1]])
    s = elastica.solve(state, shortening=shortening * (1 + step), H=H, ends=ends)
    there = np.isin(s.status, THERE).all(axis=0) & (s.periods == s.periods[0]).all(axis=(0, -1))
    there &= np.abs(s.P[1] + s.P[2] - 2 * s.P[0]) < 1e-6 * s.P[0]
    compared(there)
    work = slope(s.bending_energy[1:], 2e-5 * shortening)
    assert work[there] == pytest.approx(s.P[0, there], rel=1e-5)


@pytest.mark.at_least(8)
@FEW
@given(
    POINTS, st.sampled_from(["1/1", "clamped-clamped", "0.3/2.5", "clamped/0.05", "clamped-pinned"]), SEEDS
)
def test_a_word_seen_from_its_other_end_is_the_same_state(compared, state, ends, seed):
    meaningful(state, ends)
    body, _, root = state.partition(":")
    back = body[-2::-1] + "-" if body.endswith("-") else body[::-1]
    other = f"{back}:{root}" if root else back
    cut = "/" if "/" in ends else "-"
    P, H = draw(seed)
    a = elastica.solve(state, P=P, H=H, ends=ends)
    b = elastica.solve(other, P=P, H=H, ends=cut.join(ends.split(cut)[::-1]))
    for field in ("curvature", "energy", "shortening", "max_slope"):
        assert np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True), field
    # Of two shares of periods that have one curvature either may come first.
    same = (a.periods == b.periods[..., ::-1]).all(axis=-1) & np.isin(a.status, THERE)
    compared(same)
    canonical = a.state.name == b.state.name
    for field in ("status", "stability", "index", "nullity", "clearance"):
        assert np.array_equal(getattr(a, field)[same], getattr(b, field)[same], equal_nan=True), field
    if not canonical:
        assert a.reaction[same] == pytest.approx(b.reaction[same][:, ::-1], abs=1e-12)
        assert a.lengths[same] == pytest.approx(b.lengths[same][:, ::-1], abs=1e-13)


def spelled(inner, a, b):
    """Word with these segments between its contacts: "0" back to the same wall, "S" to the other."""
    word = "U"
    for kind in inner:
        word += word[-1] if kind == "0" else "DU"[word[-1] == "D"]
    return a + word + b


@pytest.mark.at_least(5)
@FEW
@given(
    st.sampled_from(["00S", "0S", "0SS", "00SS", "0S0S"]),
    st.sampled_from([("", ""), ("", "a"), ("a", "a"), ("a", "")]),
    ENDS,
    SEEDS,
)
def test_the_order_of_segments_does_not_matter_to_curvature_and_energy(compared, inner, sides, ends, seed):
    P, H = draw(seed, largest=40)
    words = {spelled(order, *sides) for order in permutations(inner)}
    if parse_ends(ends).alike:
        words |= {spelled(order, *sides[::-1]) for order in permutations(inner)}
    first, *others = (elastica.solve(word, P=P, H=H, ends=ends) for word in sorted(words))
    for other in others:
        for field in ("curvature", "energy", "bending_energy", "shortening", "max_slope"):
            assert np.array_equal(getattr(first, field), getattr(other, field), equal_nan=True), field
        both = (first.status == Status.SOLVED) & (other.status == Status.SOLVED)
        compared(both)
        assert np.array_equal(first.index[both], other.index[both])


@pytest.mark.at_least(20)
@FEW
@given(st.sampled_from(["U-", "UD-", "UDU-"]), ENDS, SEEDS)
def test_segments_of_lines_depend_on_gap_and_load_through_one_number(compared, state, ends, seed):
    """At fixed H√P and k/√P a line state's segments are the same up to size."""
    P, H = draw(seed)
    scale = 1.44
    sizes = [
        k if k in ("clamped", "pinned") else str(float(k) * scale) for k in ends.replace("-", "/").split("/")
    ]
    small = elastica.solve(state, P=P, H=H, ends=ends)
    large = elastica.solve(state, P=scale**2 * P, H=H / scale, ends="/".join(sizes))
    there = np.isin(small.status, THERE) & ~small.periods.any(axis=-1) & ~large.periods.any(axis=-1)
    compared(there)
    assert large.lengths[there] * scale == pytest.approx(small.lengths[there], rel=1e-10)
    assert large.lam[there] == pytest.approx(scale**2 * small.lam[there], rel=1e-9)


@pytest.mark.at_least(10)
@FEW
@given(st.sampled_from([w for w in WORDS if not w.endswith("-")]), st.sampled_from(["clamped", "0.7"]), SEEDS)
def test_very_stiff_and_very_soft_springs_are_clamps_and_pins(compared, state, other, seed):
    P, H = draw(seed)
    for k, limit in (("1e12", "clamped"), ("1e-12", "pinned")):
        spring = elastica.solve(state, P=P, H=H, ends=f"{other}/{k}")
        exact = elastica.solve(state, P=P, H=H, ends=f"{other}/{limit}")
        assert np.array_equal(np.isin(spring.status, THERE), np.isin(exact.status, THERE))
        firm = np.isin(exact.status, THERE) & (exact.error < 1e-11)
        for field in ("curvature", "energy", "shortening", "max_slope"):
            assert getattr(spring, field)[firm] == pytest.approx(getattr(exact, field)[firm], rel=1e-7), field
        solved = firm & (exact.status == Status.SOLVED) & (spring.status == Status.SOLVED)
        solved &= exact.stability != Stability.CRITICAL
        compared(solved)
        assert np.array_equal(spring.index[solved], exact.index[solved])


@pytest.mark.at_least(10)
@FEW
@given(POINTS, st.floats(-2, 2), SEEDS)
def test_energy_grows_with_a_spring_by_half_the_square_of_its_angle(compared, state, exponent, seed):
    meaningful(state, "0.4/1")
    P, H = draw(seed)
    k, step = 10.0**exponent, 1e-4
    at, stiff, soft = (
        elastica.solve(state, P=P, H=H, ends=f"0.4/{k * f!r}") for f in (1, 1 + step, 1 - step)
    )
    there = np.isin([s.status for s in (at, stiff, soft)], THERE).all(axis=0) & (at.error < 1e-11)
    there &= (at.periods == stiff.periods).all(axis=-1) & (at.periods == soft.periods).all(axis=-1)
    bend = np.abs(stiff.curvature + soft.curvature - 2 * at.curvature)
    there &= bend < 1e-5 * (1 + at.curvature)
    growth = (stiff.energy - soft.energy) / (2 * step * k)
    angle = at.shape(2).theta[:, -1]
    compared(there)
    assert growth[there] == pytest.approx(0.5 * angle[there] ** 2, rel=1e-4, abs=1e-9)


def beam(q, length, start, end, rise):
    """Small deflection of a compressed beam, y'''' + q²y'' = 0, between two kinds of end.

    `start` and `end` are the rotational stiffnesses c there (inf: y' = 0).

    Returns
    -------
    curvatures y'' at both ends, vertical force y''' + q²y', and ∫y'²/2
    """

    def derivatives(s):
        sin, cos = np.sin(q * s), np.cos(q * s)
        return np.array(
            [
                [1, s, sin, cos],
                [0, 1, q * cos, -q * sin],
                [0, 0, -(q**2) * sin, -(q**2) * cos],
            ]
        )

    rows, right = [], [0.0, 0.0, rise, 0.0]
    for s, c, sign in ((0.0, start, 1), (length, end, -1)):
        y, turn, bend = derivatives(s)
        rows += [y, turn if np.isinf(c) else bend - sign * c * turn]
    c = np.linalg.solve(rows, right)
    s, weight = np.polynomial.legendre.leggauss(40)
    s = (s + 1) * length / 2
    slopes = np.array([derivatives(x)[1] @ c for x in s])
    short = 0.5 * (weight * length / 2) @ slopes**2
    return derivatives(0)[2] @ c, derivatives(length)[2] @ c, q**2 * c[1], short


@pytest.mark.at_least(10)
@FEW
@given(st.sampled_from(["U", "UD", "UDU"]), ENDS, SEEDS)
def test_small_deflections_are_those_of_a_straight_beam(compared, state, ends, seed):
    """H → 0: between contacts a linear problem, singular for a full period; curvatures agree at contacts."""
    P, _ = draw(seed, 6)
    H = 1e-6
    s = elastica.solve(state, P=P, H=H, ends=ends)
    walls = [1 if c == "U" else -1 for c in s.state.word]
    heights = [0, *walls, 0]
    springs = [end.stiffness for end in s.ends]
    springs = [springs[0], *[np.inf] * len(walls), springs[1]]
    plain = np.isin(s.status, THERE) & ~s.periods.any(axis=-1)
    for i in np.flatnonzero(plain & (s.curvature > 1e-2 * H * P * FOUR_PI_SQUARED)):
        compared(1)
        q = 2 * np.pi * np.sqrt(P[i])
        out = [
            beam(q, s.lengths[i, j], springs[j], springs[j + 1], heights[j + 1] - heights[j])
            for j in range(len(walls) + 1)
        ]
        scale = H * max(abs(o[2]) for o in out) + H * q**2
        for wall, (left, right) in zip(walls, pairwise(out), strict=True):
            assert -wall * left[1] * H == pytest.approx(s.curvature[i], rel=1e-6, abs=1e-8 * scale)
            assert -wall * right[0] * H == pytest.approx(s.curvature[i], rel=1e-6, abs=1e-8 * scale)
        force = np.array([o[2] for o in out])
        reactions = np.array(walls) * (force[:-1] - force[1:]) * H / FOUR_PI_SQUARED
        assert s.reaction[i] == pytest.approx(reactions, rel=1e-6, abs=1e-8 * scale)
        assert s.shortening[i] == pytest.approx(H**2 * sum(o[3] for o in out), rel=1e-6)


@pytest.mark.parametrize(
    ("word", "P", "H"),
    [("aUa", 2.509616719608138, 0.10314729136550145), ("aUUUa", 13.853502692790672, 0.09874991167294019)],
)
def test_index_changes_by_one_at_a_fold_where_two_roots_meet(word, P, H):
    """The gap at which the first two roots of a pinned word merge, by bisection."""
    ends = "pinned-pinned"

    def pair(H):
        found = [elastica.solve(name, P=P, H=H, ends=ends) for name in (word, word + ":2")]
        there = all(s.status in THERE and not s.periods.any() for s in found)
        return found if there else None

    there, gone = H, next(H * f for f in np.geomspace(1.01, 3, 100) if pair(H * f) is None)
    for _ in range(45):
        middle = 0.5 * (there + gone)
        there, gone = (middle, gone) if pair(middle) else (there, middle)
    wide, narrow = (pair(there * (1 - distance)) for distance in (1e-6, 1e-8))
    for first, second in (wide, narrow):
        assert (first.status, second.status) == (Status.SOLVED, Status.SOLVED)
        assert first.index - second.index == 1
        assert [int((s.eigenvalues(8) < 0).sum()) for s in (first, second)] == [first.index, second.index]
    # They meet as the square root of the distance.
    wide, narrow = (float(second.curvature - first.curvature) for first, second in (wide, narrow))
    assert wide / narrow == pytest.approx(10, rel=0.02)


@pytest.mark.at_least(40)
def test_index_at_prescribed_shortening_changes_where_the_shortening_is_smallest(compared):
    H, fold = 0.05, 0.007386777
    above = fold + 1e-6
    pair = [elastica.solve(name, shortening=above, H=H) for name in ("Ua", "Ua:2")]
    assert elastica.solve("Ua", shortening=fold - 1e-8, H=H).status == Status.NO_EQUILIBRIUM
    loaded = [elastica.solve("Ua", P=s.P, H=H) for s in pair]
    by_load = sorted(pair, key=lambda s: float(s.P))
    assert by_load[0].P < 3.65445 < by_load[1].P
    assert np.mean([s.P for s in pair]) == pytest.approx(3.65445, abs=2e-3)
    assert [int(s.index) for s in by_load] == [0, 1]
    assert [int(s.stability) for s in by_load] == [Stability.STABLE, Stability.UNSTABLE]
    assert [int(s.index) for s in loaded] == [1, 1]
    P = np.linspace(2.0661, 3.98, 60)
    s = elastica.solve("Ua", P=P, H=H)
    nearest = np.full(P.size, np.inf)
    for root in ("Ua", "Ua:2", "Ua:3", "Ua:4"):
        again = elastica.solve(root, shortening=s.shortening, H=H)
        same = np.abs(again.P - P) < 1e-5
        compared(same)
        nearest = np.fmin(nearest, np.abs(again.P - P))
        assert np.array_equal(again.index[same], P[same] > 3.65445), root
    assert nearest == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("ends", ALLOWED)
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_index_changes_by_one_at_the_pitchfork_of_the_straight_strip(ends, mode):
    euler = float(euler_root(mode, parse_ends(ends))) ** 2 / FOUR_PI_SQUARED
    straight = elastica.solve("0", P=euler * np.array([1 - 1e-6, 1 + 1e-6]), H=0.4, ends=ends)
    assert straight.index.tolist() == [mode - 1, mode]
    assert (straight.eigenvalues(5) < 0).sum(axis=1).tolist() == [mode - 1, mode]
    bent = elastica.solve(f"B{mode}", P=euler * np.array([1 - 1e-6, 1 + 1e-4]), H=0.4, ends=ends)
    assert bent.status.tolist() == [Status.NO_EQUILIBRIUM, Status.SOLVED]
    assert bent.index[1] == mode - 1
    assert bent.shortening[1] < 1e-3


@pytest.mark.parametrize("ends", ["clamped-clamped", "pinned-pinned", "0.3/2.5"])
def test_two_contacts_leave_the_line_where_its_flat_stretch_buckles(ends):
    H = 0.05
    if "/" in ends:
        P = np.linspace(3, 9, 4001)
        line = elastica.solve("U-", P=P, H=H, ends=ends)
        load = P[np.argmin(np.abs(np.sqrt(P) * line.flat_length - 1))]
        near = 1e-2
    else:
        load, near = float(loads("flat_buckles", H, ends)), 1e-4
    line = elastica.solve("U-", P=load * np.array([1 - near, 1 + near]), H=H, ends=ends)
    assert (line.index[1] - line.index[0], line.index[0]) == (1, 0)
    UU = elastica.solve("UU", P=load * np.array([1 - near, 1 + near]), H=H, ends=ends)
    there = np.isin(UU.status, THERE) & (UU.curvature < 2)
    assert there.sum() == 1, UU.curvature
    assert UU.index[there] == 1


@pytest.mark.at_least(20)
@pytest.mark.parametrize(("state", "largest"), [("U", 12), ("Ua", 12), ("UD", 12), ("U-", 12), ("B2", 2.4)])
def test_the_shortening_of_a_state_finds_the_same_state_again(compared, state, largest, rng):
    """Also where it is inadmissible, but for lines that do not fit the strip: those are not followed."""
    H = 0.05
    s = elastica.solve(state, P=rng.uniform(0.5, largest, 600), H=H)
    there = s.status == Status.SOLVED if state == "U-" else np.isin(s.status, THERE)
    known = there & (s.max_slope < 0.999 * np.pi / 2)
    known &= (s.shortening > 1e-9) & (s.periods.sum(axis=-1) <= 3)
    known = np.flatnonzero(known)[:60]
    shorter = s.shortening[known]
    compared(shorter)
    nearest = np.full(shorter.size, np.inf)
    scene = Scene(parse_ends("clamped-clamped"), np.full(shorter.size, H))
    for points, _, again in search([state], scene, SHORTENING, shorter):
        away = np.abs(again.P - s.P[known][points]) + np.abs(again.curvature - s.curvature[known][points])
        np.minimum.at(nearest, points, away)
    assert (nearest < 1e-6).all(), (nearest, s.P[known])
