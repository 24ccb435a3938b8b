"""Where states begin, end, change their stability and meet: events along load or shortening at given gaps.

A state is followed along its curves (`curve`), which tell where something happens; here, to which side of it.

What a state meets is looked up among its neighbours: the words with a contact more, less, or of other kind,
that have the same energy and shape next to the event.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from elastica.codes import Event, Status
from elastica.control import CONTROLS, LOAD
from elastica.ends import Ends, parse_ends
from elastica.equilibria.alternating import has_single_root
from elastica.equilibria.euler import euler_root
from elastica.exact import equilibria_at
from elastica.finding import search
from elastica.inputs import read_number, read_numbers
from elastica.paths.tracing import curves
from elastica.rows import Rows
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solution import SMALLEST_GAP
from elastica.spelling import did_you_mean
from elastica.state import is_canonical, parse_state

LARGEST_P = 100.0
ASIDE = 1e-3
"""Part of t and of its interval by which a state is looked at beside an event: next to a fold its two roots
must be told apart."""
SAME_EVENT = 1e-9
"""Relative distance in t below which two events are one; farther, none is looked at from beyond the next."""
NEXT_TO, NARROW = 1e-9, 1e-3
"""Relative distance in load at which what is met is looked up, at gaps from this one; at narrower ones shapes
change with the load over H²."""
SAME_ENERGY, SAME_CURVATURE = 1e-4, 1e-2
"""Differences that one shape may have by then, in units of the load's work and of the root mean square of its
curvature: they hold at gaps however narrow."""


@dataclass(frozen=True, eq=False, repr=False)
class Transitions(Rows):
    """Events, one row each, by gap and then by what is controlled.

    ``for event in transitions(…)`` gives one row after the other, `to_dataframe` a table of pandas.

    Attributes
    ----------
    ends : Ends
    control : str
    H, P, shortening : ndarray, shape (rows,)
        Where it happens.
    state, other_state : ndarray of str, shape (rows,)
        The state, and what it meets there; empty where that is not among the states searched.
    event : ndarray of int8, shape (rows,)
        Codes of `Event`.
    index_before, index_after : ndarray of int16, shape (rows,)
        Index of the state just below and above, −1 where it does not exist.
    """

    row_name = "Transition"
    columns = (
        "H",
        "P",
        "shortening",
        "state",
        "other_state",
        "event",
        "index_before",
        "index_after",
    )

    ends: Ends
    control: str
    H: np.ndarray
    P: np.ndarray
    shortening: np.ndarray
    state: np.ndarray
    other_state: np.ndarray
    event: np.ndarray
    index_before: np.ndarray
    index_after: np.ndarray

    def __str__(self) -> str:
        """One line an event."""
        lines = [f"{'H':>10} {'P':>16} {'shortening':>14}  {'state':<8} {'event':<14} index       meets"]
        for row in range(len(self)):
            before, after = (i if i >= 0 else "none" for i in (self.index_before[row], self.index_after[row]))
            lines.append(
                f"{self.H[row]:>10.6g} {self.P[row]:>16.12g} {self.shortening[row]:>14.9g}  "
                f"{self.state[row]:<8} {Event(self.event[row])!s:<14} "
                f"{before!s:>4} -> {after!s:<4} {self.other_state[row]}"
            )
        return "\n".join(lines)


def transitions(
    state: str,
    H: ArrayLike,
    ends: str | Ends = "clamped-clamped",
    control: str = "P",
    P_max: float = 12.0,
) -> Transitions:
    """Events of a state along load or shortening at each gap.

    Parameters
    ----------
    state : str
    H : array_like
        Half gaps, between 0 and 0.5.
    ends : str
    control : str
        "P" (default) or "shortening".
    P_max : float
        Events at loads up to this one.

    Returns
    -------
    Transitions

    Raises
    ------
    ValueError
        If the state, the ends, the control or a gap makes no sense.

    Examples
    --------
    >>> events = transitions("U", H=0.1)
    >>> [Event(code).name for code in events.event[:2]], events.P[:2].round(9).tolist()
    (['REACTION_LOST', 'POINT_TO_LINE'], [1.012712706, 3.937821184])
    """
    ends = parse_ends(ends)
    state = parse_state(state, ends)
    if control not in tuple(CONTROLS):
        question = did_you_mean(control, tuple(CONTROLS))
        raise ValueError(f'control = {control!r} is not known{question}; use "P" or "shortening"')
    P_max = read_number("P_max", P_max)
    if not 0 < P_max <= LARGEST_P:
        raise ValueError(f"P_max = {P_max!r} is not possible; give a load above 0, up to {LARGEST_P:g}")
    H = np.unique(read_numbers("H", H))
    if not ((H >= SMALLEST_GAP) & (H < 0.5)).all():
        raise ValueError(
            f"H = {H.tolist()} is not possible; give half gaps from {SMALLEST_GAP:g} to below 0.5"
        )
    scene = Scene(ends, H)
    with np.errstate(all="ignore"):
        rows = _straight(scene, P_max) if state.straight else _bent(state, scene, CONTROLS[control], P_max)
        rows = [row for row in rows if row["P"] <= P_max]
        columns = {name: np.array([row[name] for row in rows]) for name in ROW}
        columns["other_state"] = _met(state, ends, control, columns) if rows else np.zeros(0, str)
    keys = list(zip(*(columns[name].tolist() for name in KEY), strict=True))
    # Contacts that lose their reaction together are one event.
    once = np.array([i for i, key in enumerate(keys) if key not in keys[:i]], int)
    columns = {name: values[once] for name, values in columns.items()}
    order = np.lexsort((columns[control], columns["H"]))
    columns = {name: columns[name][order] for name in Transitions.columns}
    return Transitions(ends, control, **columns)


PASSED = (Event.RIGHT_ANGLE, Event.ENDS_MEET)
"""What a state may pass as it goes on: then it is one row, with the index on either side."""
KEY = ("H", "P", "event", "index_before", "index_after")
SHAPE = ("energy", "curvature")
"""Of the state at the event, by which what it meets is told."""
ROW = (*Transitions.columns, *SHAPE)


def _row(*values):
    return dict(zip(ROW, values, strict=True))


def _straight(scene, P_max):
    """The straight strip loses one direction at each Euler load."""
    modes = int(2 * np.sqrt(P_max)) + 1
    loads = euler_root(np.arange(1, modes + 1), scene.ends) ** 2 / FOUR_PI_SQUARED
    return [
        _row(gap, load, 0.0, "0", f"B{mode + 1}", Event.BUCKLES, mode, mode + 1, 0.0, 0.0)
        for gap in scene.H
        for mode, load in enumerate(loads)
    ]


def _buckles(state, scene):
    """A free mode begins at its Euler load, above it: with the index of the straight strip below."""
    load = float(euler_root(state.mode, scene.ends)) ** 2 / FOUR_PI_SQUARED
    return [
        _row(gap, load, 0.0, state.name, "0", Event.BUCKLES, -1, state.mode - 1, 0.0, 0.0) for gap in scene.H
    ]


def _bent(state, scene, control, P_max):
    """Events of every pattern of a state; of its roots, that with the state's own number."""
    rows = _buckles(state, scene) if state.mode else []
    for curve in curves(state, scene, control, P_max):
        events = curve.events()
        gap = curve.gap[events.near]
        apart = np.abs(events.t[:, None] - events.t)
        others = (gap[:, None] == gap) & (apart > SAME_EVENT * events.t[:, None])
        nearest = np.where(others, apart, np.inf).min(axis=1, initial=np.inf)
        aside = np.minimum(ASIDE * (events.high - events.low + events.t), nearest / 2)
        rows += _described(curve, state, events, aside)
    return rows


