"""Branches of states over the load at one gap, cut where their verdict changes, and jumps between them.

Of the exact method a piece is followed along its curve (`elastica.paths.curve`) from a point of the grid to
where its verdict changes. Of a chain, and at prescribed shortening, a piece has the values of the file.

Not here: where a strip jumps to, which loading paths ask as well (`elastica.paths.quasistatic`).
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.control import CONTROLS, LOAD
from elastica.ends import parse_ends
from elastica.finding import search
from elastica.paths.curve import Curve, curve_through
from elastica.paths.quasistatic import Loading
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solving import solve
from studies.plot.boundaries import event_at
from studies.plot.reading import solves_exactly

MOST_READ = 400
MOST_INDEX = 3
"""Index from which on a branch is only followed through the grid."""
SHARP = 1e-9
"""Part of κ/√p within which the ends of a piece are found."""
SAME = 1e-6
"""Difference of curvature over √p of one and the same equilibrium, part of a load that is the grid's last."""
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
    solved : callable
        Gives, for the position of a point, a `Solution` and which of its points it is; None if not found.
    """

    state: str
    negative: int
    stability: int
    events: tuple
    values: dict
    solved: Callable

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
    scene = Scene(parse_ends(str(panel["ends"].values)), panel["H"].values.reshape(1))
    pieces = []
    curves: list[Curve] = []
    for number in np.flatnonzero((status == Status.SOLVED).any(axis=0)):
        name = str(panel["state"].values[number])
        if solves_exactly(panel):
            pieces += _followed(name, scene, panel["P"].values, curves)
        else:
            pieces += _stored(name, scene, panel.isel(state=number), control)
    return pieces


def _followed(name, scene, loads, curves):
    """Pieces of a state, followed from points of each run of the grid with one verdict.

    Those that lie on a curve which was followed already are left out, others added to these.
    """
    grid = solve(name, P=loads, H=scene.H, ends=scene.ends)
    verdicts = _verdicts(grid)
    pieces = []
    for run in _runs(np.hstack([verdicts, grid.periods])):
        solved, index, _ = verdict = verdicts[run[0]]
        if not solved:
            continue
        if index >= MOST_INDEX:
            if run.size > 1:
                values = _values(grid, run)
                solved = _by_load(name, scene, values)
                pieces.append(Piece(name, MOST_INDEX, int(Stability.UNSTABLE), (None, None), values, solved))
            continue

        def holds(solution, verdict=verdict):
            within = (solution.P >= loads[0]) & (solution.P <= loads[-1])
            return within & (_verdicts(solution) == verdict).all(axis=1)

        # The roots of a name lie on one curve as a rule, but where another root begins before it.
        for at in run[[run.size // 2, 0, -1]]:
            curve = curve_through(grid, LOAD, at)
            if any(other.passes(curve) for other in curves):
                continue
            curve, _ = curve.followed(holds, SHARP)
            curves.append(curve)
            if curve.t.size > 1:
                pieces.append(_piece(name, curve, loads))
    return pieces


def _piece(name, curve, loads):
    """The piece that a followed curve is, in order of the load."""
    along, _ = curve.at(curve.t, np.arange(curve.t.size))
    order = np.arange(curve.t.size)[:: 1 if along.P[0] < along.P[-1] else -1]
    edges = order[[0, -1]]
    at_last = np.isclose(along.P[edges, None], loads[[0, -1]], SAME, 0).any(axis=1)
    events = tuple(np.where(at_last, None, event_at(along)[edges]))
    middle = order[order.size // 2]

    def solved(at):
        return along, order[at]

    verdict = int(along.index[middle]), int(along.stability[middle])
    return Piece(name, *verdict, events, _values(along, order), solved)


def _values(solution, at):
    """Quantities of some points of a solution."""
    values = {q: getattr(solution, q)[at] for q in QUANTITIES if q != "reaction"}
    return values | {"reaction": solution.reaction[at].sum(axis=-1)}


def _verdicts(solution):
    """Whether it is solved, index and verdict: 0 where it is not, (n, 3)."""
    solved = solution.status == Status.SOLVED
    return np.stack([solved, solution.index * solved, solution.stability * solved], axis=1).astype(int)


def _runs(keys):
    """Runs of points with the same keys (n, …)."""
    breaks = np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1)) + 1
    return np.split(np.arange(len(keys)), breaks)


def _by_load(name, scene, values):
    """How points are solved of which quantities are known: among the roots at their load, by curvature.

    The number of a root at given shortening says nothing at given load, at which solving is faster.
    """

    def solved(at):
        P, curvature = values["P"][[at]], values["curvature"][at]
        for *_, roots in search([name.partition(":")[0]], scene, LOAD, P):
            away = np.abs(roots.curvature - curvature) / (1 + np.sqrt(FOUR_PI_SQUARED * P))
            if away.min() < SAME:
                return roots, int(away.argmin())
        return None

    return solved


def _stored(name, scene, panel, control):
    """Pieces of a state from the values in a file."""
    found = {q: panel[q].values for q in QUANTITIES if q in panel and panel[q].dims == (control,)}
    found[control] = panel[control].values
    if "reaction" in panel:
        found["reaction"] = panel["reaction"].fillna(0).sum("contact").values
    status, index, stability = (panel[q].values for q in ("status", "index", "stability"))
    solved = status == Status.SOLVED
    return [
        Piece(
            name,
            int(index[run[0]]),
            int(stability[run[0]]),
            (None, None),
            {q: values[run] for q, values in found.items()},
            _by_load(name, scene, {q: values[run] for q, values in found.items()}),
        )
        for run in _runs(np.stack([status, index * solved, stability * solved], axis=1))
        if solved[run[0]]
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
    loading = Loading(Scene(parse_ends(ends), np.array([H])), CONTROLS[control])
    held = ((piece, piece.holds(control, prescribed)) for piece in pieces)
    stretches = dict.fromkeys(stretch for part in held for stretch in _stretches(loading, *part))
    found = []
    for stretch, upper in product(stretches, (False, True)):
        if stretch.state.straight and not upper:
            continue
        lost = stretch.end(upper)
        start = {q: values[0] for q, values in _values(lost, slice(None)).items()}
        if not least < start[prescribed] < most:
            continue
        event = loading.passage(stretch, upper)
        if event.stretch is None:
            found.append(Jump(control, stretch.state.name, event.untold, start, {}))
        elif event.jump:
            there = _values(event.stretch.at(np.array([event.value])), slice(None))
            stop = {q: values[0] for q, values in there.items()}
            found.append(Jump(control, stretch.state.name, event.stretch.state.name, start, stop))
    return found


def _stretches(loading, piece, holds):
    """The stretches of the parts of a piece that are stable."""
    places = np.flatnonzero(holds)
    for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if run.size > 1:
            P = piece.values["P"][run]
            middle = run[np.abs(P - (P[0] + P[-1]) / 2).argmin()]
            found = piece.solved(middle)
            stretch = loading.through(*found) if found else None
            if stretch is not None:
                yield stretch
