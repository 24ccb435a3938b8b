"""The studies and the chart that ship with the project are what they promise."""

import numpy as np
import pytest
from end_to_end.catalogs.command import CATALOGS, SHIPPED, catalog
from end_to_end.processes import elastica

import studies
from studies import Study
from studies.archive.catalog import Catalog


def test_the_archived_chart_is_good_small_and_that_of_its_study():
    result = catalog("verify", "--sample", 40, folder=CATALOGS)
    assert (result.exit_code, result.stdout) == (0, "clamped-and-pinned.nc: good\n"), result.stderr
    assert SHIPPED.stat().st_size < 500_000
    entry = Catalog.read(CATALOGS).entries[SHIPPED.name]
    # Once the numerics change, it has to be computed and added anew: then its sample is solved again.
    study = Study.from_toml(CATALOGS / "clamped-and-pinned.toml")
    assert (study.study_id, study.numerics_id) == (entry.study_id, entry.numerics_id)


STUDIES = sorted(path.stem for path in CATALOGS.glob("*.toml"))


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_plans_what_its_first_lines_promise(name):
    path = CATALOGS / f"{name}.toml"
    head = " ".join(line.lstrip("# ") for line in path.read_text().partition("[study]")[0].splitlines())
    study = Study.from_toml(path)
    assert study.name == name
    assert f"{study.plan().points:,} grid points, about " in head
    assert " on " in head
    assert head.rstrip().endswith("MB.")


def published_minima(dataset):
    alpha = 8 * np.pi**2 * dataset["P"]
    objective = (alpha + 8 * np.pi**2 * dataset["energy"]).where(dataset["stability"] == 0).isel(P=-1, H=0)
    for ends, minima in (
        ("clamped-clamped", [344.8761334891, 346.4956411150]),
        ("pinned-pinned", [340.0304038891]),
    ):
        found = np.sort(objective.sel(ends=ends).values)[: len(minima)]
        assert found == pytest.approx(minima, abs=2e-9)


def verdicts_turn_at_the_transitions(dataset):
    stable = (dataset["stability"] == 0).isel(ends=0, H=0)
    for name, first, last in (("B1", 0, 4), ("U", 5, 12)):
        assert np.flatnonzero(stable.sel(state=name))[[0, -1]].tolist() == [first, last]


PROMISES = {"clnlbeam": published_minima, "near-transitions": verdicts_turn_at_the_transitions}


def test_the_studies_run_and_are_good(tmp_path, full):
    for name in STUDIES if full else PROMISES:
        run = elastica("run", CATALOGS / f"{name}.toml", "--workers", 0, cwd=tmp_path)
        assert run.returncode == 0, run.stderr
        report, problems = studies.check(tmp_path / f"{name}.nc", sample=10)
        assert problems == [], report
        if name in PROMISES:
            with studies.open(tmp_path / f"{name}.nc") as dataset:
                PROMISES[name](dataset)
