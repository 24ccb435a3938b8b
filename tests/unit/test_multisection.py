import numpy as np

from studies.plot.multisection import narrow


def test_narrows_each_interval_to_where_its_own_condition_ends():
    limits = np.array([0.3, 1.0, 7.7])
    within, beyond = narrow(
        lambda x, which: x < limits[which], np.zeros(3), np.array([1.0, 1.5, 8.0]), times=5
    )
    assert (within < limits).all() and (limits <= beyond).all()
    np.testing.assert_allclose(beyond - within, np.array([1.0, 1.5, 8.0]) / 16**5, rtol=1e-9)


def test_finds_the_first_of_several_ends():
    within, beyond = narrow(lambda x, _: (x < 0.2) | ((x > 0.5) & (x < 0.8)), np.zeros(1), np.ones(1), 3)
    assert within < 0.2 <= beyond


def test_backwards_and_in_the_plane():
    within, beyond = narrow(
        lambda at, _: np.hypot(*at) > 1, np.array([[2.0], [2.0]]), np.zeros((2, 1)), times=6
    )
    assert np.hypot(*within) > 1 >= np.hypot(*beyond)
    np.testing.assert_allclose(within, np.sqrt(0.5), rtol=1e-6)


def test_no_interval_asks_nothing():
    within, _ = narrow(None, np.zeros(0), np.zeros(0), times=3)
    assert within.size == 0
