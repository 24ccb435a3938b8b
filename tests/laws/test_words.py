"""Words of several contacts: known values, the order of segments, families of lines, random audits."""

from itertools import permutations

import numpy as np
import pytest

import elastica
from elastica import Stability, Status

CC, PP = "clamped-clamped", "pinned-pinned"
ENDS = (CC, "clamped-pinned", "pinned-clamped", PP, "0.3/2.5", "clamped/0.05")
FOUR_PI_SQUARED = 4 * np.pi**2


def test_two_contacts_on_opposite_walls():
    s = elastica.solve("UD", P=[3.0, 3.9, 4.5, 6.0], H=0.1)
    assert s.curvature == pytest.approx([5.45508, 4.70464, 4.16830, 2.65259], abs=5e-6)
    assert (s.stability == Stability.STABLE).all()


def test_two_contacts_on_one_wall():
    s = elastica.solve("UU", P=6.0, H=0.1)
    assert s.curvature == pytest.approx(4.18201, abs=5e-6)
    assert (s.index, s.eigenvalues(1)[0]) == (1, pytest.approx(-74.6126, abs=5e-5))


@pytest.mark.parametrize(
    ("word", "ends", "minimum", "published"),
    [
        ("UD", CC, 344.8761334891, 344.876140),
        ("UDU", CC, 346.4956411150, 346.496068),
        ("UDU", PP, 340.0304038891, 340.030395),
    ],
)
def test_minima_of_the_benchmark_clnlbeam(word, ends, minimum, published):
    """Its objective is α + 2V at thrust α/2, H = 0.05, α = 350; published with 1,000 elements."""
    s = elastica.solve(word, P=175 / FOUR_PI_SQUARED, H=0.05, ends=ends)
    objective = 350 + 2 * FOUR_PI_SQUARED * s.energy
    assert (s.status, s.stability) == (Status.SOLVED, Stability.STABLE)
    assert objective == pytest.approx(minimum, abs=1e-9)
    assert objective == pytest.approx(published, abs=5e-4)


def test_words_of_the_same_segments_are_the_same_state_up_to_their_order():
    """UUD, UDD and the like: two end segments, one between the walls, one back to the same wall."""
    P, H = np.linspace(6, 16, 40), 0.06
    first = elastica.solve("UUDU", P=P, H=H)
    assert (first.status == Status.SOLVED).any()
    for word in ("UDDU", "UDUU"):
        other = elastica.solve(word, P=P, H=H)
        for field in ("curvature", "energy", "shortening"):
            assert np.array_equal(getattr(first, field), getattr(other, field), equal_nan=True)
        # The reactions are shared out differently, so that one order may push where another pulls.
        both = (first.status == Status.SOLVED) & (other.status == Status.SOLVED)
        assert both.any()
        assert np.array_equal(first.index[both], other.index[both])


def test_small_deflections_share_the_length_among_equal_full_periods():
    """H → 0: every segment of a line state has √P ℓ = 1, or half of it from a pin."""
    word = "UD" * 5
    for ends, segments in ((CC, 11), (PP, 10)):
        s = elastica.solve(word + "-", P=(segments + 0.5) ** 2, H=1e-6, ends=ends)
        assert s.lengths.sum() * (segments + 0.5) == pytest.approx(segments, rel=1e-8)
        assert s.flat_length == pytest.approx(1 - segments / (segments + 0.5), rel=1e-8)
        assert s.contact_position.shape == (10,)


def test_several_lines_are_a_neutral_family_or_slide_at_a_clamp():
    pinned = elastica.solve("UD-", P=5.0, H=0.02, ends=PP)
    assert (pinned.stability, pinned.index, pinned.nullity) == (Stability.NEUTRAL_FAMILY, 0, 1)
    assert pinned.eigenvalues(1)[0] == 0.0
    clamped = elastica.solve("UD-", P=10.0, H=0.02)
    assert (clamped.stability, clamped.index, clamped.nullity) == (Stability.UNSTABLE_THIRD_ORDER, 0, 3)
    assert clamped.eigenvalues(3).tolist() == [0.0, 0.0, 0.0]
    buckled = elastica.solve("UD-", P=17.0, H=0.02)
    assert np.sqrt(17.0) * buckled.flat_length > 1
    assert (buckled.stability, buckled.index) == (Stability.UNSTABLE, 1)


