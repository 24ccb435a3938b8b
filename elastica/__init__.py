"""Equilibria and stability of an elastic strip between two walls, in closed form.

>>> import elastica
>>> s = elastica.solve("U", P=[2.0, 2.5], H=0.1, ends="clamped-clamped")
>>> s.stable.tolist()
[True, True]
>>> s
Solution of U, clamped-clamped, at 2 points, P prescribed
  P    H  status  stability  index  curvature      energy  shortening
  2  0.1  solved     stable      0    1.48141  -0.0253944   0.0261276
2.5  0.1  solved     stable      0    1.17366  -0.0386388   0.0268814

solve        a state at arrays of loads and gaps: its shape, its energy, whether it is stable
find_states  all states at a point
transitions  where a state begins and ends along load or shortening, and what it meets there
states       the names of states
Strip        a real strip: newtons and metres to numbers and back
"""

from elastica.beside import warn_of_pyelastica
from elastica.codes import Event, Stability, Status
from elastica.finding import FoundStates, find_states
from elastica.paths.transitions import Transitions, transitions
from elastica.solution import Solution
from elastica.solving import solve
from elastica.state import states
from elastica.strip import Strip

warn_of_pyelastica(__path__[0])


def __dir__() -> list[str]:
    """What there is for users; modules are found by their own names."""
    return sorted([*__all__, *(name for name in globals() if name.startswith("__"))])


__all__ = [
    "Event",
    "FoundStates",
    "Solution",
    "Stability",
    "Status",
    "Strip",
    "Transitions",
    "find_states",
    "solve",
    "states",
    "transitions",
]
