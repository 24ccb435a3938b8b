"""Equilibria of states at a prescribed load: the search of `roots`, with what different words share.

Not here: a prescribed shortening (`shortening_control`).
"""

from functools import cached_property

import numpy as np

from elastica.equilibria.lengths import LengthTable
from elastica.equilibria.roots import every, find


class PrescribedLoad:
    """Prescribed loads at n points.

    Parameters
    ----------
    p : ndarray, shape (n,)
        Thrust p = 4π²P ≥ 0; finite.
    scene : Scene
        Of the n points.
    """

    def __init__(self, p, scene):
        self.p, self.scene = p, scene

    @cached_property
    def _pressed(self):
        """Points with a load, on which alone a strip can be bent, and their table."""
        at = np.flatnonzero(self.p > 0)
        return at, LengthTable(self.p[at], self.scene.at(at))

    def root(self, state):
        """The root that a state's name has; see `roots.find`."""
        return find(state, self.p, self.scene)

    def every(self, state):
        """Every root of a state, by increasing κ; see `roots.every`."""
        if state.mode:
            return find(state, self.p, self.scene)[0], np.zeros(self.p.size, bool)
        at, table = self._pressed
        beyond = np.zeros(self.p.size, bool)
        found, beyond[at] = every(state, table.p, table.scene, table)
        return found._replace(point=at[found.point]), beyond
