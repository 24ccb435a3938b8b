"""The study that the README promises, computed and read as the README says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from references.onsets import loads

import elastica
import studies
from elastica import Stability, Status

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def first_chart(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first-chart")
    study = studies.Study.from_toml(ROOT / "catalogs" / "first-chart.toml")
    studies.run(study, out=folder / "first-chart.nc").close()
    return folder / "first-chart.nc"


def test_every_shipped_study_is_valid():
    catalog = sorted((ROOT / "catalogs").glob("*.toml"))
    assert catalog
    for path in catalog:
        assert studies.Study.from_toml(path).name == path.stem


@pytest.mark.parametrize("ends", ["clamped-clamped", "pinned-pinned"])
def test_the_chart_follows_the_exact_loads_everywhere(first_chart, ends):
    """Of the states up to one contact one is stable until a point becomes a line: the loads say which."""
    with studies.open(first_chart) as dataset:
        part = dataset.sel(ends=ends, state=["0", "B1", "U", "U-"]).load()
    assert (part["status"] != Status.FAILED).all()
    H, P = (part[axis].values for axis in "HP")
    edges = [loads(event, H, ends)[:, None] for event in ("buckles", "touches", "point_to_line")]
    names = part["state"].values
    stable = (part["stability"] == Stability.STABLE).values
    for state, low, high in (("0", 0, edges[0]), ("B1", *edges[:2]), ("U", *edges[1:])):
        inside = (P > low + 1e-9) & (P < high - 1e-9)
        assert (stable.sum(axis=-1) == 1)[inside].all()
        assert stable[..., list(names).index(state)][inside].all()
    line = part["stability"].sel(state="U-").values[P[None, :] > edges[2]]
    if ends == "clamped-clamped":
        assert not (line == Stability.STABLE).any()
    else:
        assert (line == Stability.STABLE).any()


def test_some_state_is_stable_at_every_point_of_the_chart(first_chart):
    """The window ends where more contacts are needed: pinned, UDU becomes a line just above the corner."""
    with studies.open(first_chart) as dataset:
        assert (dataset["stable_count"] > 0).all()
        H, P = (float(dataset[axis][-1]) for axis in "HP")
        figure = studies.plot.chart(dataset)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "none of the states searched" not in labels and "UDU" in labels
    table = elastica.transitions("UDU", H=[H], ends="pinned-pinned", P_max=10)
    ends = table.P[table.event == elastica.Event.POINT_TO_LINE]
    assert P < ends[0] < P + 0.1


def test_the_study_of_the_readme_is_valid(tmp_path):
    text = re.search(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1]
    (tmp_path / "mine.toml").write_text(text)
    assert studies.Study.from_toml(tmp_path / "mine.toml").plan().points == 1200


def test_the_example_of_the_readme_runs(first_chart):
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1]
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=first_chart.parent, env=os.environ, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert "\n[ True  True False]\n" in run.stdout, run.stdout
    unit = 4 * np.pi**2 * (200e9 * 0.025 * 0.001**3 / 12) / 0.3**2
    reaction = elastica.solve("U", P=500 / unit, H=(0.031 - 0.001) / 2 / 0.3).reaction
    printed = re.search(r"\[(\S+)\] newtons on the wall", run.stdout)[1]
    assert float(printed) == pytest.approx(float(unit * reaction[0]), rel=1e-8)
