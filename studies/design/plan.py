"""Planning decides everything and solves nothing: blocks, bytes, expected time.

The report and the run read the same frozen plan, so they cannot differ. How the grid is cut is policy: it
never changes a value.

Not here: what the work costs (`costs`), where a refined study computes (`refinement`).
"""

from dataclasses import dataclass
from itertools import islice
from math import ceil, prod
from typing import NamedTuple

import numpy as np

from elastica.equilibria.roots import CHUNK
from elastica.state import is_canonical
from studies.design.block import Block, Gaps, Scattered, Task
from studies.design.costs import ROOTS, bytes_of, costs_of, costs_of_events
from studies.design.refinement import first_places, next_points
from studies.design.request import Request
from studies.errors import StudyError
from studies.messages import readable_bytes, readable_time

SECONDS_PER_BLOCK = 2.0
LARGEST_BLOCK, LARGEST_SEARCH = 20_000, 4_000
"""Grid points of a block; the second where every root of words with two and more contacts is sought."""
GAPS_OF_EVENTS = 10
"""Gaps of a block of events."""
GAPS_PER_BLOCK = 20
"""Under prescribed shortening, where the cost of a block hardly depends on the other label."""
LEAST_TILE = 256
"""Grid points of a tile; chunks of fewer cost more than they hold."""
MOST_BLOCKS = 1_000_000
"""Each is one file while the study is computed."""
LARGEST_ARRAY = 400_000_000
"""Bytes that a block may hold."""
SMALL = 6.0
"""Seconds of work below which starting worker processes costs more than it saves."""
WARN_BYTES = 1_000_000_000


class Reusable(NamedTuple):
    """What finished datasets hold of a study: points that need not be computed.

    Attributes
    ----------
    sources : tuple of studies.store.sources.Source
    held : ndarray of bool, shape (ends, H, prescribed), or None
        Grid points that they hold, if not every state there; None for none.
    searched : frozenset of str
        States that were asked for in every one of them.
    about : dict
        What the dataset says of them, as attributes.
    """

    sources: tuple
    held: np.ndarray | None
    searched: frozenset
    about: dict


NOTHING = Reusable((), None, frozenset(), {})


