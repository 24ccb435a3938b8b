"""The `elastica` command in processes of its own, as a user or a cluster starts it."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

COMMAND = [sys.executable, "-c", "from studies.command_line import main; main()"]
DASK = [sys.executable, "-m", "dask"]
TESTS = Path(__file__).parents[1]


def elastica(*arguments, cwd=None, timeout=300, **environment):
    """Run a command to its end."""
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=timeout,
        env=os.environ | environment,
    )


def start(*arguments, cwd=None, **environment):
    """Begin a command, in a group of its own."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
        start_new_session=True,
    )


def poisoned(death, ends, H, P):
    """Environment in which one point is deadly."""
    return {**_loading("poison"), "POISON": death, "POISON_POINT": f"{ends} {H} {P}"}


def witnessed(file):
    """Environment in which blocks that are begun and done are written down."""
    return {**_loading("witness"), "WITNESS": str(file)}


def _loading(folder):
    """Environment in which Python begins with the code of a folder."""
    return {
        "PYTHONPATH": os.pathsep.join([str(TESTS / folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    }


@contextmanager
def dask_by_hand(folder, workers=2, **environment):
    """A scheduler and workers as separate processes: its address and itself."""
    file = folder / "scheduler.json"

    def begin(*arguments):
        return subprocess.Popen(
            [*DASK, *map(str, arguments), "--no-dashboard", "--scheduler-file", str(file)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | environment,
        )

    started = [begin("scheduler", "--host", "127.0.0.1", "--port", 0)]
    try:
        deadline = time.monotonic() + 120
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        options = ("--nthreads", 1, "--no-nanny", "--local-directory", folder / "dask")
        started += [begin("worker", *options) for _ in range(workers)]
        yield json.loads(file.read_text())["address"], started[0]
    finally:
        # Workers whose scheduler has gone may take minutes to end of themselves.
        for process in started:
            process.kill()
            process.wait()
