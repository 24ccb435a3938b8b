"""Where states begin, end, change their stability and meet: events along load or shortening at given gaps.

A state is followed along its branch, on which everything is a smooth function of one parameter t (`tracks`).
Each event is a root of such a function:

    wall touched      H − |y| of a bump                   reaction lost     μ of a contact
    point to line     κ, or in the line regime the length left over
    fold              dP/dt, at prescribed shortening dΔL/dt
    flat buckles      √p ℓ_f − 2π
    right angle       90° − |θ|, beyond which only branches that alternate, lines and free shapes are followed
    ends meet         1 − ΔL of a free shape

What a state meets is looked up among its neighbours: the words with a contact more, less, or of other kind,
that have the same energy and shape next to the event.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize.elementwise import find_root

from elastica.codes import Event, Status
from elastica.control import CONTROLS, LOAD
from elastica.ends import Ends, parse_ends
from elastica.equilibria.alternating import has_single_root
from elastica.equilibria.euler import euler_root
from elastica.exact import equilibria_at
from elastica.finding import search
from elastica.inputs import read_number, read_numbers
from elastica.paths.tracks import tracks
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
NEXT_TO = 1e-9
"""Relative distance in load at which what is met is looked up: at narrow gaps shapes change fast with it."""
SAME_ENERGY, SAME_CURVATURE = 1e-4, 1e-2
"""Relative difference of energy, and of curvature in units of √p, that one shape may have by then."""


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
    if control not in ("P", "shortening"):
        question = did_you_mean(control, ("P", "shortening"))
        raise ValueError(f'control = {control!r} is not known{question}; use "P" or "shortening"')
    P_max = read_number("P_max", P_max)
    if not 0 < P_max <= LARGEST_P:
        raise ValueError(f"P_max = {P_max!r} is not possible; give a load above 0, up to {LARGEST_P:g}")
    H = np.unique(read_numbers("H", H))
    if not ((H >= SMALLEST_GAP) & (H < 0.5)).all():
        raise ValueError(
            f"H = {H.tolist()} is not possible; give half gaps from {SMALLEST_GAP:g} to below 0.5"
        )
    with np.errstate(all="ignore"):
        rows = _straight(ends, H, P_max) if state.straight else _bent(state, ends, H, control, P_max)
        rows = [row for row in rows if row["P"] <= P_max]
        columns = {name: np.array([row[name] for row in rows]) for name in ROW}
        columns["other_state"] = _met(state, ends, control, columns) if rows else np.zeros(0, str)
    keys = list(zip(*(columns[name].tolist() for name in KEY), strict=True))
    # Contacts that lose their reaction together are one event.
    once = np.array([i for i, key in enumerate(keys) if key not in keys[:i]], int)
    columns = {name: values[once] for name, values in columns.items()}
    order = np.lexsort((columns[control], columns["H"]))
    columns = {name: columns[name][order] for name in columns if name not in ("energy", "curvature")}
    return Transitions(ends, control, **columns)


PASSED = (Event.RIGHT_ANGLE, Event.ENDS_MEET)
"""What a state may pass as it goes on: then it is one row, with the index on either side."""
KEY = ("H", "P", "event", "index_before", "index_after")
ROW = ("H", "P", "shortening", "state", "event", "index_before", "index_after", "energy", "curvature")


def _row(H, P, shortening, state, event, before, after, energy, curvature):
    return dict(zip(ROW, (H, P, shortening, state, event, before, after, energy, curvature), strict=True))


def _straight(ends, H, P_max):
    """The straight strip loses one direction at each Euler load."""
    modes = int(2 * np.sqrt(P_max)) + 1
    loads = euler_root(np.arange(1, modes + 1), ends) ** 2 / FOUR_PI_SQUARED
    return [
        _row(gap, load, 0.0, "0", Event.BUCKLES, mode, mode + 1, 0.0, 0.0)
        for gap in H
        for mode, load in enumerate(loads)
    ]


def _buckles(state, ends, H):
    """A free mode begins at its Euler load, above it: with the index of the straight strip below."""
    load = float(euler_root(state.mode, ends)) ** 2 / FOUR_PI_SQUARED
    return [_row(gap, load, 0.0, state.name, Event.BUCKLES, -1, state.mode - 1, 0.0, 0.0) for gap in H]


def _bent(state, ends, H, control, P_max):
    """Events of every pattern of a state; of its roots, that with the state's own number."""
    rows = _buckles(state, ends, H) if state.mode else []
    for track in tracks(state, ends, H, control, P_max):
        if track.t.size < 2:
            continue
        _, values, found = track.at(np.arange(track.t.size), track.t)
        values = np.where(found, values, np.nan)
        for sample, event in track.ends_at.items():
            # What ends a branch is zero there to rounding.
            values[[i for i, other in enumerate(track.events) if other == event], sample] = np.nan
        happens = [*_ends_of(track)]
        happens += [_roots_of(track, i, event, values[i]) for i, event in enumerate(track.events)]
        gap = np.concatenate([track.gap[samples] for _, samples, *_ in happens])
        t = np.concatenate([at for _, _, at, *_ in happens])
        for event, samples, at, low, high in happens:
            apart = np.abs(at[:, None] - t)
            others = (track.gap[samples][:, None] == gap) & (apart > SAME_EVENT * at[:, None])
            nearest = np.where(others, apart, np.inf).min(axis=1, initial=np.inf)
            aside = np.minimum(ASIDE * (high - low + at), nearest / 2)
            rows += _describe(track, samples, at, aside, event, state, ends, H, control)
    return rows


