"""Natural frequencies: the second variation weighed with the inertia of the strip.

    Q(φ) = ω² ∫ η_x² + η_y² ds,     η = ∫ φ (−sin θ, cos θ) ds from end A on,     ρA = EI = L = 1

on the same rotations φ and with contacts free to move as in the energy method; the signs of the eigenvalues
agree with it, their values are what an experiment measures. Every segment, and flat stretches, carry
what lies towards end B along with them: the whole strip is one problem.

How negative ω² may be: |η'| = |φ| and |η''|² = φ'² + φ²θ'², hence Q ≥ ‖η''‖² − c‖η'‖² with
c = max F(1 + 4m) ≥ p cos θ + λ sin θ + θ'². Where φ(1) = 0 or θ(1) = 0, ‖η'‖² ≤ ‖η‖‖η''‖ and so ω² ≥ −c²/4;
at a turning end B the boundary term costs a factor (1 + √2)⁴ < 36.
"""

import numpy as np

from elastica.blas import single_threaded
from elastica.control import LOAD
from elastica.inputs import check_count
from elastica.stability import counting, dense
from elastica.stability.assembly import strips
from elastica.stability.elements import LARGEST_GROWTH, SHIFT


@single_threaded
def frequencies(solution, count, control=LOAD):
    """The `count` lowest natural frequencies at every solved point of a solution.

    Parameters
    ----------
    solution, count
        As for `spectrum.eigenvalues`.
    control : Control
        At prescribed shortening end B is held in x as well.

    Returns
    -------
    ndarray, shape (..., count)
        sign(ω²) √|ω²|, ascending, in units of √(EI/ρA)/L²: negative ones grow exponentially. Exact zeros
        of line states as 0.0; NaN where not solved, and for free shapes too long for the elements (P
        beyond some 150, straight ones 2,500). Flat stretches have mass but stay flat.

    Raises
    ------
    ValueError
        If `count` is not a positive whole number.
    """
    check_count(count)
    # The straight strip keeps its shortening to first order by itself.
    control = LOAD if solution.state.straight else control
    result = np.full((solution.status.size, count), np.nan)
    for points, strip, shift, zeros in strips(solution, count, True, control):
        squares, doubtful = counting.eigenvalues(strip, count, shift * (1 - LARGEST_GROWTH / SHIFT), shift)
        squares = counting.with_zeros(strip, squares - shift[:, None], shift, zeros)
        result[points] = np.sign(squares) * np.sqrt(np.abs(squares))
        if doubtful.any():
            result[points[doubtful]] = dense.frequencies(solution, count, control, points[doubtful])
    return result.reshape(*solution.status.shape, count)
