"""How the closed form finds a state: the equilibria at each point, then all that follows from them.

Not here: chains (`chain`), states whose names are not known (`finding`).
"""

import numpy as np

from elastica.codes import Status
from elastica.control import LOAD
from elastica.equilibria.buckled import unresolved_load
from elastica.equilibria.euler import euler_root
from elastica.equilibria.load_control import PrescribedLoad
from elastica.equilibria.shortening_control import PrescribedShortening
from elastica.properties import bent, straight
from elastica.scales import FOUR_PI_SQUARED
from elastica.solution import Solution, blank, unusable


def equilibria_at(scene, control, prescribed, contacts):
    """What finds the equilibria of any bent state at n points.

    Parameters
    ----------
    scene : Scene
    control : Control
    prescribed : ndarray, shape (n,)
    contacts : int
        Of the longest word that will be asked for.

    Returns
    -------
    PrescribedLoad or PrescribedShortening
    """
    if control == LOAD:
        return PrescribedLoad(FOUR_PI_SQUARED * prescribed, scene)
    return PrescribedShortening(prescribed, scene, contacts)


def solve(state, scene, control, prescribed):
    """A state at n points.

    Parameters
    ----------
    state : State
    scene : Scene
    control : Control
    prescribed : ndarray, shape (n,)

    Returns
    -------
    Solution, shape (n,)
    """
    reasons = unusable(scene, control, prescribed)
    reasons |= _unresolved(state, scene, control, prescribed, reasons)
    usable = np.ones(prescribed.size, bool)
    usable[list(reasons)] = False
    at = np.flatnonzero(usable)
    with np.errstate(all="ignore"):
        found, lost, values = _values(state, scene.at(at), control, prescribed[at])
    arrays = blank(state, scene)
    arrays["status"][usable] = Status.NO_EQUILIBRIUM
    arrays["status"][at[lost]] = Status.NOT_FOLLOWED
    if found.size == prescribed.size:
        arrays |= values
    else:
        for name, value in values.items():
            arrays[name][at[found]] = value
    arrays[control.name] = prescribed
    return Solution(state, scene.ends, control.name, **arrays, reasons=reasons)


def _unresolved(state, scene, control, prescribed, known):
    """Why a shape cannot be told from the separatrix of its pendulum, where no reason is known yet."""
    if control != LOAD:
        return {}
    most = unresolved_load(state, scene.ends) / FOUR_PI_SQUARED
    return {
        int(point): f"P = {prescribed[point]:g}: above {most:.4g} this shape is a loop narrower than numbers "
        "of double precision can tell"
        for point in np.flatnonzero(prescribed >= most)
        if point not in known
    }


def _values(state, scene, control, prescribed):
    """Properties of a state at points at which something possible is prescribed.

    Returns
    -------
    found : ndarray of int
        Where it is an equilibrium.
    lost : ndarray of bool
        Where it may be beyond the end of the search.
    values : dict of str to ndarray
        Where it is.
    """
    if not state.straight:
        search = equilibria_at(scene, control, prescribed, len(state.word))
        found, lost = search.root(state)
        return found.point, lost, bent(state, scene.at(found.point), found, control)
    if control == LOAD:
        at, p = np.arange(prescribed.size), FOUR_PI_SQUARED * prescribed
    else:
        # The straight strip has no shortening, and any load up to the one at which it buckles.
        at = np.flatnonzero(prescribed == 0)
        p = np.full(at.size, float(euler_root(1, scene.ends)) ** 2)
    return at, np.zeros(prescribed.size, bool), straight(p, scene.at(at))