@dataclass(frozen=True)
class Plan:
    """A study cut into blocks; a refined one into those that are to be computed next.

    Attributes
    ----------
    study : Request
    task : Task
        What is computed at each grid point.
    blocks : tuple of Block
    points : int
        Grid points.
    states : int
        Pairs of a grid point and a state to solve, each word counted once.
    bytes : int
        Uncompressed size of the dataset. An upper bound for the file, unless words have more roots than
        expected.
    seconds : float
        Expected work on one core.
    longest : float
        That of the longest block.
    reuse : Reusable
    block_points : int or None
        Grid points of a block, if they are prescribed.
    tile : (int, int) or None
        Rows and columns of the grid that make a chunk of the dataset. Every block consists of whole tiles, so
        that its shard has chunks of the dataset; None where blocks are of other points, or smaller.
    """

    study: Request
    task: Task
    blocks: tuple
    points: int
    states: int
    bytes: int
    seconds: float
    longest: float
    reuse: Reusable = NOTHING
    block_points: int | None = None
    tile: tuple[int, int] | None = None

    @classmethod
    def of(cls, study: Request, block_points: int | None = None, reuse: Reusable = NOTHING) -> "Plan":
        """Plan a study.

        Parameters
        ----------
        study : Request
        block_points : int, optional
            Grid points of a block.
        reuse : Reusable, optional
            Its points are in no block.

        Raises
        ------
        StudyError
            If there are more blocks than a run can keep account of, or one point is too large for a block.
        """
        grid = study.grid

        def cut(number, size):
            # Of a study that is computed whole no point is looked at: a plan costs what its blocks do.
            wanted = None if reuse.held is None else ~reuse.held[number]
            if grid.refine is None:
                return _rectangular(grid, number, wanted, size)
            return _scattered(grid, number, _first_places(grid, wanted), size)

        whole = grid.refine is None and reuse.held is None
        return cls._of_points(study, study.task, cut, block_points, reuse, whole)

    @classmethod
    def of_rest(
        cls, study: Request, names: tuple[str, ...], points: np.ndarray, block_points: int | None = None
    ) -> "Plan":
        """Plan some of the states of a study at some points, bool, shape (ends, H, prescribed)."""
        grid = study.grid

        def cut(number, size):
            if grid.refine is None:
                return _rectangular(grid, number, points[number], size)
            return _scattered(grid, number, np.nonzero(points[number]), size)

        return cls._of_points(study, study.task._replace(names=names), cut, block_points)

    @classmethod
    def _of_points(cls, study, task, cut, block_points, reuse=NOTHING, whole=False):
        grid = study.grid
        costs = {ends: costs_of(task, ends, grid.control) for ends in grid.ends}
        per_point = bytes_of(study, task, points=1)
        if per_point > LARGEST_ARRAY:
            raise StudyError(
                f"study {study.name}: the states of one point may take {readable_bytes(per_point)}, and a "
                f"block holds {readable_bytes(LARGEST_ARRAY)}; use fewer samples of shapes, or fewer states"
            )
        sizes = [block_points or _block_points(costs[ends], task, grid, per_point) for ends in grid.ends]
        tile = _tile(grid, min(sizes))
        if tile:
            sizes = [size - size % prod(tile) for size in sizes]
        blocks: list[Block] = []
        for number, size in enumerate(sizes):
            blocks += islice(cut(number, size), MOST_BLOCKS + 1 - len(blocks))
            if len(blocks) > MOST_BLOCKS:
                raise StudyError(
                    f"study {study.name}: more than {MOST_BLOCKS:,} blocks are too many; use a smaller grid, "
                    "fewer outputs, or divide it into several studies"
                )
        at_ends = len(grid.H) * len(grid.prescribed)
        points = len(grid.ends) * at_ends
        seconds = [costs[block.ends].of(block) for block in blocks]
        return cls(
            study=study,
            task=task,
            blocks=tuple(blocks),
            points=points,
            states=at_ends * sum(is_canonical(name, ends) for name in task.names for ends in grid.ends),
            bytes=bytes_of(study, task, points),
            seconds=sum(seconds),
            longest=max(seconds, default=0.0),
            reuse=reuse,
            block_points=block_points,
            tile=tile if whole else None,
        )

    @classmethod
    def of_events(cls, study: Request, names: tuple[str, ...], block_points: int | None = None) -> "Plan":
        """Plan the transition table of a study, in blocks of gaps.

        Parameters
        ----------
        study : Request
        names : tuple of str
            States of its dataset.
        block_points : int, optional
            Gaps of a block, if fewer than usual.
        """
        grid = study.grid
        size = min(block_points or GAPS_OF_EVENTS, GAPS_OF_EVENTS)
        loads = grid.prescribed[0], grid.prescribed[-1]
        blocks = tuple(
            Gaps((number, row, 0), ends, grid.H[row : row + size], "P", loads)
            for number, ends in enumerate(grid.ends)
            for row in range(0, len(grid.H), size)
        )
        seconds = [costs_of_events(names, block.ends).of(block) for block in blocks]
        return cls(
            study=study,
            task=study.task._replace(names=names, every_root=False),
            blocks=blocks,
            points=sum(block.points for block in blocks),
            states=0,
            bytes=0,
            seconds=sum(seconds),
            longest=max(seconds),
        )

    def next(self, codes: np.ndarray) -> "Plan":
        """The plan for what a refined study wants next; without blocks if nothing.

        Parameters
        ----------
        codes : ndarray of int, shape (ends, H, prescribed)
            What is known, as for `next_points`.
        """
        study = self.study
        wanted = np.array([next_points(plane, study.grid.refine) for plane in codes])
        return Plan.of_rest(study, self.task.names, wanted, self.block_points)

    @property
    def identity(self) -> dict[str, str]:
        """Identity of its shards: of the study and, if not all states are computed, of these."""
        if self.task == self.study.task:
            return self.study.identity
        return self.study.identity | {"states_searched": " ".join(self.task.names)}

    @property
    def small(self) -> bool:
        """Whether the work is done before worker processes would have started."""
        return self.seconds < SMALL

    def report(self, workers: int) -> list[str]:
        """Lines that tell a user what a run would do."""
        refined = self.study.grid.refine is not None
        lines = [
            f"study     {self.study.name} ({self.study.study_id[:8]})",
            f"points    {self.points:,} grid points, {self.states:,} states to solve: "
            + " ".join(self.task.names)
            + ", with every root of the words" * self.task.every_root,
            *(self._of_refinement() if refined else ()),
            f"blocks    {len(self.blocks):,}" + " of these first points" * refined,
            f"size      at most {readable_bytes(self.bytes)} before compression"
            + f", if words have {ROOTS} roots on the average" * self.task.every_root,
            f"time      {'about ' * (self.seconds >= 1)}{readable_time(self.seconds)} of work, "
            f"{readable_time(self.seconds / workers)} on {workers} worker{'s' * (workers > 1)}"
            + ", for these first points"
            * refined,
            *(self._of_events() if self.study.outputs.transitions else ()),
        ]
        if self.bytes > WARN_BYTES:
            lines.append(
                f"warning   more than {readable_bytes(WARN_BYTES)}: fewer [outputs] shapes or "
                "eigenvalues make it smaller"
            )
        return lines

    def _of_events(self):
        """What the transition table takes beyond the points."""
        events = Plan.of_events(self.study, self.task.names)
        yield (
            f"events    transitions at {events.points:,} gaps, in the end: {readable_time(events.seconds)} "
            "of work" + " for these states, and more for further roots" * self.task.every_root
        )

    def _of_refinement(self):
        """Lines that tell what is certain of a refined study, and what it cannot exceed."""
        first = sum(block.points for block in self.blocks)
        grid = self.study.grid
        costs = [costs_of(self.task, ends, grid.control) for ends in grid.ends]
        every = sum(some.seconds(len(grid.H) * len(grid.prescribed), len(grid.H)) for some in costs)
        yield (
            f"refined   {first:,} points first, the coarse grid and its audit; then where the stable states "
            f"change, at most all: {readable_time(every)} of work"
        )
        if grid.control != "P":
            yield (
                "warning   at prescribed shortening one point of a gap takes as long as all of them: compute "
                "the finest grid instead, without refine"
            )


