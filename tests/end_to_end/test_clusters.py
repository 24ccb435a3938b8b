"""The same run on a scheduler and workers that somebody else started, as separate processes."""

import json
import os
import subprocess
import sys
import time

import pytest
from end_to_end.processes import elastica

from studies.files import identify

DASK = [sys.executable, "-m", "dask"]
LOOPBACK = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]


@pytest.fixture
def scheduler(tmp_path):
    """Address of a scheduler with two workers, one of them without a nanny."""
    file = tmp_path / "scheduler.json"
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [
        subprocess.Popen(
            [
                *DASK,
                *["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file"],
                str(file),
            ],
            **silent,
        )
    ]
    deadline = time.monotonic() + 60
    while not file.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    for nanny in ("--nanny", "--no-nanny"):
        worker = [*DASK, "worker", "--scheduler-file", str(file), "--nthreads", "1", nanny, "--no-dashboard"]
        started.append(subprocess.Popen([*worker, "--local-directory", str(tmp_path / "dask")], **silent))
    yield json.loads(file.read_text())["address"]
    for process in started[::-1]:
        process.terminate()
        process.wait(timeout=30)


def test_a_scheduler_started_by_hand_gives_the_identical_dataset(scheduler, toml, tmp_path, dataset_file):
    out = tmp_path / "small.nc"
    run = elastica("run", toml, "--scheduler", scheduler, "-o", out)
    assert run.returncode == 0, run.stderr
    assert identify(out)["content_hash"] == identify(dataset_file)["content_hash"]
    assert not os.path.exists(f"{out}.shards")


def test_where_nobody_schedules_is_one_sentence(toml, tmp_path):
    run = elastica("run", toml, "--scheduler", "tcp://127.0.0.1:9", "-o", tmp_path / "small.nc")
    assert run.returncode == 2
    assert "no dask scheduler answers" in run.stderr
    assert "Traceback" not in run.stderr


def test_workers_that_do_not_see_the_folder_or_have_other_versions_are_refused(tmp_path):
    from studies import StudyError
    from studies.blocks import Job, prove, versions

    job = Job(None, {}, tmp_path, versions(), ".probe-1", 10, False)
    with pytest.raises(StudyError, match="does not see this folder"):
        prove(job)
    (tmp_path / ".probe-1").touch()
    prove(job)
    other = (("numerics", "0"), *versions()[1:])
    with pytest.raises(StudyError, match="other versions: numerics 0 here"):
        prove(job._replace(versions=other))