def _roots_of(track, number, event, values):
    """Roots of one function, with these `values` at the samples, between neighbours.

    Returns
    -------
    event : Event
    samples : ndarray of int, shape (n,)
    t, low, high : ndarray, shape (n,)
    """
    sign = np.where(np.isnan(values), np.nan, np.where(values < 0, -1.0, 1.0))
    left = np.flatnonzero((track.gap[:-1] == track.gap[1:]) & (sign[:-1] * sign[1:] < 0))
    low, high = track.t[left], track.t[left + 1]
    root = find_root(lambda t, sample: track.at(sample, t)[1][number], (low, high), args=(left,))
    # A sample that is itself a root to rounding brackets nothing.
    nearer = np.where(np.abs(values[left]) < np.abs(values[left + 1]), low, high)
    t = np.where(root.success, root.x, nearer)
    return event, left, t, low, high


def _ends_of(track):
    """The ends of the branches, as `_roots_of` gives roots."""
    ends_at = track.ends_at.items()
    for event in {event for _, event in ends_at}:
        at = np.array([sample for sample, e in ends_at if e == event])
        inner = np.where(
            (at + 1 < track.t.size) & (track.gap[np.minimum(at + 1, track.t.size - 1)] == track.gap[at]),
            at + 1,
            at - 1,
        )
        t = track.t[at]
        low, high = np.minimum(t, track.t[inner]), np.maximum(t, track.t[inner])
        yield event, at, t, low, high


def _describe(track, samples, t, aside, event, state, ends, H, control):
    """Rows of events at t: one for each side on which the state exists, at a flat stretch one for both."""
    if not t.size:
        return []
    here, _, found = track.at(samples, t)
    gap = track.gap[samples]
    first, last = (np.searchsorted(track.gap, gap, side=side) for side in ("left", "right"))
    sides = []
    # Never past the end of the branch, unless it is the event.
    room = t - track.t[first], track.t[last - 1] - t
    low, high = (np.where(some > 0, np.minimum(aside, some / 2), aside) for some in room)
    for beside in (t - low, t + high):
        inside = (beside >= track.t[first]) & (beside <= track.t[last - 1])
        solution, _, solved = track.at(samples, np.where(inside, beside, t))
        exists = inside & solved & found & (solution.status == Status.SOLVED)
        exists &= _number(state, ends, solution, exists) == state.root
        sides.append((solution, exists))
    rows = []
    for i in range(t.size):
        place = (H[track.gap[samples[i]]], float(here.P[i]), float(here.shortening[i]), state.name, event)
        shape = float(here.energy[i]), float(here.curvature[i])
        beyond = [int(solution.index[i]) if exists[i] else -1 for solution, exists in sides]
        if event == Event.FLAT_BUCKLES or (event in PASSED and min(beyond) >= 0):
            if max(beyond) >= 0:
                rises = getattr(sides[1][0], control)[i] >= getattr(sides[0][0], control)[i]
                rows.append(_row(*place, *(beyond if rises else beyond[::-1]), *shape))
            continue
        for (solution, exists), index in zip(sides, beyond, strict=True):
            if exists[i]:
                above = getattr(solution, control)[i] > getattr(here, control)[i]
                rows.append(_row(*place, *((-1, index) if above else (index, -1)), *shape))
    return rows


def _number(state, ends, solution, wanted):
    """Numbers of the roots that a solution has found, 0 where not wanted."""
    numbers = np.zeros(wanted.size, int)
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
    met = np.full(columns["H"].size, "", dtype="<U64")
    best = np.where(np.isin(columns["event"], PASSED), -1.0, np.inf)
    P, H = columns["P"], columns["H"]
    for beside, here in (
        (1 - NEXT_TO, columns["index_before"] >= 0),
        (1 + NEXT_TO, columns["index_after"] >= 0),
    ):
        for points, numbers, solution in search(neighbours(state, ends), Scene(ends, H), LOAD, P * beside):
            name = solution.state.name
            apart = distance(solution, columns["energy"][points], columns["curvature"][points])
            good = (solution.status == Status.SOLVED) & np.isfinite(apart)
            good &= ~((name == state.name.partition(":")[0]) & (numbers == state.root))
            for i in np.flatnonzero(good):
                rank = apart[i] + here[points[i]]
                if rank < best[points[i]]:
                    best[points[i]] = rank
                    numbered = numbers[i] > 1 and control == "P"
                    met[points[i]] = f"{name}:{numbers[i]}" if numbered else name
    return met


def distance(found, energy, curvature):
    """How unlike equilibria `NEXT_TO` an event are to the state there, by energy and by curvature over √p.

    Parameters
    ----------
    found : Solution or FoundStates
        Of n equilibria.
    energy, curvature : array_like, shape (n,) or ()

    Returns
    -------
    ndarray, shape (n,)
        Infinite unless they have the same shape at the event.
    """
    off = np.abs(found.energy - energy) / np.maximum(np.abs(found.energy), 1e-6)
    turned = np.abs(found.curvature - curvature) / np.sqrt(1 + 40 * found.P)
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
