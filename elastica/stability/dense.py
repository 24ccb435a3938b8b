"""The strip in Legendre elements: quadratic forms of the rotation field φ and its constraints.

Each free segment is one element with the two linear vertex functions and integrated Legendre polynomials
as bubbles; these are orthonormal in ∫φ'g', so the stiffness of an element is

             v₀  bubbles  v₁
        v₀ [  1     0     −1 ]
 1/ℓ bubbles [ 0    I      0 ]      contacts and pinned ends share a vertex, clamps and the ends of
        v₁ [ −1     0      1 ]      lines drop it; the reaction adds μ/κ to a contact's vertex

and Q differs from it by something compact. In this order the unknowns of each element lie side by side.
Each segment's height constraint turns into one unknown by a reflection, and is dropped with it.

The rotation φ moves the strip by η = ∫ φ (−sin θ, cos θ) ds from end A on. Across, η starts and ends at 0 in
every segment; along, it adds up from segment to segment, and flat stretches go along with it.

Not here: the same segment by segment (`held`, `counting`), which is what is used wherever it loses no digits,
and compared with this.
"""

from typing import NamedTuple

import numpy as np

from elastica.blas import single_threaded
from elastica.control import LOAD
from elastica.pendulum.segments import TINY
from elastica.stability.elements import LARGEST_GROWTH, SHIFT, batches, profile
from elastica.stability.quadrature import reference_element, running_integral


@single_threaded
def eigenvalues(solution, count, control=LOAD, points=None):
    """The `count` lowest eigenvalues of the second variation, all segments in one matrix.

    Parameters
    ----------
    solution, count, control
        As for `spectrum.eigenvalues`, which is much faster. The straight strip is not among the states that
        this knows.
    points : ndarray of int, shape (n,), optional
        Flat indices of the points wanted, by default all.

    Returns
    -------
    ndarray, shape (n, count) or (..., count)
    """
    result = np.full((solution.status.size, count), np.nan)
    for some, elements, size in batches(solution, count, only=points, joined=True):
        Q, weight = quadratic_forms(elements, size, control=control).constrained
        values = _lowest(Q, weight, elements.largest_thrust)
        zeros = elements.sliding if solution.state.line else 0
        result[some] = _with_zeros(values, zeros)[:, :count]
    return result.reshape(*solution.status.shape, count) if points is None else result[points]


@single_threaded
def frequencies(solution, count, control=LOAD, points=None):
    """The `count` lowest natural frequencies, all segments in one matrix: with arguments as `eigenvalues`."""
    control = LOAD if solution.state.straight else control
    result = np.full((solution.status.size, count), np.nan)
    for some, elements, terms in batches(solution, count, only=points, joined=True):
        Q, inertia = quadratic_forms(elements, terms, True, control).constrained
        squares = _resolved(Q, inertia, elements.growth, solution.index.ravel()[some] > 0)
        squares = _with_zeros(squares, elements.sliding if solution.state.line else 0)[:, :count]
        result[some] = np.sign(squares) * np.sqrt(np.abs(squares))
    return result.reshape(*solution.status.shape, count) if points is None else result[points]


def quadratic_forms(elements, terms, inertia=False, control=LOAD):
    """Matrices of Q and of its weight, and the heights and the shortening that φ has to keep.

    Parameters
    ----------
    elements : Elements
    terms : int
    inertia : bool
        Weight ∫ |η|² ds in place of ∫ φ² ds.
    control : Control
        At prescribed shortening ∫ sin θ φ ds = 0 is one more constraint.

    Returns
    -------
    Forms
    """
    count = len(elements.segments)
    free = [vertex is not None for vertex in elements.vertex]
    # Unknowns come in the order vertex, bubbles, vertex, bubbles, …, vertex without those that are held.
    vertex_place = [sum(free[:i]) + i * terms for i in range(count + 1)]
    n, size = elements.lengths[0].size, sum(free) + terms * count
    Q, weight = np.zeros((2, n, size, size))
    constraints = np.zeros((n, size, count + control.fixes_shortening))
    carried = np.zeros((n, size)) if inertia else None
    for i, ell in enumerate(elements.lengths):
        local = slice(0 if free[i] else 1, terms + 2 if free[i + 1] else terms + 1)
        place = slice(vertex_place[i], vertex_place[i + 1] + free[i + 1])
        thrust, cos, sin = _profile(elements, i, terms)
        Q[:, place, place] += _stiffness(thrust, ell, terms)[:, local, local]
        constraints[:, place, i] = _integral(cos, ell, terms)[:, local]
        if carried is not None:
            mass, drift, end = _moving(cos, sin, ell, terms)
            _add_drift(weight, carried, place, drift[:, local], ell + elements.flats[i])
            carried[:, place] += end[:, local]
            weight[:, place, place] += mass[:, local, local]
        else:
            weight[:, place, place] += ell[:, None, None] * reference_element(terms)[4][local, local]
        if control.fixes_shortening:
            constraints[:, place, -1] += _integral(sin, ell, terms)[:, local]
    for place, vertex in zip(vertex_place, elements.vertex, strict=True):
        if vertex is None:
            continue
        # In the unit of rotation 1/√(1 + μℓ/κ) the stiffness μ/κ stays finite as κ → 0.
        reaction, kappa = vertex
        total = kappa + np.abs(reaction) * elements.lengths[0]
        unit = np.sqrt(kappa / total)[:, None]
        for matrix in (Q, weight):
            matrix[:, place, :] *= unit
            matrix[:, :, place] *= unit
        constraints[:, place, :] *= unit
        Q[:, place, place] += reaction / total
    return Forms(Q, weight, constraints)


