"""A catalog that holds one dataset, and another dataset."""

import shutil

import pytest
from end_to_end.catalogs.command import catalog

from studies import Study


@pytest.fixture
def archived(tmp_path, dataset_file):
    """A catalog with the small study, and its file."""
    folder = tmp_path / "archive"
    folder.mkdir()
    shutil.copy(dataset_file, tmp_path / "small.nc")
    assert catalog("add", tmp_path / "small.nc", folder=folder).exit_code == 0
    return folder


@pytest.fixture(scope="session")
def other_file(computed):
    """A dataset of other ends, loads and states."""
    content = {
        "study": {"name": "other"},
        "grid": {"ends": ["pinned-pinned"], "H": [0.1], "shortening": [0.03, 0.04]},
        "states": {"names": ["U"]},
    }
    return computed(Study.from_dict(content))
