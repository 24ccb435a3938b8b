"""Whatever is killed, the same command finishes, with the same dataset and nothing computed in vain."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from end_to_end.conftest import TOML

import studies
from studies.files import identify
from studies.shards import find_shards

BLOCKS = 200
TEXT = (
    TOML.replace("num = 5", "num = 10")
    .replace("num = 12", "num = 10")
    .replace("max_contacts = 1", 'names = ["0", "U"]')
    .replace("eigenvalues = 3\nshapes = 11", "eigenvalues = 0")
)
IN_FLIGHT = 6
"""Blocks that two workers may have begun, or finished without the client's knowing."""


@pytest.fixture(scope="module")
def many_blocks(tmp_path_factory):
    """A study of 200 blocks and the content of its dataset, computed without a kill."""
    folder = tmp_path_factory.mktemp("whole")
    toml = folder / "small.toml"
    toml.write_text(TEXT)
    study = studies.Study.from_toml(toml)
    assert len(study.plan(block_points=1).blocks) == BLOCKS
    studies.run(study, folder / "small.nc", workers=0).close()
    return toml, study, identify(folder / "small.nc")["content_hash"]


def begin(toml, out):
    command = [sys.executable, str(Path(__file__).with_name("run_blocks.py")), str(toml), str(out), "2", "1"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def workers_of(process):
    """Processes of a run that solve, or watch over those that do."""
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        try:
            line = " ".join(child.cmdline())
        except psutil.Error:
            continue
        if "spawn_main" in line or "studies.sandbox" in line:
            found.append(child)
    return found


def test_kills_at_random_moments(many_blocks, tmp_path, rng, full, record_property):
    toml, study, content = many_blocks
    blocks = study.plan(block_points=1).blocks
    again = []
    for trial in range(100 if full else 5):
        folder = tmp_path / str(trial)
        folder.mkdir()
        out = folder / "small.nc"
        process = begin(toml, out)
        shards = folder / "small.nc.shards"
        while process.poll() is None and not list(shards.glob("0*.nc")):
            time.sleep(0.02)
        time.sleep(rng.uniform(0, 2.0))
        if trial % 2 == 0:
            process.send_signal(signal.SIGKILL)
        else:
            victims = workers_of(process) if process.poll() is None else []
            if victims:
                os.kill(victims[rng.integers(len(victims))].pid, signal.SIGKILL)
        printed, errors = process.communicate(timeout=120)
        if process.returncode == 0:
            computed = int(printed)
            assert computed == BLOCKS
        else:
            assert trial % 2 == 0, errors
            kept = len(find_shards(shards.resolve(), blocks, study.identity)) if shards.exists() else 0
            kept = BLOCKS if out.exists() else kept
            process = begin(toml, out)
            printed, errors = process.communicate(timeout=120)
            assert process.returncode == 0, errors
            # A worker may finish a block between the count and its own end.
            assert BLOCKS - kept - IN_FLIGHT <= int(printed) <= BLOCKS - kept
            again.append(int(printed))
        assert identify(out)["content_hash"] == content
        assert [path.name for path in folder.iterdir()] == ["small.nc"]
    record_property("blocks computed after each kill of the client", again)
    print(f"blocks of {BLOCKS} computed after each kill of the client: {again}")
