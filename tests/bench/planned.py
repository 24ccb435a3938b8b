"""What `elastica plan` expects beside what the work takes: seconds of one processor.

`python tests/bench/planned.py [STUDY.toml ...]` computes each study in this process, by default those of the
catalogue and some of long words, single states and large maps; of many blocks those that lie evenly in the
grid. Nothing is asserted.
"""

import sys
import tempfile
import time
from pathlib import Path

from studies import Study
from studies.design.costs import costs_of
from studies.running.worker import Job, compute_block, versions

CATALOG = Path(__file__).parents[2] / "catalogs"
MOST_BLOCKS = 6
"""Computed of a study."""
CLAMPED, PINNED, SPRINGS = ["clamped-clamped"], ["pinned-pinned"], ["0.3/2.5"]
H, P = {"start": 0.01, "stop": 0.2, "num": 100}, {"start": 0.05, "stop": 12.0, "num": 200}
FEW = {"start": 0.01, "stop": 0.2, "num": 20}, {"start": 0.05, "stop": 12.0, "num": 50}
NAMES = ["U", "Ua", "U-", "UD"]
MADE = {
    "maps of four states": (CLAMPED, H, P, {"names": NAMES}, {}),
    "eigenvalues": (CLAMPED, *FEW, {"names": NAMES}, {"eigenvalues": 4}),
    "frequencies": (CLAMPED, *FEW, {"names": NAMES}, {"frequencies": 4}),
    "shapes": (CLAMPED, *FEW, {"names": NAMES}, {"shapes": 101}),
    "springs": (SPRINGS, *FEW, {"names": NAMES}, {}),
    "springs, all outputs": (
        SPRINGS,
        *FEW,
        {"names": NAMES},
        {"eigenvalues": 4, "frequencies": 4, "shapes": 101},
    ),
    "search, one contact": (PINNED, *FEW, {"max_contacts": 1}, {}),
    "search, two contacts": (CLAMPED, *FEW, {"max_contacts": 2}, {}),
    "search, four contacts": (CLAMPED, *FEW, {"max_contacts": 4}, {}),
    "twenty contacts": (PINNED, *FEW, {"names": ["UD" * 10]}, {"eigenvalues": 4}),
}


def made(name, ends, H, P, states, outputs):
    """One of the studies above."""
    grid = {"ends": ends, "H": H, "P": P}
    return Study.from_dict({"study": {"name": "made"}, "grid": grid, "states": states, "outputs": outputs})


def measured(study):
    """Seconds expected of some blocks, and those that they took with their shards."""
    plan = study.plan()
    blocks = plan.blocks[:: -(-len(plan.blocks) // MOST_BLOCKS)]
    expected = sum(costs_of(plan.task, block.ends, block.control).of(block) for block in blocks)
    with tempfile.TemporaryDirectory() as folder:
        job = Job(plan.task, plan.identity, Path(folder), versions(), None, False, tile=plan.tile)
        begin = time.process_time()
        for block in blocks:
            compute_block(block, job)
        return expected, time.process_time() - begin


def main(*paths):
    paths = [Path(path) for path in paths] or sorted(CATALOG.glob("*.toml"))
    studies = {path.stem: Study.from_toml(path) for path in paths}
    if len(sys.argv) == 1:
        studies |= {name: made(name, *parts) for name, parts in MADE.items()}
    # What is prepared once is in no plan.
    measured(next(iter(studies.values())))
    print(f"{'study':<24} {'planned':>9} {'measured':>9}   ratio")
    for name, study in studies.items():
        expected, spent = measured(study)
        print(f"{name:<24} {expected:7.2f} s {spent:7.2f} s {expected / spent:7.2f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
