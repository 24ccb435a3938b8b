"""Eigenvalues of the second variation, with contacts free to move and, for comparison, held.

Seen from −σ they are positive: Q ≥ −F ∫φ², since the reactions of a solved state push. Line states have φ = 0
at their contacts: at prescribed load their segments do not talk.
"""

from typing import NamedTuple

import numpy as np

from elastica.blas import single_threaded
from elastica.codes import Status
from elastica.control import LOAD
from elastica.equilibria.euler import euler_root
from elastica.inputs import check_count
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability import counting, dense
from elastica.stability.assembly import strips

LEAST = -1e-3
"""Below all eigenvalues x = ν + σ, in units of σ."""


def eigenvalues(solution, count, control=LOAD, terms=None):
    """The `count` lowest eigenvalues of Q at every solved point of a solution.

    Parameters
    ----------
    solution : Solution
    count : int
        At least 1.
    control : Control
        At prescribed shortening only rotations that keep it to first order, ∫ sin θ φ ds = 0. Of the straight
        strip all of them do.
    terms : int, optional
        Legendre terms in each element, to see how eigenvalues converge; at least as many as `count`. By
        default as many as each shape needs.

    Returns
    -------
    ndarray, shape (..., count)
        Ascending, EI = L = 1, weight ∫φ² ds; NaN where not solved, and for free shapes whose phase √F
        is too long for the elements (P beyond some 150). Of a line state those of its free
        segments, the exact zero of a clamped one as 0.0.

    Raises
    ------
    ValueError
        If `count` is not a positive whole number.
    """
    check_count(count)
    return _eigenvalues(solution, count, control, terms=terms)[0]


class Conventional(NamedTuple):
    """Verdict of the conventional energy method: what `conventional` returns."""

    eigenvalues: np.ndarray
    index: np.ndarray  # type: ignore[assignment]  # hides tuple.index
    stable: np.ndarray


def conventional(solution, count=1):
    """The conventional energy method, which holds each contact at its material point, slope free.

    The same quadratic form without the sum over contacts: not what a strip between walls does, but what
    is often computed. Without point contacts nothing is left out and the exact index stands.

    Parameters
    ----------
    solution : Solution
    count : int
        At least 1.

    Returns
    -------
    Conventional
        `eigenvalues`, shape (..., count), the lowest ones as in `eigenvalues`; `index`, shape (...), int16,
        the number of negative ones among all; NaN and −1 where they are not known. `stable`, shape (...),
        bool, where it is known that there is none.

    Raises
    ------
    ValueError
        If `count` is not a positive whole number.
    """
    check_count(count)
    if solution.state.line or not solution.state.word:
        values, index = _eigenvalues(solution, count)[0], solution.index.copy()
    else:
        values, index = _eigenvalues(solution, count, contacts_move=False)
    return Conventional(values, index, index == 0)


@single_threaded
def _eigenvalues(solution, count, control=LOAD, contacts_move=True, terms=None):
    """Lowest eigenvalues of Q, shape (..., count), and the number of negative ones, −1 where not known."""
    shape, state = solution.status.shape, solution.state
    result = np.full((solution.status.size, count), np.nan)
    index = np.full(solution.status.size, -1, np.int16)
    if state.straight:
        solved = np.flatnonzero(solution.status == Status.SOLVED)
        p = FOUR_PI_SQUARED * solution.P.ravel()[solved]
        result[solved] = euler_root(np.arange(1, count + 1), solution.ends) ** 2 - p[:, None]
        return result.reshape(*shape, count), index.reshape(shape)
    for points, strip, shift, zeros in strips(solution, count, False, control, contacts_move, terms):
        values, doubtful = counting.eigenvalues(strip, count, LEAST * shift, shift)
        result[points] = counting.with_zeros(strip, values - shift[:, None], shift, zeros)
        if doubtful.any():
            result[points[doubtful]] = dense.eigenvalues(solution, count, control, points[doubtful])
        if not contacts_move:
            index[points] = strip.below(shift)
    return result.reshape(*shape, count), index.reshape(shape)
