"""What it costs that a study cannot be lost: a run beside a bare loop over the same blocks.

`python tests/benchmark_run.py [SECONDS_OF_A_BLOCK]` prints both times; nothing is asserted.
"""

import sys
import tempfile
import time
from pathlib import Path

from studies import Study
from studies.evaluate import evaluate
from studies.runner import Policy, compute

CONTENT = {
    "study": {"name": "overhead"},
    "grid": {
        "ends": ["clamped-clamped"],
        "H": {"start": 0.05, "stop": 0.2, "num": 400},
        "P": {"start": 0.5, "stop": 9.0, "num": 500},
    },
    "states": {"names": ["0", "B1", "U", "U-"]},
    "outputs": {"eigenvalues": 4},
}
BLOCKS = 20


def main(seconds=1.0):
    study = Study.from_dict(CONTENT)
    trial = study.plan(block_points=500).blocks[0]
    evaluate(trial, study.task)
    start = time.perf_counter()
    evaluate(trial, study.task)
    rows = max(1, round(seconds / (time.perf_counter() - start)))
    grid = study.grid.model_copy(update={"H": study.grid.H[: rows * BLOCKS]})
    plan = study.model_copy(update={"grid": grid}).plan(block_points=500 * rows)
    start = time.perf_counter()
    for block in plan.blocks:
        evaluate(block, study.task)
    bare = time.perf_counter() - start
    print(f"{len(plan.blocks)} blocks of {bare / len(plan.blocks):.2f} s, bare loop {bare:.2f} s")
    for name, policy in (("in this process", Policy(workers=0)), ("one worker", Policy(workers=1))):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            compute(plan, Path(folder) / "overhead.nc", policy)
            total = time.perf_counter() - start
        print(f"{name}: {total:.2f} s, {100 * (total / bare - 1):+.1f} %, start and final dataset included")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
