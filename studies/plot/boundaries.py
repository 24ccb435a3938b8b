"""Exact curves between the regions of a chart, and what happens on each.

What happens is read off the state itself, solved just inside the edge of its region: the quantity that is
about to vanish there names the event.
"""

import numpy as np

from elastica.codes import Status
from elastica.paths.stable import stable_energy
from elastica.solving import solve
from studies.plot.regions import trace
from studies.plot.style import Boundary

NEAR = 1e-3
"""Relative size below which a quantity counts as having vanished, next to an edge."""
SAME = 1e-5
"""Part of a load below which two curves that cross the same edge of the grid are one."""


def curves_between(plane, regions, ends, heir=None):
    """Curves that bound regions of the plane, in pieces of one event each.

    Parameters
    ----------
    plane : Plane
    regions : iterable of (str, ndarray of bool, callable)
        A state with where it holds on the plane, and the exact test of (H, P); see `regions.trace`.
    ends : str
    heir : callable, optional
        If regions are those of preferred states: names (n,) of the preferred one at (H, P), "" for none.

    Returns
    -------
    list of (Boundary, ndarray, ndarray)
        Event, H and P along each piece. A curve that bounds two regions comes once.
    """
    curves = []
    met: dict[int, list[float]] = {}
    for name, inside, holds in regions:
        for within, beyond, edges in trace(plane.H, plane.given, inside, holds):
            events = event_at(_solved(name, within, ends))
            goes_on = _stable(name, beyond, ends) & _stable(name, within, ends)
            lost = np.flatnonzero(events == Boundary.FOLD)
            if lost.size:
                left = _solved(name, beyond[:, lost], ends).status == Status.NOT_FOLLOWED
                lost = lost[left & ~_folds(name, within[:, lost], beyond[:, lost], ends)]
                events[lost] = Boundary.NOT_FOLLOWED
            # What is stable on both sides ends where it was not computed, or leaves its rank to another.
            events[goes_on] = None
            if heir is not None and goes_on.any():
                events[goes_on] = _taken_over(name, within[:, goes_on], beyond[:, goes_on], ends, heir)
            # A label that was copied into a region thinner than the grid bounds nothing.
            events[holds(*beyond)] = None
            new = np.array(
                [
                    all(abs(P - other) > SAME * P for other in met.get(edge, ()))
                    for edge, P in zip(edges, within[1], strict=True)
                ]
            )
            for edge, P in zip(edges, within[1], strict=True):
                met.setdefault(int(edge), []).append(P)
            curves += _pieces(within, np.where(new, events, None))
    return curves


def _folds(name, within, beyond, ends):
    """Whether a state folds at edges: towards a fold all changes as the square root of the distance, so that
    four times the distance is twice the change.
    """
    edge, near, far = (
        _solved(name, within + steps * (within - beyond), ends).shortening for steps in (0, 1000, 4000)
    )
    return np.abs(far - edge) < 3 * np.abs(near - edge)


def _taken_over(name, within, beyond, ends, heir):
    """Events that make another state the preferred one where a state goes on: the birth of the other, or
    equal energies.
    """
    others, energy = heir(*beyond), stable_energy(name, within[1], within[0], ends)
    events = np.full(others.size, None, object)
    for other in set(others.tolist()) - {"", name}:
        at = np.flatnonzero(others == other)
        born = ~_stable(other, within[:, at], ends)
        there = _solved(other, beyond[:, at], ends)
        equal = np.abs(there.energy - energy[at]) < NEAR * np.abs(energy[at])
        events[at[equal]] = Boundary.EQUAL_ENERGY
        events[at[born]] = event_at(there)[born]
    return events


def _solved(name, at, ends):
    return solve(name, P=at[1], H=at[0], ends=ends)


def _stable(name, at, ends):
    return np.isfinite(stable_energy(name, at[1], at[0], ends))


def _pieces(at, events):
    """Runs of one event along a curve, each up to where the next begins."""
    starts = np.flatnonzero([i == 0 or events[i] is not events[i - 1] for i in range(len(events))])
    pieces = []
    for first, last in zip(starts, [*starts[1:], len(events)], strict=True):
        run = slice(max(first - 1, 0) if events[first] is not None else first, last + 1)
        if events[first] is not None and at[:, run].shape[1] > 1:
            pieces.append((events[first], *at[:, run]))
    return pieces


def event_at(solution):
    """The event at each of n edges.

    Parameters
    ----------
    solution : elastica.Solution
        The state just inside of n edges, as close as numbers tell.

    Returns
    -------
    ndarray of Boundary, shape (n,)
    """
    P = np.maximum(solution.P, 1e-12)
    root_p = 2 * np.pi * np.sqrt(P)
    line = solution.flat_length > 0
    if solution.state.straight:
        sizes = {Boundary.BUCKLES: np.zeros_like(P)}
    elif solution.state.mode:
        sizes = {
            Boundary.BUCKLES: solution.shortening / solution.H**2,
            Boundary.WALL_TOUCHED: solution.clearance / solution.H,
        }
    else:
        least = solution.reaction.min(axis=-1, initial=np.inf)
        longer = np.abs(root_p * solution.flat_length / (2 * np.pi) - 1)
        sizes = {
            Boundary.WALL_TOUCHED: np.minimum(least / P, solution.clearance / solution.H),
            Boundary.POINT_TO_LINE: np.where(line, solution.flat_length, solution.curvature / root_p),
            Boundary.FLAT_BUCKLES: np.where(line, longer, np.inf),
            Boundary.RIGHT_ANGLE: np.abs(solution.max_slope / (np.pi / 2) - 1),
        }
    values = np.nan_to_num(np.stack(list(sizes.values())), nan=np.inf)
    events = np.array(list(sizes), object)[values.argmin(axis=0)]
    return np.where(values.min(axis=0) < NEAR, events, np.full_like(events, Boundary.FOLD))