@pytest.mark.parametrize(
    "ends",
    [pytest.param(ends, marks=pytest.mark.at_least(40, full=50 if "/" in ends else 500)) for ends in ENDS],
)
def test_random_words(compared, ends, full, rng):
    """Index against a spectral count, shape against walls and lengths, for every word of 2 to 4 contacts."""
    # Segments at springs are integrated, which costs ten times as much.
    n = (50 if "/" in ends else 500) if full else 40
    for state in elastica.states(ends, 4 if full else 3):
        if state.count("U") + state.count("D") < 2:
            continue
        P, H = rng.uniform(0.5, 40 if full else 16, n), rng.uniform(0.005, 0.12, n)
        s = elastica.solve(state, P=P, H=H, ends=ends)
        sure = (s.status == Status.SOLVED) & (s.stability != Stability.CRITICAL)
        if not sure.any():
            continue
        compared(sure)
        flat_buckled = np.sqrt(P[sure]) * s.flat_length[sure] > 1
        negative = (s.eigenvalues(10)[sure] < 0).sum(axis=1)
        assert np.array_equal(negative + flat_buckled, s.index[sure]), state
        shape = s.shape(401)
        assert (np.abs(shape.y[sure]).max(axis=1, initial=0) <= H[sure] * (1 + 1e-11)).all()
        assert shape.y[sure, -1] == pytest.approx(0, abs=1e-12)
        assert shape.x[sure, -1] == pytest.approx(1 - s.shortening[sure], abs=1e-12)
        assert s.lengths[sure].sum(axis=1) + s.flat_length[sure] == pytest.approx(1, abs=1e-12)
        walls = np.where(np.array(list(state.strip("a-").replace("a", ""))) == "U", 1, -1)
        at_contacts = np.array(
            [np.interp(c, shape.s, y) for c, y in zip(s.contact_position[sure], shape.y[sure], strict=True)]
        )
        assert at_contacts == pytest.approx(walls * H[sure, None], rel=2e-2)


def test_twenty_contacts_are_one_solve():
    word = "UD" * 10
    P = np.linspace(350, 430, 30)
    s = elastica.solve(word, P=P, H=1e-3)
    solved = s.status == Status.SOLVED
    assert solved.any()
    assert (s.stability[solved] == Stability.STABLE).all()
    assert (s.eigenvalues(1)[solved, 0] > 0).all()
    assert s.error[solved].max() < 1e-10


def test_mirror_words_have_one_canonical_name():
    for letters in set(permutations("UUDD")) | set(permutations("UDDD")):
        word = "".join(letters)
        flipped = word.translate(str.maketrans("UD", "DU"))
        names = {
            elastica.solve(w, P=1.0, H=0.1).state.name for w in (word, flipped, word[::-1], flipped[::-1])
        }
        assert len(names) == 1
        assert names.pop().startswith("U")


@pytest.mark.parametrize(
    ("ends", "minima"),
    [(CC, {"UD": 344.8761334891, "UDU": 346.4956411150}), (PP, {"UDU": 340.0304038891})],
)
def test_the_minima_of_clnlbeam_are_found_without_being_named(ends, minima):
    """Objective 2V + α of the optimisation benchmark with α = 350, H = 0.05: thrust p = α/2."""
    alpha = 350.0
    found = elastica.find_states(P=alpha / 2 / FOUR_PI_SQUARED, H=0.05, ends=ends, max_contacts=3)
    stable = found.stability == Stability.STABLE
    objective = 2 * found.energy[stable] * FOUR_PI_SQUARED + alpha
    assert dict(zip(found.state[stable], objective, strict=True)) == pytest.approx(minima, abs=1e-9)
