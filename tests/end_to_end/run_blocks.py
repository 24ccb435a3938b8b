"""Run a study in blocks of one point: `run_blocks.py STUDY OUT WORKERS`, or an address instead of workers."""

import sys
from contextlib import ExitStack

from studies import Study, StudyError, run
from studies.running.cluster import running_cluster


def main(study, out, where):
    with ExitStack() as stack:
        by_hand = stack.enter_context(running_cluster(where)) if ":" in where else None
        workers = None if by_hand else int(where)
        run(Study.from_toml(study), out, workers=workers, client=by_hand, block_points=1).close()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except StudyError as problem:
        sys.exit(str(problem))
