"""Runs in which something is killed: the same command finishes, with nothing computed in vain."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import psutil
from end_to_end.processes import witnessed

from studies.store.datasets import identify

AGAIN = 4
"""Blocks that two workers may have begun, or finished without anyone's knowing."""
PATIENCE = 600


class Whole(NamedTuple):
    """A study of many blocks of so many points, and the content of its dataset, computed without a kill."""

    toml: Path
    blocks: int
    points: int
    content: str


class Trial:
    """One run that is disturbed at a random moment."""

    def __init__(self, whole, folder, rng):
        self.whole, self.rng = whole, rng
        self.out, self.witness = folder / "out" / "small.nc", folder / "witness"
        self.out.parent.mkdir()
        self.environment = witnessed(self.witness)

    def begin(self, where):
        """Begin to compute, by so many workers or where a scheduler is."""
        program = Path(__file__).with_name("run_blocks.py")
        command = [sys.executable, program, self.whole.toml, self.out, self.whole.points, where]
        environment = os.environ | self.environment
        return subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True, env=environment)

    def wait(self, run, least):
        """Wait for a random part of the blocks to be done; less than none is that part of ten seconds."""
        progress, shards = self.rng.uniform(least, 1), self.out.with_name("small.nc.shards")
        if progress < 0:
            time.sleep(-10 * progress)
        while run.poll() is None and len(list(shards.glob("0*.nc"))) < progress * self.whole.blocks:
            time.sleep(0.01)

    def kill(self, run, victims):
        """Kill one of some processes, unless the run has finished."""
        if run.poll() is None and victims:
            os.kill(victims[self.rng.integers(len(victims))].pid, signal.SIGKILL)

    def check(self, run):
        """Let a run end and, where it did not finish, another go on: what the first one said."""
        _, said = run.communicate(timeout=PATIENCE)
        if run.returncode != 0:
            assert "Traceback" not in said
            # Who goes on does not matter; one worker starts soonest.
            again = self.begin(1)
            _, errors = again.communicate(timeout=PATIENCE)
            assert again.returncode == 0, errors
        assert identify(self.out)["content_hash"] == self.whole.content
        assert [path.name for path in self.out.parent.iterdir()] == ["small.nc"]
        assert self._begun_again() <= AGAIN
        return said

    def _begun_again(self):
        """How often blocks were begun that the witness did not see done."""
        told = Counter(self.witness.read_text().splitlines())
        done = sum(line.startswith("done") for line in told)
        return sum(count for line, count in told.items() if line.startswith("begun")) - done


def workers_of(run):
    """Processes of a run that solve."""
    found = []
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(run.pid).children(recursive=True):
            with suppress(psutil.Error):
                if "studies.sandbox" in " ".join(child.cmdline()):
                    found.append(child)
    return found
