"""What goes wrong at one point costs that point; who dies, hangs or is poisoned is named in the dataset."""

import subprocess

import pytest
from end_to_end.conftest import TOML
from end_to_end.processes import COMMAND, elastica, poisoned

import studies
from elastica import Status
from studies.store.datasets import identify

POINT = ("clamped-pinned", 0.12, 1.8)
REASONS = {
    "crash": "Lost: the process crashed (SIGSEGV)",
    "leave": "Lost: the process ended with status 7",
    "raise": "ArithmeticError: poison",
}


@pytest.mark.parametrize(
    ("death", "policy"),
    [
        ("crash", ()),
        ("crash", ("--workers", 2)),
        ("leave", ()),
        ("raise", ("--workers", 0)),
    ],
)
def test_a_deadly_point_costs_that_point(toml, tmp_path, dataset_file, death, policy):
    run = elastica("run", toml, *policy, cwd=tmp_path, **poisoned(death, *POINT))
    assert run.returncode == 3, run.stderr
    assert f"failed: clamped-pinned H=0.12 P=1.8 U: {REASONS[death]}" in run.stderr
    with studies.open(tmp_path / "small.nc") as found, studies.open(dataset_file) as whole:
        ends, H, P = POINT
        failed = found["status"] == Status.FAILED
        assert int(failed.sum()) == 1
        assert failed.sel(ends=ends, H=H, P=P, state="U")
        assert str(found["failure_reason"].values[0]) == REASONS[death]
        others = found["status"].where(~failed)
        # The word of the point is lost with all its roots; everything else is as without the poison.
        unknown = found["status"] == Status.NOT_COMPUTED
        same = others == whole["status"].sel(state=found["state"])
        assert bool((same | failed | unknown).all())
        assert int(unknown.sel(ends=ends).sum()) <= found.sizes["state"]


def test_a_point_that_never_returns_costs_that_point(tmp_path):
    text = TOML.replace("num = 12", "num = 3").replace("num = 5", "num = 2").replace("eigenvalues = 3", "")
    (tmp_path / "small.toml").write_text(text.replace("max_contacts = 1", 'names = ["0", "U", "U-"]'))
    poison = poisoned("hang", "clamped-pinned", 0.2, 4.6)
    run = elastica("run", "small.toml", "--time-limit", 2, cwd=tmp_path, **poison)
    assert run.returncode == 3, run.stderr
    with studies.open(tmp_path / "small.nc") as found:
        failed = found["status"] == Status.FAILED
        assert int(failed.sum()) == 1
        assert failed.sel(ends="clamped-pinned", H=0.2, P=4.6, state="U")
        assert str(found["failure_reason"].values[0]) == "Lost: no answer within 4 s"


def test_the_run_stops_at_the_first_failure_or_at_too_many_if_asked(toml, tmp_path, dataset_file):
    poison = poisoned("raise", *POINT)
    stopped = elastica("run", toml, "--on-error", "raise", cwd=tmp_path, **poison)
    assert stopped.returncode == 3
    assert "clamped-pinned H=0.12 P=1.8 U: ArithmeticError: poison" in stopped.stderr
    assert "Traceback" not in stopped.stderr
    stopped = elastica("run", toml, "--max-failures", 0, cwd=tmp_path, **poison)
    assert stopped.returncode == 3
    assert "more than --max-failures 0: clamped-pinned H=0.12 P=1.8 U" in stopped.stderr
    assert not (tmp_path / "small.nc").exists()


def test_a_point_that_was_not_recorded_is_solved_when_the_cause_is_gone(toml, tmp_path, dataset_file):
    stopped = elastica("run", toml, "--on-error", "raise", cwd=tmp_path, **poisoned("raise", *POINT))
    assert stopped.returncode == 3
    assert elastica("run", toml, cwd=tmp_path).returncode == 0
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]


@pytest.mark.parametrize(("workers", "contacts"), [(1, 1), (2, 4)])
def test_helpers_that_cannot_start_stop_the_run_with_one_sentence(workers, contacts, tmp_path):
    """It is no matter of the points, none of which is recorded as failed."""
    (tmp_path / "small.toml").write_text(TOML.replace("max_contacts = 1", f"max_contacts = {contacts}"))
    start = "import sys\nif any('sandbox' in word for word in sys.orig_argv): sys.exit('no tea')"
    (tmp_path / "sitecustomize.py").write_text(start)
    run = elastica("run", "small.toml", "--workers", workers, cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert run.returncode == 2
    assert run.stderr.startswith("Error: no helper process can take up its work (the process ended with")
    assert "no tea" in run.stderr
    assert run.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.glob("small*")) == ["small.toml"]


def test_a_run_is_content_with_few_open_files(tmp_path, dataset_file):
    (tmp_path / "small.toml").write_text(TOML)
    script = 'ulimit -n 30 && exec "$@"'
    command = ["sh", "-c", script, "sh", *COMMAND, "run", "small.toml", "--workers", "2"]
    assert subprocess.run(command, cwd=tmp_path, timeout=300).returncode == 0
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]
