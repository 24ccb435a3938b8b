"""What many small blocks cost: time, and the memory of client, scheduler and worker, against their number.

`python tests/bench/blocks.py [BLOCKS ...]` prints a line for each; nothing is asserted.
"""

import json
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import psutil
from distributed import Client

from studies import Study
from studies.running import runner
from studies.running.session import Policy

POINTS = 10
CONTENT = {"study": {"name": "blocks"}, "states": {"names": ["0"]}}


def peak(pid):
    """Largest memory of a process so far, in MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1000


def start(*arguments):
    command = [sys.executable, "-m", "dask", *map(str, arguments), "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main(blocks):
    rows = 10 * round((blocks / 10) ** 0.5 / 10) or 1
    axes = {
        "H": {"start": 0.05, "stop": 0.2, "num": rows},
        "P": {"start": 0.5, "stop": 9.0, "num": POINTS * blocks // rows},
    }
    plan = Study.from_dict({**CONTENT, "grid": {"ends": ["clamped-clamped"], **axes}}).plan(
        block_points=POINTS
    )
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "scheduler.json", Path(folder) / "blocks.nc"
        options = ["--host", "127.0.0.1", "--port", 0, "--scheduler-file", file]
        scheduler = start("scheduler", *options)
        while not file.exists():
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        worker = start("worker", address, "--nthreads", 1, "--no-nanny", "--local-directory", folder)
        try:
            measure(plan, out, address, scheduler.pid, worker.pid)
        finally:
            for process in (worker, scheduler):
                process.terminate()
                process.wait()


def measure(plan, out, address, scheduler, worker):
    finish, begun = runner._finish, []

    def timed(*arguments):
        begun.append(time.perf_counter())
        return finish(*arguments)

    runner._finish = timed
    with Client(address) as client:
        start = time.perf_counter()
        runner.compute(plan, out, Policy(cluster=partial(nullcontext, client)))
        computing, joining = begun[0] - start, time.perf_counter() - begun[0]
        solver = psutil.Process(worker).children()[0].pid
        memory = {"client": psutil.Process().pid, "scheduler": scheduler, "worker": worker, "solver": solver}
        said = ", ".join(f"{name} {peak(pid):.0f}" for name, pid in memory.items())
    number = len(plan.blocks)
    print(
        f"{number} blocks: {computing:.0f} s to compute ({1e3 * computing / number:.1f} ms each), "
        f"{joining:.0f} s to join ({1e3 * joining / number:.1f} ms each); peak memory in MB: {said}",
        flush=True,
    )
    runner._finish = finish


if __name__ == "__main__":
    for count in map(int, sys.argv[1:] or ["1000", "10000"]):
        main(count)
