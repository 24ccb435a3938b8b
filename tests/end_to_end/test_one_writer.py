"""Two runs of one study at a time: the second is refused; after a kill the same command takes over."""

import json
import os
import signal
import time

import pytest
from end_to_end.conftest import TOML
from end_to_end.processes import elastica, poisoned, start

from studies import StudyError
from studies.running.lock import sole_writer
from studies.store.datasets import identify


@pytest.fixture
def long_run(tmp_path):
    """A run that has begun and does not end, and its study."""
    toml = tmp_path / "small.toml"
    toml.write_text(TOML)
    # It never comes to the end of the point that hangs.
    process = start(
        "run", toml, "--workers", 0, cwd=tmp_path, **poisoned("hang", "clamped-clamped", 0.2, 9.0)
    )
    lock = tmp_path / "small.nc.shards" / "run.lock"
    while not (lock.exists() and lock.read_text()):
        assert process.poll() is None
        time.sleep(0.05)
    yield process, toml
    process.kill()
    process.communicate()


def test_the_second_run_is_refused_with_host_process_and_start(long_run, tmp_path):
    process, toml = long_run
    second = elastica("run", toml, cwd=tmp_path)
    assert second.returncode == 2
    assert f"process {process.pid} on {os.uname().nodename}, started 20" in second.stderr
    assert second.stderr.count("\n") == 1
    assert elastica("run", toml, "--force-unlock", cwd=tmp_path).returncode == 2
    assert elastica("run", toml, "--shard", "1/2", cwd=tmp_path).returncode == 2
    assert elastica("reduce", toml, cwd=tmp_path).returncode == 2
    assert process.poll() is None


def test_after_a_kill_the_lock_is_free_and_its_taking_over_is_told(long_run, tmp_path, capsys):
    process, _ = long_run
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    folder = tmp_path / "small.nc.shards"
    with sole_writer(folder):
        assert f"took over from process {process.pid}" in capsys.readouterr().err
        assert json.loads((folder / "run.lock").read_text())["pid"] == os.getpid()
    assert not (folder / "run.lock").exists()


def record(**changed):
    return {"host": "far-away", "boot": "b", "pid": 7, "started": 1.7e9} | changed


def test_the_record_of_another_host_is_believed_until_the_user_knows_better(tmp_path, capsys):
    (tmp_path / "run.lock").write_text(json.dumps(record()))
    refusal = r"process 7 on far-away, started 2023-11-14 .* --force-unlock"
    with pytest.raises(StudyError, match=refusal), sole_writer(tmp_path):
        pass
    with sole_writer(tmp_path, force=True):
        assert "far-away" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "dead",
    [
        record(host=os.uname().nodename, pid=2**22 + 1),
        record(host=os.uname().nodename, pid=os.getpid()),  # The number went to another process.
        record(host=os.uname().nodename, boot="before the power failed", pid=os.getpid()),
    ],
)
def test_a_record_of_a_process_that_is_gone_does_not_block(tmp_path, dead):
    (tmp_path / "run.lock").write_text(json.dumps(dead))
    with sole_writer(tmp_path):
        pass


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "7", '{"host": 1}'])
def test_a_record_that_was_cut_short_does_not_block(tmp_path, text):
    (tmp_path / "run.lock").write_text(text)
    with sole_writer(tmp_path):
        pass


def test_parts_of_one_division_work_side_by_side(tmp_path):
    with sole_writer(tmp_path, (1, 3)), sole_writer(tmp_path, (2, 3)):
        for part in (None, (1, 3), (1, 2)):
            with pytest.raises(StudyError, match="computes this study"), sole_writer(tmp_path, part):
                pass
    assert list(tmp_path.iterdir()) == []


def test_two_runs_begun_together_give_one_dataset(toml, tmp_path, dataset_file):
    runs = [start("run", toml, cwd=tmp_path) for _ in range(3)]
    messages = [run.communicate(timeout=120)[1] for run in runs]
    codes = sorted(run.returncode for run in runs)
    assert codes[0] == 0, messages
    assert set(codes) <= {0, 2}
    assert not any("Traceback" in message for message in messages), messages
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["small.nc", "small.toml"]