class Forms(NamedTuple):
    """Matrices of Q and of its weight, shape (n, size, size), and columns to keep to, (n, size, k)."""

    Q: np.ndarray
    weight: np.ndarray
    constraints: np.ndarray

    @property
    def constrained(self):
        """Q and its weight on the φ that keep the constraints."""
        return _constrained(*self)


def _constrained(Q, weight, constraints):
    """Both matrices on the vectors orthogonal to the columns of `constraints`.

    A reflection I − vvᵀ, |v|² = 2, turns a constraint into the first unknown, which is left out; then the
    next one.
    """
    for column in range(constraints.shape[2]):
        v = constraints[:, :, column].copy()
        norm = np.maximum(np.sqrt((v * v).sum(axis=1)), TINY)
        v /= norm[:, None]
        v[:, 0] += np.where(v[:, 0] < 0, -1.0, 1.0)
        v /= np.sqrt(np.abs(v[:, :1]))
        constraints = constraints - v[:, :, None] * (v[:, None, :] @ constraints)
        constraints = constraints[:, 1:]
        Q, weight = (_reflected(matrix, v) for matrix in (Q, weight))
    return Q, weight


def _reflected(matrix, v):
    """(I − vvᵀ) matrix (I − vvᵀ) of a symmetric matrix, without its first row and column."""
    w = (matrix @ v[:, :, None])[:, :, 0]
    w -= 0.5 * (v * w).sum(axis=1)[:, None] * v
    v, w = v[:, 1:], w[:, 1:]
    return matrix[:, 1:, 1:] - (np.stack([v, w], axis=2) @ np.stack([w, v], axis=1))


def _lowest(Q, weight, shift):
    """All eigenvalues of the pencil (Q, weight) that it resolves, ascending, shape (n, size).

    Solved shifted and inverted, 1/(ν + σ): so the low eigenvalues keep the digits that the largest one,
    ∝ (terms)⁴ or its square, would take.

    Parameters
    ----------
    Q, weight : ndarray, shape (n, size, size)
    shift : ndarray, shape (n,)
        Makes Q + σ·weight positive.
    """
    lower = np.linalg.inv(np.linalg.cholesky(Q + shift[:, None, None] * weight))
    inverse = np.linalg.eigvalsh(lower @ weight @ lower.transpose(0, 2, 1))[:, ::-1]
    # Below rounding the sign of an inverse means nothing.
    resolved = inverse > np.finfo(float).eps * inverse[:, :1]
    return np.where(resolved, 1 / np.where(resolved, inverse, 1.0) - shift[:, None], np.inf)


def _profile(elements, i, terms):
    """Thrust p cos θ + λ sin θ, cos θ and sin θ at the quadrature points of a segment, from A to B."""
    pendulum, length = elements.pendulums[i], elements.lengths[i]
    cos, sin, thrust = profile(elements.segments[i].kind, pendulum, length, reference_element(terms)[0])
    sin = elements.sides[i] * sin
    if elements.reverse[i]:
        return thrust[:, ::-1], cos[:, ::-1], -sin[:, ::-1]
    return thrust, cos, sin


def _stiffness(thrust, ell, terms):
    """∫φ'g' − thrust φg over one segment, local order v₀, bubbles, v₁."""
    _, weights, basis, stiffness, _ = reference_element(terms)
    weighted = basis.T * (weights * ell[:, None] * thrust)[:, None, :]
    return stiffness / ell[:, None, None] - weighted @ basis


def _integral(factor, ell, terms):
    """The integrals of `factor` times each basis function over one segment, shape (n, terms + 2)."""
    _, weights, basis, *_ = reference_element(terms)
    return ((weights * ell[:, None] * factor)[:, None, :] @ basis)[:, 0]


def _moving(cos, sin, ell, terms):
    """What a segment moves by itself: ∫|η|² as a matrix, ∫η_x and η_x at its end as rows."""
    _, weights, basis, *_ = reference_element(terms)
    across, along = (
        ell[:, None, None] * (running_integral(terms) @ (factor[:, :, None] * basis))
        for factor in (cos, -sin)
    )
    measure = (weights * ell[:, None])[:, None, :]
    both = np.concatenate([across, along], axis=1)
    mass = (both.transpose(0, 2, 1) * np.tile(measure, 2)) @ both
    return mass, (measure @ along)[:, 0], _integral(-sin, ell, terms)


def _add_drift(weight, carried, place, drift, length):
    """Add to ∫|η|² what comes from the advance η_x = `carried` with which a segment begins.

    `drift` is ∫η_x of the segment by itself at its places, `length` its own and that of the flat before it.
    """
    cross = carried[:, :, None] * drift[:, None, :]
    weight[:, :, place] += cross
    weight[:, place, :] += cross.transpose(0, 2, 1)
    weight += length[:, None, None] * carried[:, :, None] * carried[:, None, :]


def _resolved(Q, inertia, scale, unstable):
    """All ω², ascending, shifted no further than needed: rounding of ω² grows with the shift."""
    shift = SHIFT * scale
    if unstable.any():
        first = _lowest(Q[unstable], inertia[unstable], LARGEST_GROWTH * scale[unstable])[:, 0]
        shift[unstable] += 1.5 * np.maximum(-first, 0.0)
    return _lowest(Q, inertia, shift)


def _with_zeros(values, number):
    """The `number` eigenvalues next to zero of each row, known to vanish, set to 0.0."""
    if number:
        nearest = np.abs(values).argsort(axis=1)[:, :number]
        np.put_along_axis(values, nearest, 0.0, axis=1)
    return values
