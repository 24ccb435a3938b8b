"""Run a study block by block: `run_blocks.py STUDY OUT POINTS WORKERS`, or an address instead of workers."""

import sys
from contextlib import ExitStack

from studies import Study, StudyError, run
from studies.running.cluster import running_cluster


def main(study, out, points, where):
    with ExitStack() as stack:
        by_hand = stack.enter_context(running_cluster(where)) if ":" in where else None
        workers = None if by_hand else int(where)
        run(Study.from_toml(study), out, workers=workers, client=by_hand, block_points=int(points)).close()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except StudyError as problem:
        sys.exit(str(problem))
