"""Where the outputs go, and a guard against computing."""

import pytest


@pytest.fixture
def out(tmp_path):
    return tmp_path / "tiny.nc"


@pytest.fixture
def nothing_is_computed(monkeypatch):
    def never(*_):
        raise AssertionError("a block is computed")

    return lambda: monkeypatch.setattr("studies.running.session.compute_block", never)
