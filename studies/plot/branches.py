"""Branches of states over the load at one gap, cut where their verdict changes, and jumps between them.

Where a strip jumps to is told by what loading paths ask as well (`elastica.paths.quasistatic`).

Of the exact method the cuts are narrowed down and the pieces sampled afresh, densely at both ends, where
folds have vertical tangents. Of a chain, and at prescribed shortening, a piece has the values of the file.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.control import LOAD
from elastica.ends import parse_ends
from elastica.finding import search
from elastica.multisection import narrow
from elastica.paths.quasistatic import Loading
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solving import solve
from studies.plot.boundaries import event_at
from studies.plot.reading import solves_exactly

MOST_READ, SAMPLES = 400, 48
NARROWED = 4
"""How often the interval of the grid around a cut is divided."""
MOST_INDEX = 3
"""Index from which on a branch is only followed through the grid, without narrowing down its cuts."""
SAME = 1e-6
"""Difference of curvature over √p of one and the same equilibrium."""
QUANTITIES = ("P", "shortening", "curvature", "energy", "bending_energy", "reaction")


class Piece(NamedTuple):
    """A part of a state's branch with one verdict.

    Attributes
    ----------
    state : str
    negative, stability : int
        Index and verdict under the control of the dataset.
    events : tuple
        `Boundary` at its first and last point, None at the ends of the grid.
    values : dict of str to ndarray, shape (n,)
        Of each of `QUANTITIES`; of the reactions, their sum.
    """

    state: str
    negative: int
    stability: int
    events: tuple
    values: dict

    def holds(self, control, prescribed):
        """Where it is stable under a control, (n,): fixing the shortening takes away a direction where it
        falls with the load."""
        if self.stability not in (Stability.STABLE, Stability.UNSTABLE):
            return np.zeros(self.values["P"].size, bool)
        P, shortening = self.values["P"], self.values["shortening"]
        if control == prescribed or P.size < 2 or not np.ptp(shortening):
            return np.full(P.size, self.stability == Stability.STABLE)
        along = np.arange(P.size)
        falls = np.gradient(shortening, along) * np.gradient(P, along) < 0
        return self.negative + (falls if control == "P" else -falls.astype(int)) == 0


class Jump(NamedTuple):
    """From where a stable state is lost to where the strip goes.

    Attributes
    ----------
    control : str
        "P" or "shortening".
    state, other_state : str
        `other_state` is "?" where it cannot be told, and the state's own name with a ? where not the state
        ends but following it.
    start, stop : dict
        Values of `QUANTITIES`; `stop` is empty where it cannot be told.
    """

    control: str
    state: str
    other_state: str
    start: dict
    stop: dict


def branches(panel, control):
    """Pieces of all states of a dataset at one end condition and gap.

    Parameters
    ----------
    panel : xarray.Dataset
        With the dimensions control and state.
    control : str

    Returns
    -------
    list of Piece
    """
    step = -(-panel.sizes[control] // MOST_READ)
    panel = panel.isel({control: slice(None, None, step)})
    status = panel["status"].transpose(control, "state").values
    ends, H = str(panel["ends"].values), float(panel["H"].values)
    pieces = []
    for number in np.flatnonzero((status == Status.SOLVED).any(axis=0)):
        name = str(panel["state"].values[number])
        if solves_exactly(panel):
            pieces += _solved(name, ends, H, panel["P"].values)
        else:
            pieces += _stored(name, panel.isel(state=number), control)
    return pieces


def _solved(name, ends, H, loads):
    """Pieces of a state, its cuts narrowed down."""

    def at(P):
        return solve(name, P=P, H=H, ends=ends)

    coarse = at(loads)
    keys = _keys(coarse)
    cut = np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1))
    concerns = (keys[:, 0] == 1) & (keys[:, 1] < MOST_INDEX)
    cut = cut[concerns[cut] | concerns[cut + 1]]
    below, above = narrow(
        lambda P, which: (_keys(at(P)) == keys[cut[which]]).all(axis=1), loads[cut], loads[cut + 1], NARROWED
    )
    firsts, lasts = [loads[0], *above], [*below, loads[-1]]
    pieces = [
        Piece(name, MOST_INDEX, int(Stability.UNSTABLE), (None, None), _values(coarse, run))
        for run in _consecutive((keys[:, 0] == 1) & (keys[:, 1] >= MOST_INDEX), keys)
    ]
    for number, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
        run = keys[[0, *(cut + 1)][number]]
        if not run[0] or run[1] >= MOST_INDEX:
            continue
        P = first + (last - first) * (1 - np.cos(np.linspace(0, np.pi, SAMPLES))) / 2
        s = at(P)
        own = np.flatnonzero((_keys(s) == run).all(axis=1))
        if own.size < 2:
            continue
        events = event_at(s)[own[[0, -1]]]
        events = tuple(
            None if edge in (loads[0], loads[-1]) else event
            for edge, event in zip((first, last), events, strict=True)
        )
        pieces.append(Piece(name, int(run[1]), int(run[2]), events, _values(s, own)))
    return pieces


def _values(solution, at):
    """Quantities of some points of a solution."""
    values = {q: getattr(solution, q)[at] for q in QUANTITIES if q != "reaction"}
    return values | {"reaction": solution.reaction[at].sum(axis=-1)}


def _consecutive(wanted, keys):
    """Runs of wanted points whose keys are the same."""
    places = np.flatnonzero(wanted)
    breaks = (np.diff(places) > 1) | (keys[places[1:]] != keys[places[:-1]]).any(axis=1)
    return [run for run in np.split(places, np.flatnonzero(breaks) + 1) if run.size > 1]


def _keys(solution):
    """What does not change along a piece: whether it is solved, index, verdict, extra periods."""
    solved = solution.status == Status.SOLVED
    plain = np.stack([solved, solution.index, solution.stability], axis=1).astype(int)
    keys = np.hstack([plain, solution.periods])
    keys[~solved] = 0
    return keys


def _stored(name, panel, control):
    """Pieces of a state from the values in a file."""
    found = {q: panel[q].values for q in QUANTITIES if q in panel and panel[q].dims == (control,)}
    found[control] = panel[control].values
    if "reaction" in panel:
        found["reaction"] = panel["reaction"].fillna(0).sum("contact").values
    status, index, stability = (panel[q].values for q in ("status", "index", "stability"))
    keys = np.stack([status, np.where(status == 0, index, -1), np.where(status == 0, stability, -1)], axis=1)
    runs = np.split(np.arange(status.size), np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1)) + 1)
    return [
        Piece(
            name,
            int(index[run[0]]),
            int(stability[run[0]]),
            (None, None),
            {q: values[run] for q, values in found.items()},
        )
        for run in runs
        if status[run[0]] == Status.SOLVED
    ]


def jumps(pieces, control, prescribed, ends, H):
    """Where stable states are lost under a control, and where a strip that is loaded slowly goes from there.

    Parameters
    ----------
    pieces : list of Piece
        Of the exact method.
    control : str
        "P" or "shortening", rising or falling.
    prescribed : str
        The control of the dataset.
    ends : str
    H : float

    Returns
    -------
    list of Jump
        Without those that begin beyond the grid, and without smooth passages.
    """
    least, most = (edge(edge(piece.values[prescribed]) for piece in pieces) for edge in (min, max))
    loading = Loading(parse_ends(ends), H, control)
    arcs = [arc for piece in pieces for arc in _arcs(loading, piece, piece.holds(control, prescribed))]
    found = []
    for arc, upper in product(dict.fromkeys(arcs), (False, True)):
        if arc.state.straight and not upper:
            continue
        lost = arc.end(upper)
        start = {q: values[0] for q, values in _values(lost, slice(None)).items()}
        if not least < start[prescribed] < most:
            continue
        event = loading.passage(arc, upper)
        if event.arc is None:
            name = "?" if event.lost else f"{arc.state.name}?"
            found.append(Jump(control, arc.state.name, name, start, {}))
        elif event.jump:
            there = _values(event.arc.at(np.array([event.given])), slice(None))
            stop = {q: values[0] for q, values in there.items()}
            found.append(Jump(control, arc.state.name, event.arc.state.name, start, stop))
    return found


def _arcs(loading, piece, holds):
    """The arcs of the parts of a piece that are stable."""
    places = np.flatnonzero(holds)
    for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if run.size > 1:
            middle = run[run.size // 2]
            P, curvature = (piece.values[q][middle] for q in ("P", "curvature"))
            name = piece.state.partition(":")[0]
            scene = Scene(loading.ends, np.array([loading.H]))
            for _, _, s in search([name], scene, LOAD, np.array([P])):
                away = np.abs(s.curvature - curvature) / (1 + np.sqrt(FOUR_PI_SQUARED * P))
                arc = loading.through(s, int(away.argmin())) if away.min() < SAME else None
                if arc is not None:
                    yield arc
