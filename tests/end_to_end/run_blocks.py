"""Run a study in small blocks and print how many were computed: `run_blocks.py STUDY OUT WORKERS POINTS`."""

import sys

from studies import Study, runner


def main(study, out, workers, points):
    results, computed = runner._results, 0

    def counted(*arguments):
        nonlocal computed
        for done in results(*arguments):
            computed += 1
            yield done

    runner._results = counted
    runner.run(Study.from_toml(study), out, workers=int(workers), block_points=int(points)).close()
    print(computed)


if __name__ == "__main__":
    main(*sys.argv[1:])
