"""Progress is told where that is possible, and never stops a run where it is not."""

import io
import os
import pty
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from end_to_end.conftest import TOML
from end_to_end.processes import COMMAND

from studies import messages, progress
from studies.store.datasets import identify


def closed():
    stream = io.StringIO()
    stream.close()
    return stream


def full():
    return open("/dev/full", "w")


def nobody_listens():
    here, there = os.pipe()
    os.close(here)
    return os.fdopen(there, "w")


def terminal_that_is_gone():
    here, there = pty.openpty()
    stream = os.fdopen(there, "w")
    assert stream.isatty()
    os.close(here)
    return stream


def of_few_letters():
    return io.TextIOWrapper(io.BytesIO(), encoding="ascii")


class Terminal:
    """That looks like one until it is gone."""

    encoding = "utf-8"

    def __init__(self, stream):
        self.stream, self.lost = stream, False

    def isatty(self):
        return True

    def __getattr__(self, name):
        return getattr(self.stream, name)


STREAMS = (lambda: None, closed, full, nobody_listens, terminal_that_is_gone, of_few_letters)


@pytest.mark.parametrize("make", STREAMS)
@pytest.mark.parametrize("terminal", [False, True])
def test_streams_that_take_nothing_stop_nothing(make, terminal, monkeypatch, capsys):
    monkeypatch.setattr(progress, "QUIET_SECONDS", 0.0)
    stream = make()
    stream = Terminal(stream) if terminal and stream is not None else stream
    monkeypatch.setattr(sys, "stderr", stream)
    messages.note("Grüße, 2 × 3")
    counted = 0
    with progress.progress(10) as advance:
        for points in (3, 3, 4):
            advance(points)
            counted += points
    assert counted == 10
    assert capsys.readouterr().out == ""
    if stream is not None:
        # What is still in its buffer belongs to nobody.
        with suppress(OSError):
            stream.close()


def test_what_can_be_told_is_told(monkeypatch):
    monkeypatch.setattr(progress, "QUIET_SECONDS", 0.0)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    messages.note("twice")
    with progress.progress(10) as advance:
        advance(5)
    told = sys.stderr.getvalue().splitlines()
    assert told[0] == "twice"
    assert told[1].startswith("5/10 points, ")


@pytest.mark.parametrize("ending", ["the terminal is closed", "stderr is closed"])
def test_a_run_survives(ending, tmp_path, dataset_file):
    """Also the signal that the end of a terminal sends to all that runs there."""
    (tmp_path / "small.toml").write_text(TOML)
    program = [*COMMAND, "run", "small.toml", "--workers", "1"]
    if ending == "stderr is closed":
        script = '"$@" 2>&-'
        assert subprocess.run(["sh", "-c", script, "sh", *program], cwd=tmp_path).returncode == 0
    else:
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(tmp_path)
            os.execv(program[0], program)
        while not (tmp_path / "small.nc.shards" / "run.lock").exists():
            assert os.waitpid(child, os.WNOHANG) == (0, 0)
            time.sleep(0.01)
        os.close(terminal)
        os.waitpid(child, 0)
    assert identify(tmp_path / "small.nc")["content_hash"] == identify(dataset_file)["content_hash"]
