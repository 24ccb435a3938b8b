"""Free buckling from the Euler load to loops narrower than one can see, with and without a force across."""

import mpmath
import numpy as np
import pytest

import elastica
from elastica import Event, Stability, Status

CC, PP, CP = "clamped-clamped", "pinned-pinned", "clamped-pinned"
SHORTENINGS = [1e-11, 1e-6, 0.01, 0.5, 0.99, 1.01, 1.38, 1.39, 1.5, 1.7, 1.9, 1.95, 1.99]
WIDE = 0.499
PERIODIC = [("B1", PP, 2), ("B2", PP, 4), ("B1", CC, 4), ("B3", CC, 8), ("B3", PP, 6)]


@mpmath.workdps(1200)
def exact(shortening, quarters):
    """P, κ and V of the shape without a force across that has this shortening, with 1200 digits."""
    target = mpmath.mpf(float(shortening))

    def excess(x):
        m = -mpmath.expm1(x)
        return 2 * (1 - mpmath.ellipe(m) / mpmath.ellipk(m)) - target

    wanted = target / (2 - target)
    x = mpmath.findroot(excess, (-2 * wanted * (1 + mpmath.mpf(10) ** -8), -2 * wanted), tol=1e-60)
    m = -mpmath.expm1(x)
    K, E = mpmath.ellipk(m), mpmath.ellipe(m)
    p = (quarters * K) ** 2
    bending = 2 * p * (m - (1 - E / K))
    square = 4 * mpmath.pi**2
    return float(p / square), float(2 * mpmath.sqrt(m * p)), float((bending - p * target) / square)


@pytest.mark.parametrize(("state", "ends", "quarters"), [PERIODIC[0], PERIODIC[3]])
def test_every_shortening_has_its_shape(state, ends, quarters):
    s = elastica.solve(state, shortening=SHORTENINGS, H=WIDE, ends=ends)
    assert (s.status == Status.SOLVED).all() and (s.error[2:] < 1e-11).all()
    for i, shortening in enumerate(SHORTENINGS):
        P, kappa, V = exact(shortening, quarters)
        assert s.P[i] == pytest.approx(P, rel=1e-12)
        assert s.curvature[i] == pytest.approx(kappa, rel=1e-12)
        assert s.energy[i] == pytest.approx(V, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("state", "ends", "quarters"), PERIODIC)
def test_its_index_is_that_of_the_spectrum_beyond_90_degrees_too(state, ends, quarters):
    """One more direction at either control once the ends have met; at both exactly there it is critical."""
    before = int(state[1:]) - 1
    fixed = elastica.solve(state, shortening=SHORTENINGS[2:10], H=WIDE, ends=ends)
    loaded = elastica.solve(state, P=fixed.P, H=WIDE, ends=ends)
    for s in (fixed, loaded):
        assert s.index.tolist() == [before] * 3 + [before + 1] * 5
        values = s.eigenvalues(before + 3)
        count = (values < 0).sum(axis=1)
        assert np.isfinite(values).all() and count.tolist() == s.index.tolist()
    assert np.max(np.abs(loaded.shortening / fixed.shortening - 1)) < 1e-12
    meet = elastica.solve(state, shortening=1, H=WIDE, ends=ends)
    at_load = elastica.solve(state, P=meet.P, H=WIDE, ends=ends)
    for s in (meet, at_load):
        assert (s.status, s.index, s.nullity) == (Status.SOLVED, before, 1)
        assert s.stability == (Stability.UNSTABLE if before else Stability.CRITICAL)


def test_walls_decide_which_of_them_are_there():
    """The bulge grows and then shrinks to a loop: between two shortenings it passes the wall."""
    shortening = np.linspace(0.02, 1.98, 99)
    for H in (0.1, 0.2, 0.3, 0.4, 0.45):
        s = elastica.solve("B1", shortening=shortening, H=H, ends=PP)
        height = s.curvature / (4 * np.pi**2 * s.P)
        assert s.clearance == pytest.approx(H - height, abs=1e-12)
        assert (s.status == np.where(height > H, Status.INADMISSIBLE, Status.SOLVED)).all()
        again = elastica.solve("B1", P=s.P, H=H, ends=PP)
        assert (again.status.tolist(), again.index.tolist()) == (s.status.tolist(), s.index.tolist())


@pytest.mark.parametrize("H", [0.2, 0.3])
def test_a_loop_that_fits_between_the_walls_again_is_an_event(H):
    events = elastica.transitions("B1", H, PP)
    again = np.flatnonzero((events.event == Event.WALL_TOUCHED) & (events.index_after >= 0))
    assert len(again) == 1 and events.index_after[again[0]] == 1
    P = events.P[again[0]] * (1 + np.array([-1e-9, 1e-9]))
    s = elastica.solve("B1", P=P, H=H, ends=PP)
    assert s.status.tolist() == [Status.INADMISSIBLE, Status.SOLVED]


@pytest.mark.parametrize("ends", [PP, CC, CP, "0.3/2"])
@pytest.mark.parametrize("control", ["P", "shortening"])
def test_between_narrow_walls_a_mode_begins_and_touches(ends, control):
    gaps = [1e-5, 1e-4, 2e-3, 0.02]
    for mode in (1, 2):
        events = elastica.transitions(f"B{mode}", gaps, ends, control)
        assert events.event.tolist() == [Event.BUCKLES, Event.WALL_TOUCHED] * len(gaps)
        assert events.index_after[::2].tolist() == events.index_before[1::2].tolist() == [mode - 1] * 4


def test_what_is_not_traced_is_not_followed():
    status = [
        elastica.solve(state, shortening=shortening, H=WIDE, ends=ends).status
        for state, ends in (("B2", CC), ("B1", CP), ("B1", "1/1"))
        for shortening in (0.01, 1.9)
    ]
    assert status == [Status.SOLVED, Status.NOT_FOLLOWED] * 3
    assert elastica.solve("B1", shortening=1.995, H=WIDE, ends=PP).status == Status.NOT_FOLLOWED
