import numpy as np
import pytest
from end_to_end.conftest import TOML
from end_to_end.kills.trials import Trial, Whole

import studies
from studies.store.datasets import identify

TEXT = (
    TOML.replace("num = 5", "num = 10")
    .replace("num = 12", "num = 10")
    .replace("max_contacts = 1", 'names = ["0", "U"]')
    .replace("eigenvalues = 3\nshapes = 11", "eigenvalues = 0")
)
POINTS = 200


def pytest_generate_tests(metafunc):
    """Each trial is a test: together 100, or six."""
    if "number" in metafunc.fixturenames:
        metafunc.parametrize("number", range(34 if metafunc.config.getoption("--full") else 2))


@pytest.fixture(scope="session")
def whole(tmp_path_factory, request):
    """A study in 200 blocks, or 40."""
    folder, points = tmp_path_factory.mktemp("whole"), 1 if request.config.getoption("--full") else 5
    toml = folder / "small.toml"
    toml.write_text(TEXT)
    study, blocks = studies.Study.from_toml(toml), POINTS // points
    assert len(study.plan(block_points=points).blocks) == blocks
    studies.run(study, folder / "small.nc", workers=0).close()
    return Whole(toml, blocks, points, identify(folder / "small.nc")["content_hash"])


@pytest.fixture
def rng(number):
    return np.random.default_rng([20261122, number])


@pytest.fixture
def trial(whole, tmp_path, rng):
    return Trial(whole, tmp_path, rng)
