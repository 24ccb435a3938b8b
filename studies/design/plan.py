"""Planning decides everything and solves nothing: blocks, bytes, expected time.

The report and the run read the same frozen plan, so they cannot differ. How the grid is cut is policy: it
never changes a value.
"""

from dataclasses import dataclass
from itertools import islice
from math import ceil, prod
from typing import Any, NamedTuple

import numpy as np

from elastica.ends import parse_ends
from elastica.equilibria.roots import CHUNK, alternates
from elastica.state import is_canonical, parse_state
from studies.design.block import Block, Gaps, Scattered, Task
from studies.design.refinement import first_places, next_points
from studies.design.study import Study
from studies.errors import StudyError
from studies.messages import readable_bytes, readable_time
from studies.schema import coordinates, variables

SECONDS_PER_STATE = 8e-6
"""One state at one grid point on one core of 2020–25, from a closed start."""
SECONDS_PER_WORD = 30e-6
"""The same where every root is sought."""
SECONDS_PER_SWEEP = 0.05
"""What the search for a word costs each chunk of points, however few they are."""
SECONDS_PER_BRANCH = 0.045
"""Tracing the branches of a word with one contact at one gap, under prescribed shortening."""
SECONDS_PER_TRACING = 0.6
"""What tracing costs each chunk for such a word, however few its gaps."""
SPRINGS = 8.0
"""Factor of all this for segments at springs, whose lengths are integrated."""
ROOTS = 4
"""More roots than words have on the average, and are solved somewhere, at the loads of usual studies."""
SECONDS_PER_CHAIN = 5e-3
"""One state of a chain, with its exact start."""
SECONDS_PER_EIGENVALUES = 1.7e-3
"""Of one solved state; as many as there are words if every root is sought, else a third of those named."""
SECONDS_PER_SAMPLE = 1e-6
SECONDS_PER_BLOCK = 2.0
LARGEST_BLOCK, LARGEST_SEARCH = 20_000, 4_000
"""Grid points of a block; the second where every root of words with two and more contacts is sought."""
SECONDS_PER_EVENTS, SECONDS_PER_EVENTS_AT_GAP = 0.6, 0.15
"""Finding the events of a state: at a block of gaps, and at each of these."""
GAPS_OF_EVENTS = 10
"""Gaps of a block of events."""
GAPS_PER_BLOCK = 20
"""Under prescribed shortening, where the cost of a block hardly depends on the other label."""
MOST_BLOCKS = 1_000_000
"""Each is one file while the study is computed."""
LARGEST_ARRAY = 400_000_000
"""Bytes that a block may hold."""
SMALL = 6.0
"""Seconds of work below which starting worker processes costs more than it saves."""
WARN_BYTES = 1_000_000_000


