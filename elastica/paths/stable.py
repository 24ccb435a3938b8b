"""Where a state is stable under load, without looking for shapes that cannot be.

An extra period in a segment adds two negative directions, and the condition on the total length takes away
one at most (see `stability`): so a shape with extra periods is never stable under load, and the search for
them, by far the longest part of solving where a state does not exist, can be left out.
"""

import numpy as np

from elastica.codes import Stability
from elastica.control import LOAD
from elastica.ends import parse_ends
from elastica.equilibria.alternating import has_single_root
from elastica.equilibria.lengths import LengthTable
from elastica.equilibria.roots import first
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.solution import solution_of
from elastica.solving import solve
from elastica.state import parse_state


def stable_energy(state: str, P: np.ndarray, H: np.ndarray, ends: str = "clamped-clamped") -> np.ndarray:
    """Energy of a state where it is stable at given load.

    Parameters
    ----------
    state : str
    P, H : ndarray, shape (n,)
    ends : str

    Returns
    -------
    ndarray, shape (n,)
        Total potential L/(4π²EI) V*, NaN where the state does not exist or is not stable.

    Raises
    ------
    ValueError
        If the state or the ends make no sense.

    Examples
    --------
    >>> stable_energy("U", P=np.array([0.5, 2.0, 5.0]), H=np.full(3, 0.1)).round(6)
    array([      nan, -0.025394,       nan])
    """
    ends = parse_ends(ends)
    parsed = parse_state(state, ends)
    if parsed.word and parsed.root == 1 and not parsed.line and has_single_root(parsed.segments(ends)):
        at = np.flatnonzero((P > 0) & (H > 0))
        with np.errstate(all="ignore"):
            found = first(parsed, LengthTable(FOUR_PI_SQUARED * P[at], Scene(ends, H[at])))
            at = at[found.point]
            solution = solution_of(parsed, Scene(ends, H[at]), LOAD, P[at], found)
    else:
        at, solution = np.arange(P.size), solve(state, P=P, H=H, ends=ends)
    energy = np.full(P.size, np.nan)
    stable = solution.stability == Stability.STABLE
    energy[at[stable]] = solution.energy[stable]
    return energy