def _described(curve, state, events, aside):
    """Rows of events: one for each side on which the state exists, at a flat stretch one for both."""
    if not events.t.size:
        return []
    near, t, control = events.near, events.t, curve.control.name
    here, points = curve.at(t, near)
    first, last = (np.searchsorted(curve.gap, curve.gap[near], side=side) for side in ("left", "right"))
    begin, end = curve.t[first], curve.t[last - 1]
    sides = []
    # Never past the end of the branch, unless it is the event.
    low, high = (np.where(room > 0, np.minimum(aside, room / 2), aside) for room in (t - begin, end - t))
    for beside in (t - low, t + high):
        inside = (beside >= begin) & (beside <= end)
        solution, solved = curve.at(np.where(inside, beside, t), near)
        exists = inside & solved.found & points.found & (solution.status == Status.SOLVED)
        exists &= _number(state, solution, exists) == state.root
        sides.append((solution, exists))
    rows = []
    for i, event in enumerate(events.event):
        place = here.H[i], float(here.P[i]), float(here.shortening[i]), state.name, "", event
        shape = float(here.energy[i]), float(here.curvature[i])
        beyond = [int(solution.index[i]) if exists[i] else -1 for solution, exists in sides]
        if event == Event.FLAT_BUCKLES or (event in PASSED and min(beyond) >= 0):
            if max(beyond) >= 0:
                rises = getattr(sides[1][0], control)[i] >= getattr(sides[0][0], control)[i]
                before, after = beyond if rises else beyond[::-1]
                rows.append(_row(*place, before, after, *shape))
            continue
        for (solution, exists), index in zip(sides, beyond, strict=True):
            if exists[i]:
                above = getattr(solution, control)[i] > getattr(here, control)[i]
                rows.append(_row(*place, *((-1, index) if above else (index, -1)), *shape))
    return rows


