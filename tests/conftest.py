import mpmath
import numpy as np
import pytest
from hypothesis import settings

# Python loads them in processes that are to crash or to be watched, and only there.
collect_ignore = ["poison", "witness"]

settings.register_profile("default", deadline=None, max_examples=40, derandomize=True)
settings.register_profile("full", deadline=None, max_examples=1000)
settings.load_profile("default")


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="full counts of random audits and references")


def pytest_configure(config):
    if config.getoption("--full"):
        settings.load_profile("full")


@pytest.fixture(autouse=True)
def precision_is_put_back():
    """A test that changes mpmath's precision for all would change the references of those after it."""
    before = mpmath.mp.dps
    yield
    assert mpmath.mp.dps == before


@pytest.fixture
def full(request):
    """Whether the full counts were asked for."""
    return request.config.getoption("--full")


@pytest.fixture
def rng():
    return np.random.default_rng(20261122)
