"""What a chart shows of one end condition: labels of regions or values, as fine as a picture, and curves.

Under load control regions are bounded by exact curves, not by the grid: between grid points that differ the
picture is solved, and so is the load at which each state begins and ceases to be stable. At prescribed
shortening, and of a chain, every point of the picture takes what the nearest grid point has.

Not here: reading the grid (`reading`), asking the solver (`between`), tracing curves (`boundaries`), drawing.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from elastica.codes import Status
from elastica.paths.stable import stable_energy
from elastica.solving import solve
from studies.errors import StudyError
from studies.plot.between import FIRST, UNFOLLOWED, Between, marks, nearest
from studies.plot.boundaries import curves_between
from studies.plot.reading import preferred, stable_sets
from studies.plot.regions import Plane, fill, sharpen, spread
from studies.schema import VARIABLES


class Picture(NamedTuple):
    """What one panel shows.

    Attributes
    ----------
    ends : str
    H, given : ndarray, shape (n,), (m,)
    labels : ndarray, shape (n, m)
        Numbers of regions, or values.
    meaning : dict of int to tuple of str
        Names of the states of each label, or of their count; empty of values.
    curves : list of (Boundary, ndarray, ndarray)
        Event, H and control along each curve.
    unknown : list of str
        States that were not computed, or only in part.
    none, unfollowed : ndarray of bool, shape (n, m)
        Where none of the states searched is stable; where the search for one of them ended before it could
        tell.
    """

    ends: str
    H: np.ndarray
    given: np.ndarray
    labels: np.ndarray
    meaning: dict
    curves: list
    unknown: list
    none: np.ndarray
    unfollowed: np.ndarray

    def shown(self, units, control, variable):
        """The picture in the units of a dataset."""
        curves = [
            (event, units.shown("H", H), units.shown(control, given)) for event, H, given in self.curves
        ]
        return self._replace(
            H=units.shown("H", self.H),
            given=units.shown(control, self.given),
            labels=units.shown(variable, self.labels),
            curves=curves,
        )


def picture_of_regions(panel, show, exact):
    """The regions in which the same states are stable, or preferred, or as many.

    Parameters
    ----------
    panel : Panel
    show : str
        "stable", "preferred" or "count".
    exact : bool
        Whether what lies between the points of the grid is solved.

    Returns
    -------
    Picture
    """
    H, given = panel.axes
    sets = stable_sets(panel)
    solver = Between(sets.names, panel.ends, H, given, fill(sets.computed, sets.known))
    if show == "preferred":
        sets = preferred(panel, sets)
    # Points that were not computed take what the nearest has.
    plane, curves = Plane(H, given, fill(sets.bits, sets.known)), []
    if exact:
        plane, curves = _solved(plane, solver, show == "preferred")
    else:
        plane = spread(plane)
    labels = plane.labels
    unfollowed = (labels == 0) & _taken(fill(sets.unfollowed, sets.known), panel, plane)
    none = (labels == 0) & ~unfollowed
    if show == "count":
        labels = np.bitwise_count(labels.astype(np.uint64)).astype(int)
        meaning = {int(n): (str(n),) for n in np.unique(labels)}
    else:
        meaning = {
            int(b): tuple(name for k, name in enumerate(sets.names) if b >> k & 1) for b in np.unique(labels)
        }
    return Picture(panel.ends, plane.H, plane.given, labels, meaning, curves, sets.unknown, none, unfollowed)


def _solved(plane, solver, only_preferred):
    """The plane solved between points that differ, and the curves between its regions."""
    if only_preferred:
        holds, heir = solver.is_preferred, solver.preferred_name

        def decide(H, P, near):
            return solver.beside(solver.preferred, H, P)

    else:
        holds, heir = solver.is_stable, None

        def decide(H, P, near):
            return solver.beside(solver.stable, H, P, near[0] | near[1] | solver.free)

    plane = sharpen(plane, decide)
    bounded = [
        (name, plane.labels >> k & 1 == 1, partial(holds, 1 << k)) for k, name in enumerate(solver.names)
    ]
    return plane, curves_between(plane, bounded, solver.ends, heir)


def picture_of_values(panel, variable, position, exact):
    """Values of a variable of one state where it is an equilibrium, and the curves that bound it.

    Parameters
    ----------
    panel : Panel
    variable : str
    position : int
        Of the state.
    exact : bool
        Whether what lies between the points of the grid is solved.

    Returns
    -------
    Picture

    Raises
    ------
    StudyError
        If the state is solved nowhere.
    """
    H, given = panel.axes
    name = panel.states[position]
    status, values = panel.read("status", position), panel.read(variable, position).astype(float)
    there = status == Status.SOLVED if variable != "status" else status != Status.NOT_COMPUTED
    if not there.any():
        raise StudyError(f"state = {name!r} is solved nowhere for {panel.ends}; there is nothing to draw")
    smooth = variable in VARIABLES and VARIABLES[variable].dtype == "f8"
    # Flags and counts change where nothing else does: their borders are looked for as well.
    steps = variable if variable in ("index", "nullity", "stability") else None
    known = marks(status, panel.read("stability", position), panel.read(steps, position) if steps else 0)
    plane = Plane(H, given, fill(known, status != Status.NOT_COMPUTED))
    curves = []
    if exact and variable != "status":

        def marked(H, P, around=None):
            between = solve(name, P=P, H=H, ends=panel.ends)
            return marks(between.status, between.stability, getattr(between, steps) if steps else 0)

        def solved(H, P):
            return marked(H, P) > UNFOLLOWED

        def stable(H, P):
            return np.isfinite(stable_energy(name, P, H, panel.ends))

        plane = sharpen(plane, marked)
        shown = plane.labels > UNFOLLOWED
        firm = shown & (plane.labels % 2 == 1)
        curves = curves_between(plane, [(name, shown, solved), (name, firm, stable)], panel.ends)
    else:
        shown = fill(there, status != Status.NOT_COMPUTED)
    if exact and steps:
        values = np.where(shown, plane.labels // 2 - FIRST, np.nan)
    else:
        filled = fill(values, there)
        look = RegularGridInterpolator((H, given), filled, method="linear" if smooth else "nearest")
        points = np.stack(np.meshgrid(plane.H, plane.given, indexing="ij"), axis=-1)
        values = np.where(shown, look(points), np.nan)
    unfollowed = (plane.labels == UNFOLLOWED) & ~shown
    return Picture(
        panel.ends, plane.H, plane.given, values, {}, curves, [], np.zeros_like(unfollowed), unfollowed
    )


def _taken(values, panel, plane):
    """Values of the points of a picture, taken from the nearest of the grid."""
    return values[np.ix_(*(nearest(*axes) for axes in zip(panel.axes, plane[:2], strict=True)))]
