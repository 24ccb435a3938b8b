"""The lowest eigenvalues and frequencies of a chain in equilibrium, by Lanczos on O(N) solves.

Eigenvalues that are exactly zero in the strip are given as 0.0, whatever the chain makes of them.

Not here: the algebra (`bordered`), what a sign means (`verdict`).
"""

import numpy as np

from elastica.chain.bordered import count_below, lowest
from elastica.chain.verdict import exact_zeros, tolerance
from elastica.chain.vibration import squared_frequencies
from elastica.control import LOAD


def floor(state):
    """A number below all eigenvalues of T: minus the largest thrust in a link, and some more."""
    thrust = state.pieces.chain.thrust(state.theta, state.p, state.lam)
    return -1.05 * max(float(thrust.max()), 0.0) - 1.0


def eigenvalues(state, setting, count, control=LOAD):
    """The `count` lowest eigenvalues of Q, ascending.

    Parameters
    ----------
    state : Equilibrium
    setting : Setting
    count : int
    control : Control

    Returns
    -------
    ndarray, shape (count,)
        NaN for those that the chain does not have.
    """
    zeros, _ = exact_zeros(state)
    found = lowest(setting.second_variation(state, control=control), floor(state), count + zeros)
    return _with_zeros(found, zeros, tolerance(state, setting))[:count]


def conventional(state, setting, count):
    """Lowest eigenvalues (count,) and index with contacts held at their material points."""
    form = setting.second_variation(state, contacts_move=False)
    zeros, _ = exact_zeros(state)
    slack = tolerance(state, setting) if zeros else 0.0
    found = _with_zeros(lowest(form, floor(state), count + zeros), zeros, slack)
    return found[:count], count_below(form, -slack)


def frequencies(state, setting, count, control=LOAD):
    """The `count` lowest natural frequencies sign(ω²) √|ω²|, ascending; as `eigenvalues`."""
    form = setting.second_variation(state, control=control)
    zeros, _ = exact_zeros(state)
    squares = squared_frequencies(state, form, count + zeros)
    squares = _with_zeros(squares, zeros, np.inf)[:count]
    return np.sign(squares) * np.sqrt(np.abs(squares))


def _with_zeros(values, zeros, slack):
    """The values nearest to zero as 0.0, where they are within `slack` of it."""
    nearest = np.argsort(np.abs(values))[:zeros]
    values[nearest] = np.where(np.abs(values[nearest]) <= slack, 0.0, values[nearest])
    return np.sort(values)