def _number(state, solution, wanted):
    """Numbers of the roots that a solution has found, 0 where not wanted."""
    numbers, ends = np.zeros(wanted.size, int), solution.ends
    own = np.flatnonzero(wanted)
    if state.mode:
        numbers[own] = 1
    elif own.size and has_single_root(state.segments(ends)) and not solution.periods[own].any():
        # Next to its fold a search may miss it, but there is no other.
        numbers[own] = 1
    elif own.size:
        scene, control = Scene(ends, solution.H[own]), CONTROLS[solution.control]
        prescribed = getattr(solution, control.name)[own]
        found, _ = equilibria_at(scene, control, prescribed, len(state.word)).every(state)
        away = np.abs(found.kappa - solution.curvature[own][found.point])
        same = (found.periods.T == solution.periods[own][found.point]).all(axis=1)
        same &= away < 1e-6 * np.sqrt(found.p)
        numbers[own[found.point[same]]] = found.number[same]
    return numbers


def _met(state, ends, control, columns):
    """Name of the state with the same energy and curvature next to each event, on its other side if there.

    At prescribed shortening without the number of the root.
    """
    met = columns["other_state"].astype("<U64")
    best = np.where(np.isin(columns["event"], (*PASSED, Event.BUCKLES)), -1.0, np.inf)
    P, H = columns["P"], columns["H"]
    work = P * columns["shortening"]
    below, above = next_to(P, H)
    for beside, here in (
        (below, columns["index_before"] >= 0),
        (above, columns["index_after"] >= 0),
    ):
        for points, numbers, solution in search(neighbours(state, ends), Scene(ends, H), LOAD, beside):
            name = solution.state.name
            energy, curvature = (columns[field][points] for field in SHAPE)
            apart = distance(solution, energy, curvature, work[points])
            good = (solution.status == Status.SOLVED) & np.isfinite(apart)
            good &= ~((name == state.name.partition(":")[0]) & (numbers == state.root))
            for i in np.flatnonzero(good):
                rank = apart[i] + here[points[i]]
                if rank < best[points[i]]:
                    best[points[i]] = rank
                    numbered = numbers[i] > 1 and control == "P"
                    met[points[i]] = f"{name}:{numbers[i]}" if numbered else name
    return met


def next_to(P, H):
    """Loads just below and just above events at gaps, each of shape (n,)."""
    aside = NEXT_TO * np.minimum(1, H / NARROW) ** 2
    return P * (1 - aside), P * (1 + aside)


def distance(found, energy, curvature, work):
    """How unlike equilibria `next_to` an event are to the state there.

    Parameters
    ----------
    found : Solution
        Of n equilibria.
    energy, curvature, work : ndarray, shape (n,) or (1,)
        Of the state: energy V, κ, and P ΔL.

    Returns
    -------
    ndarray, shape (n,)
        Infinite unless they have the same shape at the event.
    """
    bent = 2 * np.pi * np.sqrt(2 * (energy + work))
    off, turned = np.abs(found.energy - energy) / work, np.abs(found.curvature - curvature) / bent
    return np.where((off < SAME_ENERGY) & (turned < SAME_CURVATURE), off + turned, np.inf)


@cache
def neighbours(state, ends):
    """Names of the word, of those with a contact more or less, and of free shapes."""
    word = state.word
    words = {word, *(word[:i] + word[i + 1 :] for i in range(len(word)))}
    words |= {word[:i] + letter + word[i:] for i in range(len(word) + 1) for letter in "UD"}
    if state.mode > 1:
        words |= {"UD", "UDU"}
    names = ["0", *(f"B{mode}" for mode in range(1, max(len(word), state.mode) + 4))]
    for some in sorted(words - {""}):
        names += [a + some + b + line for a, b, line in product(("", "a"), ("", "a"), ("", "-"))]
    canonical_names = (name for name in names if is_canonical(name, ends))
    return tuple(dict.fromkeys(canonical_names))
