"""Eigenvalues of the second variation, with contacts free to move and, for comparison, held.

The pencil (Q, ∫φ²) in Legendre elements (`legendre`) falls into parts where segments do not talk: line
states have φ = 0 at their contacts. Symmetric states are solved by halves: rotations of the middle are free
in even, zero in odd modes. Holding the shortening couples all segments again.
"""

from typing import NamedTuple

import numpy as np

from elastica.blas import single_threaded
from elastica.codes import Status
from elastica.control import LOAD
from elastica.equilibria.euler import euler_root
from elastica.inputs import check_count
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability.legendre import (
    Vertex,
    batches,
    lowest,
    quadratic_forms,
    sliding,
    with_zeros,
)


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
    return _eigenvalues(solution, count, control, terms=terms)


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
        values, index = _eigenvalues(solution, count), solution.index.copy()
    else:
        # Each spring that is left out can make one more eigenvalue negative.
        most = int(solution.index.max(initial=0)) + len(solution.state.word) + 1
        values = _eigenvalues(solution, max(count, most), contacts_move=False)
        unknown = np.isnan(values[..., 0])
        index = np.where(unknown, -1, (values < 0).sum(axis=-1)).astype(np.int16)
    return Conventional(values[..., :count], index, index == 0)


@single_threaded
def _eigenvalues(solution, count, control=LOAD, contacts_move=True, terms=None):
    """Lowest eigenvalues of Q, shape (..., count)."""
    result = np.full((solution.status.size, count), np.nan)
    state = solution.state
    if state.straight:
        solved = np.flatnonzero(solution.status == Status.SOLVED)
        p = FOUR_PI_SQUARED * solution.P.ravel()[solved]
        result[solved] = euler_root(np.arange(1, count + 1), solution.ends) ** 2 - p[:, None]
        return result.reshape(*solution.status.shape, count)
    halved = bool(state.mode) and solution.ends.alike and not control.fixes_shortening
    for points, segments, elements, size in batches(solution, count, halved, contacts_move, terms):
        if control.fixes_shortening:
            whole = quadratic_forms(elements, size, control=control).constrained
            values = [_lowest(elements, whole, sliding(elements.kinds) if state.line else 0)]
        elif state.line:
            # φ = 0 where a line begins and ends: segments do not talk.
            alone = [elements.part(i, i + 1) for i in range(len(segments))]
            values = [
                _lowest(part, quadratic_forms(part, size).constrained, sliding(part.kinds)) for part in alone
            ]
        else:
            values = [_lowest(elements, part) for part in _parts(solution, segments, elements, size, halved)]
        result[points] = np.sort(np.concatenate(values, axis=1), axis=1)[:, :count]
    return result.reshape(*solution.status.shape, count)


def _parts(solution, segments, elements, terms, halved):
    """Q and its weight of a strip without lines, where it is symmetric by halves: even and odd modes."""
    last = len(segments)
    if halved:
        # Halves of the only segment; odd modes keep the height of the ends by themselves.
        ell = elements.lengths[0]
        free = Vertex(np.zeros_like(ell), np.ones_like(ell))
        half = quadratic_forms(elements._replace(lengths=[ell / 2], vertex=[elements.vertex[0], free]), terms)
        return [half.constrained, half.with_end_held[:2]]
    if last % 2 == 0 and solution.state.symmetric(solution.ends) and segments == segments[::-1]:
        half = elements.part(0, last // 2)
        middle = half.vertex[-1]
        middle = middle._replace(reaction=middle.reaction / 2)
        half = quadratic_forms(half._replace(vertex=[*half.vertex[:-1], middle]), terms)
        return [half.constrained, half.with_end_held.constrained]
    return [quadratic_forms(elements, terms).constrained]


def _lowest(elements, forms, zeros=0):
    """Eigenvalues of Q with its weight, ascending, `zeros` of them known to vanish."""
    # Q ≥ −F ∫φ², since the reactions of a solved state push.
    shift = np.max([q.F for q in elements.pendulums], axis=0)
    Q, weight = forms
    return with_zeros(lowest(Q, weight, shift), zeros)
