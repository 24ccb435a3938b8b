import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# Python loads them in processes that are to crash or to be watched, and only there.
collect_ignore = ["poison", "witness"]
# There are no doctests in them, and modules of one name cannot be collected together.
collect_ignore_glob = ["*conftest.py"]

# A law counts over all its examples what it compared, in one fixture.
COUNTED = {"deadline": None, "suppress_health_check": [HealthCheck.function_scoped_fixture]}
settings.register_profile("default", max_examples=40, derandomize=True, **COUNTED)
settings.register_profile("full", max_examples=1000, **COUNTED)
settings.load_profile("default")


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="full counts of random audits and references")


def pytest_configure(config):
    if config.getoption("--full"):
        settings.load_profile("full")


def pytest_collection_modifyitems(items):
    """Let the long files begin, in random order like the others, so that none is left alone at the end."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


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
