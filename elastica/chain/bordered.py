"""Tridiagonal matrices with a few borders: solution, inertia and lowest eigenvalues in O(N).

            n       q
        [ T       B  ]    T: the chain's springs and loads, tridiagonal
        [ Bᵀ      D  ]    B: one column for each constraint (or variable without mass), D: (q, q), small

Everything costs O(n q²). With S = D − BᵀT⁻¹B the matrix is congruent to T ⊕ S, so that its inertia is that
of T, counted by a Sturm sequence, plus that of S. If all borders are constraints (D = 0), the form xᵀTx on
Bᵀx = 0 has as many negative eigenvalues as the bordered matrix has beyond one for each constraint; the same
holds for borders that are variables without mass, which are minimised out.

Not here: what the matrices mean.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

SMALL = 60
"""Unknowns up to which a dense eigenvalue routine is as fast as Lanczos."""
ATTEMPTS = 30
"""Lanczos restarts in units of the number of eigenvalues wanted plus ten."""


class QuadraticForm(NamedTuple):
    """A quadratic form of n masses with q borders.

    Attributes
    ----------
    diagonal, off : ndarray, shape (n,), (n − 1,)
        The tridiagonal part T.
    border : ndarray, shape (n, q)
    corner : ndarray, shape (q, q)
    constraints : int
        How many of the borders are constraints; the others are variables without mass.
    mass : ndarray, shape (n,)
        Weights ≥ 0 of the unknowns.
    """

    diagonal: np.ndarray
    off: np.ndarray
    border: np.ndarray
    corner: np.ndarray
    constraints: int
    mass: np.ndarray

    def shifted(self, sigma):
        """The form minus sigma times the mass."""
        return self._replace(diagonal=self.diagonal - sigma * self.mass)


def solve_tridiagonal(diagonal, off, rhs):
    """Solve T x = rhs with partial pivoting, rhs (n,) or (n, k).

    Raises
    ------
    numpy.linalg.LinAlgError
        If T is exactly singular.
    """
    *_, x, info = lapack.dgtsv(off, diagonal, off, rhs)
    if info:
        raise np.linalg.LinAlgError("singular tridiagonal matrix")
    return x


def solve_bordered(diagonal, off, columns, rows, corner, f, g):
    """Solve T x + C y = f, R x + D y = g, where rows R and columns C need not be alike.

    Parameters
    ----------
    diagonal, off : ndarray, shape (n,), (n − 1,)
    columns, rows : ndarray, shape (n, q), (q, n)
    corner : ndarray, shape (q, q)
    f, g : ndarray, shape (n,), (q,)

    Returns
    -------
    x, y : ndarray, shape (n,), (q,)
    """
    solved = solve_tridiagonal(diagonal, off, np.column_stack([f, columns]))
    free, influence = solved[:, 0], solved[:, 1:]
    if not g.size:
        return free, g
    y = np.linalg.solve(corner - rows @ influence, g - rows @ free)
    return free - influence @ y, y


def negative_pivots(diagonal, off):
    """Number of negative eigenvalues of a symmetric tridiagonal matrix.

    LAPACK's bisection begins with a Sturm count; a tolerance as wide as the spectrum ends it there.
    """
    widest = 2 * (np.abs(diagonal).max() + 2 * np.abs(off).max(initial=0.0)) + 1
    by_value, block_order = 1, b"E"
    return lapack.dstebz(diagonal, off, by_value, -widest, 0.0, 1, 1, 4 * widest, block_order)[0]


def count_below(form, sigma=0.0):
    """Number of eigenvalues of a form below sigma, on the null space of its constraints.

    Parameters
    ----------
    form : QuadraticForm
    sigma : float

    Returns
    -------
    int
    """
    form = form.shifted(sigma)
    return negative_pivots(form.diagonal, form.off) + _negative(_schur(form)[0]) - form.constraints


def _schur(form):
    """S = D − BᵀT⁻¹B and T⁻¹B."""
    if not form.corner.size:
        return form.corner, form.border
    influence = solve_tridiagonal(form.diagonal, form.off, form.border)
    schur = form.corner - form.border.T @ influence
    return 0.5 * (schur + schur.T), influence


def _negative(matrix):
    """Number of negative eigenvalues of a small matrix, scaled to a diagonal of ±1."""
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    return int((np.linalg.eigvalsh(matrix * scale * scale[:, None]) < 0).sum()) if matrix.size else 0


def inverse(form):
    """The map from forces to displacements that obey the constraints, of a form that is not singular.

    Returns
    -------
    callable
        From (n,) to (n,), symmetric: T⁻¹ + T⁻¹B S⁻¹ BᵀT⁻¹.
    """
    schur, influence = _schur(form)

    def apply(force):
        free = solve_tridiagonal(form.diagonal, form.off, force)
        if not schur.size:
            return free
        return free + influence @ np.linalg.solve(schur, influence.T @ force)

    return apply


def lowest(form, floor, count):
    """The lowest eigenvalues of a form with its mass as weight, ascending.

    Lanczos on the inverse of the form, shifted to `floor`; how many are lower still is counted.

    Parameters
    ----------
    form : QuadraticForm
    floor : float
        Below the eigenvalues of T, so that only borders can bring about lower ones.
    count : int

    Returns
    -------
    ndarray, shape (count,)
        NaN for those that the chain does not have.
    """
    apply = inverse(form.shifted(floor))
    root = np.sqrt(form.mass)

    def weighed(x):
        return root * apply(root * x)

    room = int((form.mass > 0).sum()) - form.constraints
    below = count_below(form, floor)
    inverses = extreme_eigenvalues(weighed, root.size, min(below, room), min(count, room - below))
    values = np.full(count, np.nan)
    found = np.sort(floor + 1 / inverses)[:count]
    values[: found.size] = found
    return values


def extreme_eigenvalues(operator, n, negative, positive):
    """The `negative` lowest and the `positive` highest eigenvalues of a symmetric operator.

    Parameters
    ----------
    operator : callable
        From (n,) to (n,).
    n, negative, positive : int

    Returns
    -------
    ndarray, shape (negative + positive,)
        NaN where Lanczos did not converge.
    """
    if n <= max(SMALL, 4 * (negative + positive)):
        matrix = np.column_stack([operator(column) for column in np.eye(n)])
        values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
        return np.concatenate([values[:negative], values[n - positive :]])
    start = np.random.default_rng(0).normal(size=n)
    linear = LinearOperator((n, n), operator, dtype=float)
    parts = [np.zeros(0)]
    for which, wanted in (("SA", negative), ("LA", positive)):
        if wanted:
            try:
                parts.append(
                    eigsh(
                        linear,
                        wanted,
                        which=which,
                        v0=start,
                        maxiter=ATTEMPTS * (wanted + 10),
                        return_eigenvectors=False,
                    )
                )
            except ArpackNoConvergence:
                parts.append(np.full(wanted, np.nan))
    return np.concatenate(parts)
