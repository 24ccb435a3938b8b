"""Exact states against chains of links that IPOPT minimises between the walls."""

import numpy as np
import pytest
from brute_force.chain import heights, minimise, shortening
from brute_force.clnlbeam import minima_agree
from brute_force.landscape import (
    UNSTABLE,
    angles,
    disturbed_at_shortening,
    landscape,
    returns,
    verdict_agrees,
)

import elastica

pytestmark = pytest.mark.long

CC, PP = "clamped-clamped", "pinned-pinned"


@pytest.mark.parametrize(
    ("ends", "euler"),
    [(CC, 1.0), (PP, 0.25), ((1.0, 1.0), 0.90654924995), ((0.3, 0.3), 0.74527395279)],
)
def test_a_chain_buckles_at_the_euler_load(ends, euler):
    bump = 1e-2 * np.cos(np.pi * (np.arange(400) + 0.5) / 400)
    below, above = (minimise(bump, load * euler, 0.4, ends) for load in (0.999, 1.001))
    assert np.abs(below.y).max() < 1e-4 < 1e-2 < np.abs(above.y).max()


def test_a_chain_converges_to_the_exact_energy():
    s = elastica.solve("U-", P=2.0, H=0.1, ends=PP)
    errors = [minimise(angles(s, n), 2.0, 0.1, PP).energy - s.energy for n in (100, 200, 400)]
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx(4, rel=0.02)


def test_an_asymmetric_state_is_a_minimum_at_prescribed_shortening_only():
    s = elastica.solve("Ua", P=3.0, H=0.05)
    n, rng = 400, np.random.default_rng(1)
    theta = angles(s, n)
    held = minimise(theta + 0.01 * theta * rng.normal(), None, 0.05, CC, shorter=float(s.shortening))
    free = minimise(theta + 0.01 * theta * rng.normal(), 3.0, 0.05, CC)
    assert held.success and shortening(held.theta) == pytest.approx(float(s.shortening), abs=1e-9)
    assert held.y == pytest.approx(heights(theta), abs=2e-3)
    assert held.energy == pytest.approx(float(s.bending_energy), rel=1e-3)
    assert free.success and free.energy < float(s.energy) - 3e-4


@pytest.mark.parametrize("stable", [True, False])
def test_verdicts_agree_with_the_landscape_around_random_states(stable, rng, full):
    for _ in range(100 if full else 3):
        agrees, description = verdict_agrees(rng, stable)
        assert agrees, description


def test_a_family_of_lines_is_judged_with_its_flat_length_in_one_piece(rng):
    s = elastica.solve("UD-", P=10.06, H=0.0558, ends=PP)
    assert s.stability in UNSTABLE and landscape(s, rng).verdict == -1


def test_stable_states_come_back_after_a_disturbance(rng, full):
    for _ in range(100 if full else 3):
        back, description = returns(rng)
        assert back, description


@pytest.mark.parametrize("stable", [True, False])
def test_verdicts_at_prescribed_shortening_agree_with_where_chains_go(stable, rng, full):
    for _ in range(60 if full else 1 + stable):
        agrees, description = disturbed_at_shortening(rng, stable)
        assert agrees, description


@pytest.mark.parametrize("ends", [CC, PP])
def test_no_minimum_of_clnlbeam_lies_below_the_exact_one(ends, rng, full):
    for alpha in (50, 85, 120, 175, 250, 350, 450, 600) if full else (350,):
        agrees, description = minima_agree(alpha, ends, rng, starts=40 if full else 10)
        assert agrees, description
