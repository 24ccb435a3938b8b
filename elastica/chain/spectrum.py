"""The lowest eigenvalues and frequencies of a chain in equilibrium, by Lanczos on O(N) solves."""

import numpy as np

from elastica.chain.bordered import count_below, lowest
from elastica.chain.published import published_variation
from elastica.chain.second_variation import floor, second_variation
from elastica.chain.verdict import exact_zeros, tolerance
from elastica.chain.vibration import squared_frequencies


def variation(state, published, contacts_move=True, fixed_shortening=False):
    """The second variation in either setting."""
    vary = published_variation if published else second_variation
    return vary(state, contacts_move, fixed_shortening)


def eigenvalues(state, published, count, fixed_shortening=False):
    """The `count` lowest eigenvalues of Q, ascending, exact zeros of the strip as 0.0."""
    zeros = _zeros(state)
    found = lowest(variation(state, published, True, fixed_shortening), floor(state), count + zeros)
    return _with_zeros(found, zeros, tolerance(state, published))[:count]


def conventional(state, published, count):
    """Lowest eigenvalues and index with contacts held at their material points.

    Returns
    -------
    values : ndarray, shape (count,)
    index : int
    """
    form = variation(state, published, contacts_move=False)
    zeros = _zeros(state)
    slack = tolerance(state, published) if zeros else 0.0
    found = _with_zeros(lowest(form, floor(state), count + zeros), zeros, slack)
    return found[:count], count_below(form, -slack)


def frequencies(state, published, count, fixed_shortening=False):
    """The `count` lowest natural frequencies sign(ω²) √|ω²|, ascending."""
    form = variation(state, published, True, fixed_shortening)
    zeros = _zeros(state)
    squares = squared_frequencies(state, form, count + zeros)
    squares = _with_zeros(squares, zeros, np.inf)[:count]
    return np.sign(squares) * np.sqrt(np.abs(squares))


def _zeros(state):
    return exact_zeros(state)[0] if state.strip.profile.uniform else 0


def _with_zeros(values, zeros, slack):
    """The values nearest to zero as 0.0, where they are within `slack` of it."""
    nearest = np.argsort(np.abs(values))[:zeros]
    values[nearest] = np.where(np.abs(values[nearest]) <= slack, 0.0, values[nearest])
    return np.sort(values)