def _rectangular(grid, number, wanted, size):
    """Blocks that are rectangles of labels."""
    row_of, column_of = ({label: i for i, label in enumerate(axis)} for axis in (grid.H, grid.prescribed))
    for gaps, labels in _rectangles(wanted, grid):
        columns = min(len(labels), size)
        # Cut once, so that all blocks of a column share its labels.
        parts = _cut(labels, columns)
        for H in _cut(gaps, max(1, min(len(gaps), size // columns))):
            for prescribed in parts:
                place = number, row_of[H[0]], column_of[prescribed[0]]
                yield Block(place, grid.ends[number], H, grid.control, prescribed)


def _first_places(grid, wanted):
    """Positions of the first points of a refined grid, of those that are wanted."""
    places = first_places((len(grid.H), len(grid.prescribed)), grid.refine)
    if wanted is None:
        return places
    there = wanted[places]
    return tuple(place[there] for place in places)


def _scattered(grid, number, places, size):
    """Blocks of points wherever they are, row by row; under prescribed shortening whole rows, if they fit."""
    i, j = (place.tolist() for place in places)
    starts = range(0, len(i), size)
    if grid.control != "P" and size >= len(grid.prescribed):
        starts = np.unique(i, return_index=True)[1][:: max(1, size // len(grid.prescribed))].tolist()
    for start, end in zip(starts, [*starts, len(i)][1:], strict=True):
        H = tuple(map(grid.H.__getitem__, i[start:end]))
        prescribed = tuple(map(grid.prescribed.__getitem__, j[start:end]))
        yield Scattered((number, i[start], j[start]), grid.ends[number], H, grid.control, prescribed)


def _rectangles(wanted, grid):
    """Labels of H and of what is prescribed whose products make up the points wanted.

    Those are bool, shape (H, prescribed), or None for all.
    """
    if wanted is None:
        return [(grid.H, grid.prescribed)]
    rows_of: dict[bytes, list[int]] = {}
    for row, columns in enumerate(wanted):
        if columns.any():
            rows_of.setdefault(columns.tobytes(), []).append(row)
    return [
        (
            tuple(grid.H[row] for row in rows),
            tuple(grid.prescribed[column] for column in np.flatnonzero(wanted[rows[0]])),
        )
        for rows in rows_of.values()
    ]


def _cut(labels, size):
    return [labels[i : i + size] for i in range(0, len(labels), size)]


def _tile(grid, size):
    """Rows and columns of about so many points: whole rows, or a part of one that is a power of two."""
    columns = len(grid.prescribed)
    if size < columns:
        columns = 1 << (size.bit_length() - 1)
    rows = max(1, min(len(grid.H), size // columns))
    return (rows, columns) if rows * columns >= LEAST_TILE else None


def _block_points(costs, task, grid, bytes_per_point):
    """Grid points of a block: some seconds of work that fit into memory."""
    most = max(1, LARGEST_ARRAY // bytes_per_point)
    if grid.control != "P":
        # Branches are traced once for each gap, so whole rows belong together, if they fit into memory.
        rows = max(1, min(GAPS_PER_BLOCK, min(most, CHUNK) // len(grid.prescribed)))
        return min(most, rows * len(grid.prescribed))
    contacts = max(name.count("U") + name.count("D") for name in task.names)
    largest = LARGEST_SEARCH if task.every_root and contacts > 1 else LARGEST_BLOCK
    seconds = max(SECONDS_PER_BLOCK, 10 * costs.chunk)
    return min(most, largest, ceil(seconds / max(costs.point, 1e-9)))
