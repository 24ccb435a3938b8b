"""Datasets that excuse themselves: sealed anew by whoever changed them, and found out by solving again."""

import numpy as np
import pytest
from click.testing import CliRunner
from end_to_end.test_hostile_files import edited

import studies
from elastica.codes import Stability, Status
from studies import Study
from studies.command_line import main
from studies.store.layout import write_failures


def without_verdicts(dataset):
    for name in ("stability", "index", "nullity"):
        dataset[name][:] = -1
    dataset["stable_count"][:] = 0
    dataset["preferred_state"][:] = -1


def without_verdict_at_one_state(dataset, status):
    place = tuple(np.argwhere(dataset["stability"][:] == Stability.UNSTABLE)[0])
    dataset["status"][place] = status
    for name in ("stability", "index", "nullity"):
        dataset[name][place] = -1


def with_errors(dataset, error):
    dataset["error"][:] = np.where(np.isnan(dataset["error"][:]), np.nan, error)


def critical(dataset):
    values = dataset["stability"][:]
    values[values >= 0] = Stability.CRITICAL
    dataset["stability"][:] = values
    dataset["stable_count"][:] = 0
    dataset["preferred_state"][:] = -1


def large_errors(dataset):
    dataset["energy"][:] = dataset["energy"][:] * 1.5
    with_errors(dataset, 1e6)


def errors_just_in_range(dataset):
    dataset["energy"][:] = dataset["energy"][:] * 1.001
    with_errors(dataset, 1e-4)


def failed(dataset):
    dataset["status"][:] = Status.FAILED
    without_verdicts(dataset)


def one_failed(dataset):
    without_verdict_at_one_state(dataset, Status.FAILED)


def one_state_not_computed(dataset):
    without_verdict_at_one_state(dataset, Status.NOT_COMPUTED)


def one_state_not_computed_as_if_merged(dataset):
    dataset.merged_from = "others"
    one_state_not_computed(dataset)


def not_computed(dataset):
    dataset["status"][:] = Status.NOT_COMPUTED
    without_verdicts(dataset)
    dataset["stable_count"][:] = -1


def row_not_computed(dataset):
    for name in ("status", "stability", "index", "nullity", "stable_count", "preferred_state"):
        dataset[name][0, 1] = -1


def not_followed(dataset):
    status = dataset["status"][:]
    dataset["status"][:] = np.where(status >= 0, Status.NOT_FOLLOWED, status)
    without_verdicts(dataset)


def older(dataset):
    dataset.numerics_version, dataset.numerics_id = 1, "of then"
    dataset["energy"][:] = dataset["energy"][:] * 1.5


def newer(dataset):
    dataset.numerics_version = 99


def before_the_first(dataset):
    dataset.numerics_version = -5


def other_search(dataset):
    dataset.states_searched = "0 U"


FORGED = {
    critical: "stability cannot be found again",
    large_errors: "error is out of range",
    errors_just_in_range: "energy cannot be found again",
    failed: "not those of the table of failures",
    one_failed: "not those of the table of failures",
    one_state_not_computed: "1 states are not computed at points that are",
    one_state_not_computed_as_if_merged: "1 states are not computed at points that are",
    not_computed: "120 points are not computed, and the file does not say so",
    row_not_computed: "12 points are not computed, and the file does not say so",
    not_followed: "status cannot be found again",
    older: "energy cannot be found again",
    newer: "numerics_version is 99; this release knows 1 to",
    before_the_first: "numerics_version is -5; this release knows 1 to",
    other_search: "states_searched does not belong to the study",
}


@pytest.mark.parametrize("forge", FORGED)
def test_a_file_cannot_excuse_itself(dataset_file, tmp_path, forge):
    path = edited(dataset_file, tmp_path / "forged.nc", forge)
    checked = CliRunner().invoke(main, ["check", str(path), "--sample", "60"])
    assert checked.exit_code == 2
    assert FORGED[forge] in checked.stderr
    assert "good" not in checked.stdout


def test_failures_that_are_in_the_table_prove_nothing(dataset_file, tmp_path):
    def all_failed(dataset):
        failed(dataset)
        places = np.argwhere(dataset["status"][:] == Status.FAILED)
        write_failures(dataset, "P", [(*place, "too hard") for place in places.tolist()])

    path = edited(dataset_file, tmp_path / "forged.nc", all_failed)
    report, problems = studies.check(path, sample=5)
    assert problems == ["no value could be compared with one that was solved again: nothing is proved"]
    assert any("not compared:" in line and "failed in the file" in line for line in report)


def test_good_is_said_only_if_something_was_solved_again(dataset_file):
    report, problems = studies.check(dataset_file, sample=0)
    assert (problems, report[-1]) == ([], "  whole, but nothing was solved again")
    report, problems = studies.check(dataset_file, sample=5)
    assert (problems, report[-1]) == ([], "  good")


def test_the_error_of_a_chain_excuses_nothing(computed, tmp_path):
    """It is that of its links, which are the same when it is solved again."""
    content = {
        "study": {"name": "chain"},
        "grid": {"ends": ["clamped-clamped"], "H": [0.1], "P": [2.0, 2.5]},
        "states": {"names": ["U"]},
        "solve": {"method": "chain", "links": 20, "clamp": "consistent"},
    }
    whole = computed(Study.from_dict(content))
    report, problems = studies.check(whole)
    assert (problems, report[-1]) == ([], "  good")

    def stiffer(dataset):
        assert dataset["error"][:].max() > 1e-4
        dataset["energy"][:] = dataset["energy"][:] * 1.001

    path = edited(whole, tmp_path / "forged.nc", stiffer)
    assert any("energy cannot be found again" in problem for problem in studies.check(path)[1])


def test_which_points_are_solved_again_cannot_be_known_before(dataset_file):
    seeds = set()
    for _ in range(3):
        report, problems = studies.check(dataset_file, sample=1)
        assert problems == []
        seeds |= {line for line in report if line.startswith("  seed ")}
    assert len(seeds) == 3
    assert "  seed        7" in studies.check(dataset_file, sample=1, seed=7)[0]
