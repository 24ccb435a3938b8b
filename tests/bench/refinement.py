"""How much of a chart a refined study gets wrong, by the points that it solves, beside evenly spaced ones.

`python tests/bench/refinement.py [PNG]` solves the finest grid once and prints the share of its area in
which the nearest of the points solved has other stable states; nothing is asserted.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import studies
from studies import Study
from studies.design.axes import Refine
from studies.design.refinement import UNKNOWN, first_points, next_points
from studies.store.sources import Source, StableStates

LEVELS = 5
CONTENT = {
    "study": {"name": "finest"},
    "grid": {
        "ends": ["clamped-clamped", "pinned-pinned"],
        "H": {"start": 0.01, "stop": 0.2, "num": 9 * 2**LEVELS + 1},
        "P": {"start": 0.05, "stop": 12.0, "num": 24 * 2**LEVELS + 1},
    },
    "states": {"names": ["0", "B1", "B2", "U", "Ua", "aUa", "U-", "UD", "UD-", "UDU"]},
}


def every_point(study):
    """Numbers of the sets of stable states of all points, shape (ends, H, P)."""
    stable = StableStates(study.grid)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "finest.nc"
        studies.run(study, path).close()
        labels = np.array(study.grid.H), np.array(study.grid.P)
        stable.learn(Source(path, study.grid.ends, *labels, (), every_root=False))
    return stable.codes


def refined(dense, refine):
    """Which points of a map a refined study solves."""
    codes = np.full(dense.shape, UNKNOWN, dense.dtype)
    wanted = first_points(dense.shape, refine)
    while wanted.any():
        codes[wanted] = dense[wanted]
        wanted = next_points(codes, refine)
    return codes != UNKNOWN


def lattice(dense, stride):
    """Evenly spaced points of a map."""
    solved = np.zeros(dense.shape, bool)
    solved[::stride, ::stride] = True
    return solved


def misclassified(dense, solved):
    """Share of the area in which the nearest point solved has other stable states."""
    points = np.argwhere(solved)
    nearest = points[cKDTree(points).query(np.argwhere(np.ones_like(solved)))[1]]
    return (dense[tuple(nearest.T)] != dense.ravel()).mean()


def main(picture=None):
    study = Study.from_dict(CONTENT)
    dense = every_point(study)
    ways = {
        "evenly spaced": [partial_lattice(levels) for levels in range(LEVELS, -1, -1)],
        "refined": [partial_refined(levels, 1) for levels in range(1, LEVELS + 1)],
        "refined, no audit": [partial_refined(levels, 0) for levels in range(1, LEVELS + 1)],
    }
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    print(f"{dense.size:,} points of the finest grid, {len(np.unique(dense))} sets of stable states")
    for way, choices in ways.items():
        figures = []
        for label, choose in choices:
            solved = [choose(plane) for plane in dense]
            wrong = np.mean([misclassified(*both) for both in zip(dense, solved, strict=True)])
            figures.append((sum(map(np.sum, solved)), wrong))
            share = figures[-1][0] / dense.size
            print(f"{way:<18} {label:<30} {figures[-1][0]:>8,} points ({share:6.1%}), {wrong:.4%} wrong")
        points, wrong = np.array(figures).T
        axes.loglog(points, np.maximum(wrong, 0.1 / dense.size), "o-", label=way)
    axes.set(xlabel="points solved", ylabel="share of the area misclassified")
    axes.legend()
    if picture:
        figure.savefig(picture, dpi=150)


def partial_lattice(levels):
    """Name and chooser of the points of a coarser grid."""
    return f"every {2**levels} steps", lambda plane: lattice(plane, 2**levels)


def partial_refined(levels, audit):
    """Name and chooser of the points of a refined grid."""
    refine = Refine(levels=levels, audit=audit)
    return f"levels = {levels}, audit = {audit}", lambda plane: refined(plane, refine)


if __name__ == "__main__":
    main(*sys.argv[1:])
