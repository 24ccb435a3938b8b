import pytest

from studies import Study

CONTENT = {
    "study": {"name": "small", "title": "A small study", "license": "CC-BY-4.0"},
    "grid": {
        "ends": ["clamped-clamped", "clamped-pinned"],
        "H": {"start": 0.04, "stop": 0.2, "num": 5},
        "P": {"start": 0.2, "stop": 9.0, "num": 12},
    },
    "states": {"max_contacts": 1},
    "outputs": {"eigenvalues": 3, "shapes": 11},
}

TOML = """
[study]
name = "small"
title = "A small study"
license = "CC-BY-4.0"
[grid]
ends = ["clamped-clamped", "clamped-pinned"]
H = { start = 0.04, stop = 0.2, num = 5 }
P = { start = 0.2, stop = 9.0, num = 12 }
[states]
max_contacts = 1
[outputs]
eigenvalues = 3
shapes = 11
"""


@pytest.fixture(scope="session")
def study():
    return Study.from_dict(CONTENT)


@pytest.fixture(scope="session")
def computed(tmp_path_factory):
    """Computes a study in this process and gives its file."""
    import studies

    def compute(study):
        path = tmp_path_factory.mktemp("dataset") / f"{study.name}.nc"
        studies.run(study, out=path, workers=0).close()
        return path

    return compute


@pytest.fixture(scope="session")
def dataset_file(study, computed):
    """The small study, computed once."""
    return computed(study)


@pytest.fixture
def toml(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TOML)
    return path
