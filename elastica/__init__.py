"""Equilibria and stability of an elastic strip between two walls, in closed form.

>>> import elastica
>>> s = elastica.solve("U", P=[2.0, 2.5], H=0.1, ends="clamped-clamped")
>>> s.stability.tolist()
[0, 0]
"""

from elastica.catalogue import FoundStates, find_states
from elastica.codes import Event, Stability, Status
from elastica.solution import Solution, solve
from elastica.states import states
from elastica.strip import Strip
from elastica.transitions import Transitions, transitions

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