@dataclass(frozen=True)
class Plan:
    """A study cut into blocks; a refined one into those that are to be computed next.

    Attributes
    ----------
    study : Study
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
    known : Known or None
        What finished datasets hold; these points are in no block.
    block_points : int or None
        Grid points of a block, if they are prescribed.
    """

    study: Study
    task: Task
    blocks: tuple
    points: int
    states: int
    bytes: int
    seconds: float
    longest: float
    known: Any = None
    block_points: int | None = None

    @classmethod
    def of(cls, study: Study, block_points: int | None = None, known: Any = None, rest: Any = None) -> "Plan":
        """Plan a study.

        Parameters
        ----------
        study : Study
        block_points : int, optional
            Grid points of a block.
        known : Known, optional
            What finished datasets hold; these points are in no block.
        rest : (tuple of str, ndarray of bool), optional
            Some of the states and the points, shape (ends, H, given), where nothing else is to be computed.

        Raises
        ------
        StudyError
            If there are more blocks than a run can keep account of.
        """
        grid, task = study.grid, study.task
        if rest is not None:
            task = task._replace(names=rest[0])
        H, given = len(grid.H), len(grid.given)
        costs = {ends: _costs(task, ends, grid.control) for ends in grid.ends}
        per_point = _bytes(study, task, points=1)
        blocks: list[Block] = []
        for number, ends in enumerate(grid.ends):
            size = block_points or _block_points(costs[ends], task, grid, per_point)
            # Of a study that is computed whole no point is looked at: a plan costs what its blocks do.
            wanted = None if known is None else ~known.held[number]
            if rest is not None:
                wanted = rest[1][number]
            if grid.refine is None:
                cut = _rectangular(grid, number, wanted, size)
            elif rest is not None:
                cut = _scattered(grid, number, np.nonzero(rest[1][number]), size)
            else:
                cut = _scattered(grid, number, _first_places(grid, wanted), size)
            blocks += islice(cut, MOST_BLOCKS + 1 - len(blocks))
            if len(blocks) > MOST_BLOCKS:
                raise StudyError(
                    f"study {study.name}: more than {MOST_BLOCKS:,} blocks are too many; use a smaller grid, "
                    "fewer outputs, or divide it into several studies"
                )
        points = len(grid.ends) * H * given
        seconds = [costs[block.ends].of(block) for block in blocks]
        return cls(
            study=study,
            task=task,
            blocks=tuple(blocks),
            points=points,
            states=H * given * sum(is_canonical(name, ends) for name in task.names for ends in grid.ends),
            bytes=_bytes(study, task, points),
            seconds=sum(seconds),
            longest=max(seconds, default=0.0),
            known=known,
            block_points=block_points,
        )

    @classmethod
    def of_events(cls, study: Study, names: tuple[str, ...], block_points: int | None = None) -> "Plan":
        """Plan the transition table of a study, in blocks of gaps.

        Parameters
        ----------
        study : Study
        names : tuple of str
            States of its dataset.
        block_points : int, optional
            Gaps of a block, if fewer than usual.
        """
        grid = study.grid
        size = min(block_points or GAPS_OF_EVENTS, GAPS_OF_EVENTS)
        blocks = tuple(
            Gaps((number, row, 0), ends, grid.H[row : row + size], "P", (grid.given[0], grid.given[-1]))
            for number, ends in enumerate(grid.ends)
            for row in range(0, len(grid.H), size)
        )
        seconds = [_event_costs(names, block.ends).of(block) for block in blocks]
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
        codes : ndarray of int, shape (ends, H, given)
            What is known, as for `next_points`.
        """
        study = self.study
        wanted = np.array([next_points(plane, study.grid.refine) for plane in codes])
        return Plan.of(study, self.block_points, self.known, rest=(self.task.names, wanted))

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
        costs = [_costs(self.task, ends, grid.control) for ends in grid.ends]
        every = sum(some.seconds(len(grid.H) * len(grid.given), len(grid.H)) for some in costs)
        yield (
            f"refined   {first:,} points first, the coarse grid and its audit; then where the stable states "
            f"change, at most all: {readable_time(every)} of work"
        )
        if grid.control != "P":
            yield (
                "warning   at prescribed shortening one point of a gap takes as long as all of them: compute "
                "the finest grid instead, without refine"
            )


class Costs(NamedTuple):
    """Seconds that each chunk of points solved together takes, each gap and each point."""

    chunk: float
    gap: float
    point: float

    def of(self, block):
        """Seconds of a block."""
        return self.seconds(block.points, len(set(block.H)) if self.gap else 0)

    def seconds(self, points, gaps):
        """Seconds of points that are solved together, at so many gaps."""
        return self.chunk * ceil(points / CHUNK) + self.gap * gaps + self.point * points


def _event_costs(names, ends):
    """Expected work for the events of states with these ends; they are found at few gaps together."""
    known = [parse_state(name, ends) for name in names if is_canonical(name, ends)]
    springs = SPRINGS if any(not (end.clamped or end.pinned) for end in parse_ends(ends)) else 1.0
    bent = springs * sum(not state.straight for state in known)
    return Costs(SECONDS_PER_EVENTS * bent, SECONDS_PER_EVENTS_AT_GAP * bent, 0.0)


def _costs(task, ends, control):
    """Expected work with these ends."""
    outputs = task.outputs
    known = [parse_state(name, ends) for name in task.names if is_canonical(name, ends)]
    # Line states and words of one root have a closed start, unless all roots are wanted.
    swept = [
        state
        for state in known
        if state.word and (task.every_root or control != "P" or not (state.line or _alternates(state, ends)))
    ]
    springs = SPRINGS if any(not (end.clamped or end.pinned) for end in parse_ends(ends)) else 1.0
    bent = sum(not state.straight for state in known)
    solved = bent if task.every_root else bent / 3
    per_point = (
        SECONDS_PER_STATE * springs * (len(known) - len(swept))
        + SECONDS_PER_EIGENVALUES * ((outputs.eigenvalues > 0) + (outputs.frequencies > 0)) * solved
        + SECONDS_PER_SAMPLE * outputs.shapes * len(known)
        + SECONDS_PER_CHAIN * (task.method.method == "chain") * solved
    )
    if control == "P":
        searching = springs * len(swept)
        return Costs(SECONDS_PER_SWEEP * searching, 0.0, per_point + SECONDS_PER_WORD * searching)
    tracing = springs * sum(len(state.word) for state in swept)
    return Costs(SECONDS_PER_TRACING * tracing, SECONDS_PER_BRANCH * tracing, per_point)


def _rectangular(grid, number, wanted, size):
    """Blocks that are rectangles of labels."""
    row_of, column_of = ({label: i for i, label in enumerate(axis)} for axis in (grid.H, grid.given))
    for gaps, labels in _rectangles(wanted, grid):
        columns = min(len(labels), size)
        # Cut once, so that all blocks of a column share its labels.
        parts = _cut(labels, columns)
        for H in _cut(gaps, max(1, min(len(gaps), size // columns))):
            for given in parts:
                place = number, row_of[H[0]], column_of[given[0]]
                yield Block(place, grid.ends[number], H, grid.control, given)


def _first_places(grid, wanted):
    """Positions of the first points of a refined grid, of those that are wanted."""
    places = first_places((len(grid.H), len(grid.given)), grid.refine)
    if wanted is None:
        return places
    there = wanted[places]
    return tuple(place[there] for place in places)


def _scattered(grid, number, places, size):
    """Blocks of points wherever they are, row by row; under prescribed shortening of whole rows."""
    i, j = (place.tolist() for place in places)
    starts = range(0, len(i), size)
    if grid.control != "P":
        starts = np.unique(i, return_index=True)[1][:: max(1, size // len(grid.given))].tolist()
    for start, end in zip(starts, [*starts, len(i)][1:], strict=True):
        H = tuple(map(grid.H.__getitem__, i[start:end]))
        given = tuple(map(grid.given.__getitem__, j[start:end]))
        yield Scattered((number, i[start], j[start]), grid.ends[number], H, grid.control, given)


def _rectangles(wanted, grid):
    """Labels (H, given) whose products make up the wanted points, bool, shape (H, given); None for all."""
    if wanted is None:
        return [(grid.H, grid.given)]
    rows_of = {}
    for row, columns in enumerate(wanted):
        if columns.any():
            rows_of.setdefault(columns.tobytes(), []).append(row)
    return [
        (
            tuple(grid.H[row] for row in rows),
            tuple(grid.given[column] for column in np.flatnonzero(wanted[rows[0]])),
        )
        for rows in rows_of.values()
    ]


def _cut(labels, size):
    return [labels[i : i + size] for i in range(0, len(labels), size)]


def _alternates(state, ends):
    return state.root == 1 and alternates(state, ends)


def _block_points(costs, task, grid, bytes_per_point):
    """Grid points of a block: some seconds of work that fit into memory."""
    most = max(1, LARGEST_ARRAY // bytes_per_point)
    if grid.control != "P":
        # Branches are traced once for each gap, so whole rows belong together.
        return max(1, min(GAPS_PER_BLOCK, min(most, CHUNK) // len(grid.given))) * len(grid.given)
    contacts = max(name.count("U") + name.count("D") for name in task.names)
    largest = LARGEST_SEARCH if task.every_root and contacts > 1 else LARGEST_BLOCK
    seconds = max(SECONDS_PER_BLOCK, 10 * costs.chunk)
    return min(most, largest, ceil(seconds / max(costs.point, 1e-9)))


def _bytes(study, task, points):
    """Size of a dataset with the number of states expected and this number of points."""
    grid, outputs = study.grid, task.outputs
    labels = coordinates((), (), grid.control, (), task.names, outputs)
    words = sum(name.strip("a-")[0] in "UD" for name in task.names)
    states = len(task.names) + (ROOTS - 1) * words * task.every_root
    return points * sum(
        np.dtype(variable.dtype).itemsize
        * prod(states if dim == "state" else labels[dim].size for dim in variable.dims[3:])
        for variable in variables(labels, outputs).values()
    )
