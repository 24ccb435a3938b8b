from fractions import Fraction

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from elastica.pendulum.line import FOLD, line_fold, line_force, rough_line_length
from elastica.pendulum.segments import Kind

CLAMPED, PINNED, STIFF = Kind(0, 1), Kind(Fraction(1, 2), 1), Kind(0, 1, 1e9)
ALPHA = np.radians([0.1, 5.0, 30.0, 45.0, 47.0])
P = np.array([0.5, 2.0, 3.0, 40.0, 700.0])


@pytest.fixture(autouse=True)
def quiet():
    """What is beyond the fold is found to be no number."""
    with np.errstate(all="ignore"):
        yield


def period(alpha, P):
    """Length and rise of a full period at κ = 0."""
    m = np.sin(alpha / 2) ** 2
    length = 2 * ellipk(m) / np.pi * np.sqrt(np.cos(alpha) / P)
    return length, length * np.sin(alpha) * (2 * ellipe(m) / ellipk(m) - 1)


def test_force_and_length_are_those_of_the_closed_form():
    p, (length, rise) = 4 * np.pi**2 * P, period(ALPHA, P)
    for kind, share in ((CLAMPED, 1), (PINNED, 0.5)):
        np.testing.assert_allclose(line_force(kind, p, share * rise), p * np.tan(ALPHA), rtol=1e-11)
        np.testing.assert_allclose(rough_line_length(kind, p, share * rise), share * length, rtol=1e-3)


def test_there_is_none_beyond_the_fold():
    p, rise = 4 * np.pi**2 * P, FOLD / np.sqrt(P)
    assert np.isfinite(line_force(CLAMPED, p, rise * (1 - 1e-6))).all()
    assert np.isnan(line_force(CLAMPED, p, rise * (1 + 1e-6))).all()
    assert np.isnan(line_force(STIFF, p, rise * (1 + 1e-6))).all()
    assert np.isinf(rough_line_length(CLAMPED, p, 1.1 * rise)).all()


def test_folds_where_the_rise_is_greatest():
    rise = np.array([0.02, 0.1, 0.3])
    fold = 4 * np.pi**2 * (FOLD / rise) ** 2
    for kind, share in ((CLAMPED, 1), (PINNED, 0.5), (STIFF, 1)):
        np.testing.assert_allclose(line_fold(kind, share * rise, 1.0, 1e6), fold, rtol=1e-6)
    assert np.isinf(line_fold(CLAMPED, rise, 1.0, 100.0)).all()
    assert np.isinf(line_fold(Kind(-1, 1), 0 * rise, 1.0, 1e6)).all()


def test_a_segment_that_does_not_rise_is_flat():
    assert (line_force(Kind(-1, 1), 4 * np.pi**2 * P, np.zeros(P.size)) == 0).all()
