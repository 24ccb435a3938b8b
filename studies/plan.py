"""Planning decides everything and solves nothing: blocks, bytes, expected time.

The report and the run read the same frozen plan, so they cannot differ. How the grid is cut is policy: it
never changes a value.
"""

from dataclasses import dataclass
from math import ceil, prod

import numpy as np

from elastica.states import is_canonical, parse_state
from studies.evaluate import Block
from studies.schema import coordinates, variables
from studies.study import Study

SECONDS_PER_STATE = {"direct": 8e-6, "sweep": 120e-6}
"""One state at one grid point on one core of 2020–25: from a closed start, and by a sweep in κ."""
SECONDS_PER_SWEEP = 0.08
"""What a sweep costs each block, however few its points."""
SECONDS_PER_EIGENVALUES = 250e-6
SECONDS_PER_SAMPLE = 1e-6
SECONDS_PER_BLOCK = 2.0
LARGEST_BLOCK = 20_000
SMALL = 6.0
"""Seconds of work below which starting worker processes costs more than it saves."""
WARN_BYTES = 1_000_000_000


@dataclass(frozen=True)
class Plan:
    """A study cut into blocks.

    Attributes
    ----------
    study : Study
    names : tuple of str
        Canonical names of the states searched.
    blocks : tuple of Block
    points : int
        Grid points.
    states : int
        Pairs of a grid point and a state to solve.
    bytes : int
        Uncompressed size of the dataset, an upper bound for the file.
    seconds : float
        Expected work on one core.
    """

    study: Study
    names: tuple
    blocks: tuple
    points: int
    states: int
    bytes: int
    seconds: float

    @classmethod
    def of(cls, study, block_points=None):
        """Plan a study; `block_points` overrides the number of grid points of a block."""
        grid, names = study.grid, study.state_names
        H, P = len(grid.H), len(grid.P)
        per_point = {ends: _seconds_per_point(study, names, ends) for ends in grid.ends}
        blocks = []
        for number, ends in enumerate(grid.ends):
            size = block_points or min(LARGEST_BLOCK, ceil(SECONDS_PER_BLOCK / max(per_point[ends], 1e-9)))
            columns = min(P, size)
            rows = max(1, min(H, size // columns))
            blocks += [
                Block((number, i, j), ends, grid.H[i : i + rows], grid.P[j : j + columns])
                for i in range(0, H, rows)
                for j in range(0, P, columns)
            ]
        labels = coordinates(grid.ends, grid.H, grid.P, names, study.outputs)
        size = sum(
            np.dtype(variable.dtype).itemsize * prod(labels[dim].size for dim in variable.dims)
            for variable in variables(labels).values()
        )
        return cls(
            study=study,
            names=names,
            blocks=tuple(blocks),
            points=len(grid.ends) * H * P,
            states=H * P * sum(is_canonical(name, ends) for name in names for ends in grid.ends),
            bytes=size,
            seconds=H * P * sum(per_point.values())
            + SECONDS_PER_SWEEP * sum(_sweeps(names, block.ends) for block in blocks),
        )

    @property
    def small(self):
        """Whether the work is done before worker processes would have started."""
        return self.seconds < SMALL

    def report(self, workers):
        """Lines that tell a user what a run would do."""
        lines = [
            f"study     {self.study.name} ({self.study.study_id[:8]})",
            f"points    {self.points:,} grid points, {self.states:,} states to solve: "
            + " ".join(self.names),
            f"blocks    {len(self.blocks):,}",
            f"size      at most {readable_bytes(self.bytes)} before compression",
            f"time      about {readable_time(self.seconds)} of work, "
            f"{readable_time(self.seconds / workers)} on {workers} worker{'s' * (workers > 1)}",
        ]
        if self.bytes > WARN_BYTES:
            lines.append(
                f"warning   more than {readable_bytes(WARN_BYTES)}: fewer [outputs] shapes or "
                "eigenvalues make it smaller"
            )
        return lines


def _seconds_per_point(study, names, ends):
    """Expected work at a grid point with these ends."""
    known = [parse_state(name, ends) for name in names if is_canonical(name, ends)]
    sweeps = _sweeps(names, ends)
    bent = sum(not state.straight for state in known)
    return (
        SECONDS_PER_STATE["sweep"] * sweeps
        + SECONDS_PER_STATE["direct"] * (len(known) - sweeps)
        # About a third of the states asked for exist at a point.
        + SECONDS_PER_EIGENVALUES / 3 * bool(study.outputs.eigenvalues) * bent
        + SECONDS_PER_SAMPLE * study.outputs.shapes * len(known)
    )


def _sweeps(names, ends):
    """Number of states with these ends that need a sweep in κ."""
    return sum(
        any(segment.kind.turning_points > 1 for segment in state.segments(ends))
        for name in names
        if is_canonical(name, ends)
        for state in [parse_state(name, ends)]
        if state.word and not state.line
    )


def readable_bytes(count):
    """A size with its unit, such as 3.2 MB."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


def readable_time(seconds):
    """A duration such as 3 s, 12 min or 2.5 h."""
    if seconds < 1:
        return "less than a second"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
