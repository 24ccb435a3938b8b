"""What computing costs: seconds of work on one core, and bytes of a dataset.

They decide how a grid is cut and what a user is told, and never a value.

Not here: the cutting (`plan`).
"""

from math import ceil, prod
from typing import NamedTuple

import numpy as np

from elastica.ends import parse_ends
from elastica.equilibria.alternating import has_single_root
from elastica.equilibria.roots import CHUNK
from elastica.state import is_canonical, parse_state
from studies.schema import coordinates, variables

SECONDS_PER_STATE = 6e-6
"""One state at one grid point on one core of 2020–25, from a closed start, until it is stored."""
SECONDS_PER_WORD = 18e-6
"""The same where every root is sought."""
SECONDS_PER_CALL = 0.02
"""What a state costs each chunk of points, however few they are."""
SECONDS_PER_SWEEP = 0.025
"""The same of a word whose every root is sought."""
SECONDS_PER_BRANCH = 0.045
"""Tracing the branches of a word with one contact at one gap, under prescribed shortening."""
SECONDS_PER_TRACING = 0.6
"""What tracing costs each chunk for such a word, however few its gaps."""
SPRINGS = 4.0
"""Factor of what points cost for segments at springs."""
ROOTS = 4
"""More roots than words have on the average, and are solved somewhere, at the loads of usual studies."""
THERE = 1 / 2
"""Share of the bent states, or as many roots of words, that are there at a point."""
SECONDS_PER_CHAIN = 5e-3
"""One state of a chain, with its exact start."""
SECONDS_PER_EIGENVALUES, SECONDS_PER_FREQUENCIES = 30e-6, 65e-6
"""Those of a segment of a state that is there."""
SECONDS_PER_SPECTRUM = 0.04
"""What either costs each chunk for a state, however few the points where it is."""
SECONDS_PER_SAMPLE = 0.5e-6
"""Of the shape of a state that is there: most of it goes into the compression."""
SECONDS_PER_EVENTS, SECONDS_PER_EVENTS_AT_GAP = 0.6, 0.15
"""Finding the events of a state: at a block of gaps, and at each of these."""


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


def costs_of(task, ends, control):
    """Expected work with these ends."""
    outputs = task.outputs
    states, springs = _states(task.names, ends), _factor(ends)
    # Unless all roots are wanted, a closed start need not be sought.
    swept = [
        state
        for state in states
        if state.word and (task.every_root or control != "P" or not _has_closed_start(state, ends))
    ]
    bent = [state for state in states if not state.straight]
    segments = sum(len(state.word) + 1 for state in bent)
    spectra = SECONDS_PER_EIGENVALUES * (outputs.eigenvalues > 0) + SECONDS_PER_FREQUENCIES * (
        outputs.frequencies > 0
    )
    per_point = SECONDS_PER_STATE * springs * (len(states) - len(swept)) + THERE * (
        spectra * springs * segments
        + SECONDS_PER_SAMPLE * outputs.shapes * len(bent)
        + SECONDS_PER_CHAIN * (task.method.method == "chain") * len(bent)
    )
    asked = (outputs.eigenvalues > 0) + (outputs.frequencies > 0)
    per_chunk = SECONDS_PER_CALL * (len(states) - len(swept)) + SECONDS_PER_SPECTRUM * asked * len(bent)
    if control == "P":
        searching = springs * len(swept)
        return Costs(per_chunk + SECONDS_PER_SWEEP * searching, 0.0, per_point + SECONDS_PER_WORD * searching)
    tracing = springs * sum(len(state.word) for state in swept)
    return Costs(per_chunk + SECONDS_PER_TRACING * tracing, SECONDS_PER_BRANCH * tracing, per_point)


def costs_of_events(names, ends):
    """Expected work for the events of states with these ends; they are found at few gaps together."""
    bent = _factor(ends) * sum(not state.straight for state in _states(names, ends))
    return Costs(SECONDS_PER_EVENTS * bent, SECONDS_PER_EVENTS_AT_GAP * bent, 0.0)


def _states(names, ends):
    return [parse_state(name, ends) for name in names if is_canonical(name, ends)]


def _factor(ends):
    """Of the work for states, by that for their segments."""
    return SPRINGS if any(not (end.clamped or end.pinned) for end in parse_ends(ends)) else 1.0


def _has_closed_start(state, ends):
    """Whether a state is a line state, or one of a word that has a single root."""
    return state.line or (state.root == 1 and has_single_root(state.segments(ends)))


def bytes_of(study, task, points):
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
