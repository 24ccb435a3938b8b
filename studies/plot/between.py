"""What is stable, or preferred, between the points of the grid: the solver is asked, but of no state that was
not computed nearby.
"""

from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.paths.stable import stable_energy
from elastica.state import parse_state

ABOVE = 1e-6
"""Part of a load by which what happens at a load is over."""

ABSENT, UNFOLLOWED, FIRST = 0, 1, 2
"""Marks of points without the state, and what is added to values from −1 on, whose marks are larger."""


class Between(NamedTuple):
    """States of one end condition; bit k stands for `names[k]`.

    Attributes
    ----------
    names : list of str
    ends : str
    H, P : ndarray, shape (n,), (m,)
        Labels of the grid.
    computed : ndarray of int, shape (n, m)
        Bits of the states that were computed there.
    """

    names: list
    ends: str
    H: np.ndarray
    P: np.ndarray
    computed: np.ndarray

    def stable(self, H, P, asked):
        """Bits (k,) of those of the states asked for, bits as well, that are stable at H and P (k,)."""
        asked = asked & self._nearby(H, P)
        bits = np.zeros(H.size, np.int64)
        for k, name in enumerate(self.names):
            at = np.flatnonzero(asked >> k & 1)
            if at.size:
                bits[at] |= np.isfinite(stable_energy(name, P[at], H[at], self.ends)).astype(np.int64) << k
        return bits

    def preferred(self, H, P):
        """Bit (k,) of the stable state of least energy: it may be least at no point of the grid around."""
        nearby = self._nearby(H, P)
        least, bits = np.full(H.size, np.inf), np.zeros(H.size, np.int64)
        for k, name in enumerate(self.names):
            energy = np.where(nearby >> k & 1, stable_energy(name, P, H, self.ends), np.nan)
            lower = energy < least
            least[lower], bits[lower] = energy[lower], 1 << k
        return bits

    def beside(self, bits_at, H, P, *asked):
        """Bits that a function gives at H and P (k,), or where those are none, just above.

        Just at the load at which one state hands over to another none is stable, which no picture can show.
        """
        bits = bits_at(H, P, *asked)
        none = np.flatnonzero(bits == 0)
        if none.size:
            bits[none] = bits_at(H[none], P[none] * (1 + ABOVE), *(each[none] for each in asked))
        return bits

    @property
    def free(self):
        """Bits of the free shapes, which may be stable only between two lines of the grid."""
        return sum(1 << k for k, name in enumerate(self.names) if parse_state(name, self.ends).mode)

    def is_stable(self, bit, H, P):
        """Whether the state of a bit is stable at H and P (k,)."""
        return self.stable(H, P, np.full(H.size, bit)) == bit

    def is_preferred(self, bit, H, P):
        """Whether the state of a bit is the preferred one at H and P (k,)."""
        return self.preferred(H, P) == bit

    def preferred_name(self, H, P):
        """Name of the preferred state at H and P (k,), "" where none is stable."""
        # frexp gives the place of a single bit, counted from 1, and 0 of none.
        return np.array(["", *self.names], object)[np.frexp(self.preferred(H, P).astype(float))[1]]

    def _nearby(self, H, P):
        return self.computed[nearest(self.H, H), nearest(self.P, P)]


def nearest(labels, values):
    """Position of the label nearest to each value."""
    return np.searchsorted((labels[1:] + labels[:-1]) / 2, values)


def marks(status, stability, value):
    """What tells apart the regions of a chart of one state's variable.

    Parameters
    ----------
    status, stability : ndarray of int
        Of the state.
    value : ndarray of int
        Of the variable if it has steps, else 0.

    Returns
    -------
    ndarray of int
        ABSENT, UNFOLLOWED, or 2 (value + FIRST), one more where the state is stable.
    """
    solved = 2 * (np.asarray(value, int) + FIRST) + (stability == Stability.STABLE)
    elsewhere = np.where(status == Status.NOT_FOLLOWED, UNFOLLOWED, ABSENT)
    return np.where(status == Status.SOLVED, solved, elsewhere)
