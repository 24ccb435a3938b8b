"""Whatever is killed, the same command finishes, with the same dataset and nothing computed in vain."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from end_to_end.conftest import TOML
from end_to_end.processes import ByHand, witnessed

import studies
from studies.store.datasets import identify

BLOCKS = 200
TEXT = (
    TOML.replace("num = 5", "num = 10")
    .replace("num = 12", "num = 10")
    .replace("max_contacts = 1", 'names = ["0", "U"]')
    .replace("eigenvalues = 3\nshapes = 11", "eigenvalues = 0")
)
VICTIMS = ("client", "worker", "scheduler")
AGAIN = 4
"""Blocks that two workers may have begun, or finished without anyone's knowing."""
PATIENCE = 600


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


def begin(toml, out, where, **environment):
    """Begin to compute a study block by block on so many workers, or where a scheduler is."""
    command = [sys.executable, str(Path(__file__).with_name("run_blocks.py")), str(toml), str(out), where]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ | environment)


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


def wait(process, shards, progress):
    """Wait until some part of the blocks is done; before the first, for that part of a second or so."""
    if progress < 0:
        time.sleep(-10 * progress)
    while process.poll() is None and len(list(shards.glob("0*.nc"))) < progress * BLOCKS:
        time.sleep(0.01)


def begun_again(witness):
    """Blocks that were begun more often than once; those that the witness did not see done count too."""
    told = Counter(witness.read_text().splitlines())
    done = [line for line in told if line.startswith("done")]
    begun = sum(count for line, count in told.items() if line.startswith("begun"))
    return begun - len(done), sum(told[line] - 1 for line in done)


def test_kills_at_random_moments(many_blocks, tmp_path, rng, full):
    toml, _, content = many_blocks
    begun, finished, kills = {victim: [] for victim in VICTIMS}, [], 0
    for trial in range(100 if full else 5):
        victim, folder, tools = VICTIMS[trial % 3], tmp_path / f"{trial}", tmp_path / f"tools-{trial}"
        folder.mkdir()
        tools.mkdir()
        out, environment = folder / "small.nc", witnessed(tools / "witness")
        with ExitStack() as stack:
            where, killed = "2", None
            if victim == "scheduler":
                by_hand = stack.enter_context(ByHand(tools, **environment))
                by_hand.worker(), by_hand.worker()
                where, killed, environment = by_hand.address, by_hand.scheduler, by_hand.environment
            process = begin(toml, out, where, **environment)
            least = -0.1 if victim == "client" else 1 / BLOCKS
            wait(process, folder / "small.nc.shards", rng.uniform(least, 1))
            if process.poll() is None:
                victims = workers_of(process) if victim == "worker" else [killed or process]
                os.kill(victims[rng.integers(len(victims))].pid, signal.SIGKILL)
                kills += 1
            _, errors = process.communicate(timeout=PATIENCE)
        assert victim != "worker" or process.returncode == 0, errors
        if process.returncode != 0:
            assert "Traceback" not in errors
            if victim == "scheduler":
                assert "the scheduler was lost" in errors.splitlines()[-1]
            # Who goes on does not matter; one worker starts soonest.
            process = begin(toml, out, "1", **environment)
            _, errors = process.communicate(timeout=PATIENCE)
            assert process.returncode == 0, errors
        assert identify(out)["content_hash"] == content
        assert [path.name for path in folder.iterdir()] == ["small.nc"]
        again, twice = begun_again(tools / "witness")
        assert again <= AGAIN
        begun[victim].append(again)
        finished.append(twice)
    report = {victim: f"total {sum(some)}, most {max(some)}" for victim, some in begun.items()}
    report |= {"finished twice": f"total {sum(finished)}, most {max(finished)}", "kills": kills}
    print(f"blocks of {BLOCKS} begun again: {report}")
