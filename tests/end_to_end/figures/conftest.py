"""The small dataset of figures, computed once, and its chart."""

import pytest
from end_to_end.figures.panels import SMALL

import elastica
import studies
from studies import Study


@pytest.fixture(scope="session")
def file(computed):
    return computed(Study.from_dict(SMALL))


@pytest.fixture(scope="session")
def dataset(file):
    with studies.open(file) as opened:
        yield opened.load()


@pytest.fixture(scope="session")
def chart(dataset):
    return studies.plot.chart(dataset)


@pytest.fixture
def coarse(monkeypatch):
    """Pictures of few points: what they show does not depend on it."""
    monkeypatch.setattr("studies.plot.regions.FINE", (9, 29))
    monkeypatch.setattr("studies.plot.regions.TRACED", (9, 29))


@pytest.fixture
def ruler():
    return elastica.Strip(length=0.3, width=0.025, thickness=0.001, E=200e9)
