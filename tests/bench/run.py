"""What it costs that a study cannot be lost: runs beside a bare loop over the same blocks.

`python tests/bench/run.py [SECONDS_OF_A_BLOCK [BLOCKS [ROUNDS]]]` prints wall and processor time, medians
of rounds in which loop and runs take turns; start and final dataset are included. The same blocks take now
longer and now less, by more than what is to be measured here: `beside the blocks` is what a run spent on all
else, against what its own blocks took in it. Nothing is asserted.
"""

import re
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

import psutil

from studies import Study
from studies.running.evaluate import evaluate
from studies.running.runner import compute
from studies.running.session import Policy
from studies.sandbox import OWN
from studies.store.files import opened

CONTENT = {
    "study": {"name": "overhead"},
    "grid": {
        "ends": ["clamped-clamped"],
        "H": {"start": 0.05, "stop": 0.2, "num": 4000},
        "P": {"start": 0.5, "stop": 9.0, "num": 50},
    },
    "states": {"names": ["0", "B1", "U", "U-"]},
    "outputs": {"eigenvalues": 4},
}
SAMPLE_EVERY = 0.1


def measured(work):
    """Wall seconds of some work, and processor seconds of this process and of all that it has started."""
    spent, watching, finished = {}, [], threading.Event()

    def sample():
        for process in psutil.Process().children(recursive=True):
            try:
                times = process.cpu_times()
                spent.setdefault(process.pid, []).append(times.user + times.system)
            except psutil.Error:
                continue

    def watch():
        while not finished.wait(SAMPLE_EVERY):
            sample()
        watching.append(time.thread_time())

    # Each run starts its own helper.
    OWN.__dict__.clear()
    sample()
    before = {pid: seconds[0] for pid, seconds in spent.items()}
    watcher = threading.Thread(target=watch)
    watcher.start()
    start, own = time.perf_counter(), time.process_time()
    work()
    wall, own = time.perf_counter() - start, time.process_time() - own
    finished.set()
    watcher.join()
    sample()
    own -= watching[0]
    return wall, own + sum(max(seconds) - before.get(pid, 0.0) for pid, seconds in spent.items())


def study_of(seconds, blocks):
    """A plan of so many blocks that take about so long each."""
    study = Study.from_dict(CONTENT)
    columns = len(study.grid.P)
    trial = study.plan(block_points=columns).blocks[0]
    evaluate(trial, study.task)
    start = time.process_time()
    for _ in range(3):
        evaluate(trial, study.task)
    rows = max(1, round(3 * seconds / (time.process_time() - start)))
    grid = study.grid.model_copy(update={"H": study.grid.H[: rows * blocks]})
    return study.model_copy(update={"grid": grid}).plan(block_points=columns * rows)


def main(seconds=1.0, blocks=20, rounds=3):
    plan = study_of(seconds, int(blocks))

    solving = {}

    def bare():
        for block in plan.blocks:
            evaluate(block, plan.task)

    def run(workers):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "overhead.nc"
            compute(plan, out, Policy(workers=workers))
            with opened(out) as dataset:
                spent = float(re.search(r"sum (\S+) s", dataset.block_seconds)[1])
            solving.setdefault(workers, []).append(spent)

    ways = {
        "bare loop": (bare, None),
        "in this process": (lambda: run(0), 0),
        "one worker": (lambda: run(1), 1),
        "two workers": (lambda: run(2), 2),
    }
    times = {name: [] for name in ways}
    for _ in range(int(rounds)):
        for name, (work, _) in ways.items():
            times[name].append(measured(work))
    loop = [median(column) for column in zip(*times["bare loop"], strict=True)]
    print(f"{len(plan.blocks)} blocks of {loop[1] / len(plan.blocks):.2f} s")
    for name, found in times.items():
        wall, cpu = (median(column) for column in zip(*found, strict=True))
        print(
            f"{name:<16} {wall:7.2f} s ({100 * (wall / loop[0] - 1):+.1f} %), "
            f"processor {cpu:7.2f} s ({100 * (cpu / loop[1] - 1):+.1f} %)",
            end="",
        )
        shares = [
            total / own - 1 for (_, total), own in zip(found, solving.get(ways[name][1], ()), strict=False)
        ]
        print(f", beside the blocks {100 * median(shares):+.1f} %" if shares else "")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
