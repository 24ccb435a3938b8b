import mpmath
import numpy as np
import pytest

from elastica.pendulum.elliptic import integrals

NEAR_ZERO = 10.0 ** np.arange(-16, 0.0)
PARAMETERS = np.concatenate(
    [1 - NEAR_ZERO, [0.5, 0.401, 0.4, 0.399, 0.2, 0.016, 0.015, 0.0149], 10.0 ** -np.arange(2.0, 17)]
)
AMPLITUDES = np.concatenate([[0, 1e-9, 0.3, -0.7, 1.2], np.pi / 2 - 10.0 ** -np.arange(1.0, 13)])


@pytest.mark.parametrize("m1", PARAMETERS)
def test_agree_with_fifty_digits(m1):
    sin, cos = np.sin(AMPLITUDES), np.cos(AMPLITUDES)
    K, DK, F, DF = integrals(np.full(sin.shape, m1), sin, cos)
    with mpmath.workdps(50):
        m = 1 - mpmath.mpf(m1)
        k = mpmath.ellipk(m)
        assert abs(K[0] / k - 1) < 2e-15
        assert abs(DK[0] * m / (k - mpmath.ellipe(m)) - 1) < 2e-15
        for i in range(sin.size):
            phi = mpmath.atan2(mpmath.mpf(sin[i]), mpmath.mpf(cos[i]))
            f, e = mpmath.ellipf(phi, m), mpmath.ellipe(phi, m)
            assert abs(F[i] - f) <= 2e-15 * abs(f)
            assert abs(DF[i] - (f - e) / m) <= 2e-15 * abs(f)


def test_logarithm_next_to_m_one():
    m1 = 10.0 ** -np.arange(40.0, 308, 20)
    K, DK, *_ = integrals(m1, np.zeros_like(m1), np.ones_like(m1))
    assert K == pytest.approx(np.log(4) - 0.5 * np.log(m1), rel=1e-15)
    assert DK == pytest.approx(K - 1, rel=1e-15)


def test_circular_at_m_zero():
    phi = np.array([0.4, -1.1])
    K, DK, F, DF = integrals(np.ones(2), np.sin(phi), np.cos(phi))
    assert K == pytest.approx(np.pi / 2, abs=1e-15)
    assert DK == pytest.approx(np.pi / 4, abs=1e-15)
    assert F == pytest.approx(phi, abs=1e-15)
    assert DF == pytest.approx((phi - np.sin(phi) * np.cos(phi)) / 2, abs=1e-15)


def test_a_value_does_not_depend_on_its_neighbours(rng):
    m1, phi = rng.uniform(1e-9, 1, 501), rng.uniform(-np.pi / 2, np.pi / 2, 501)
    together = np.array(integrals(m1, np.sin(phi), np.cos(phi)))
    alone = [integrals(m1[i : i + 1], np.sin(phi[i : i + 1]), np.cos(phi[i : i + 1])) for i in range(501)]
    assert np.array_equal(together, np.array(alone)[:, :, 0].T)
