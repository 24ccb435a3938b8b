"""The strip in Legendre elements: quadratic forms of the rotation field φ and its constraints.

Each free segment is one element with the two linear vertex functions and integrated Legendre polynomials
as bubbles; these are orthonormal in ∫φ'g', so the stiffness of an element is

             v₀  bubbles  v₁
        v₀ [  1     0     −1 ]
 1/ℓ bubbles [ 0    I      0 ]      contacts and pinned ends share a vertex, clamps and the ends of
        v₁ [ −1     0      1 ]      lines drop it; the reaction adds μ/κ to a contact's vertex

and Q differs from it by something compact. In this order the unknowns of each element lie side by side.
Each segment's height constraint turns into one unknown by a reflection, and is dropped with it.

How many bubbles: θ has poles K'(m) off the real axis of its phase √F s, so on a segment of phase L
eigenvalues converge as exp(−2n asinh(2K'/L)). Shallow segments have distant poles and need few.

The rotation φ moves the strip by η = ∫ φ (−sin θ, cos θ) ds from end A on. Across, η starts and ends at 0 in
every segment; along, it adds up from segment to segment, and flat stretches go along with it.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import ellipkm1

from elastica.codes import Status
from elastica.control import LOAD
from elastica.equilibria.roots import pendulums_of
from elastica.pendulum.segments import TINY, Kind, Pendulum
from elastica.pendulum.swing import start_phase, swing
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability.quadrature import reference_element, running_integral
from elastica.state import Segment

TRUNCATION = 1e-11
"""Relative error that is left to the poles of θ where F = π²; it falls as F⁻², since eigenvalues near
zero are differences of terms ∝ F, and squared frequencies of terms ∝ F²."""
MORE_TERMS = 6
"""Bubbles beyond those, and beyond half a bubble per radian of phase, that the lowest eigenvalues need: at
most 5 did in 800 random states of ten kinds."""
TERMS_ROUNDED_TO = 2
"""Points with about as many terms share a batch."""
LONGEST_PHASE = 80.0
"""Longer segments are left out."""
STRAIGHT_PHASE = 320.0
"""The same for the straight strip, which has no poles."""
BATCH_ENTRIES = 100_000
"""Matrix entries of a batch: larger ones leave the cache."""
STRAIGHT = Segment(Kind(0, 1), 0, 0)
AT_REST = 1e-100
"""Thrust in place of none: the straight strip is the pendulum at rest, whose F must not vanish."""


class Vertex(NamedTuple):
    """A contact or an end that may rotate: the coefficient of φ² in Q is reaction/curvature, arrays (n,)."""

    reaction: np.ndarray
    kappa: np.ndarray


class Elements(NamedTuple):
    """The free segments from A to B: (n,) arrays in lists, one entry a segment, and the vertex conditions.

    `sides` is −1 for mirrored segments, `flats` the length that lies flat in front of each.
    `vertex[i]` belongs to the start of segment i, the last one to end B: None where
    φ = 0, otherwise a `Vertex`; pinned ends have no reaction.
    """

    kinds: list
    reverse: list
    sides: list
    pendulums: list
    lengths: list
    flats: list
    vertex: list

    def part(self, first, last):
        """Segments first … last − 1."""
        part = Elements(*(field[first:last] for field in self))
        return part._replace(vertex=self.vertex[first : last + 1])


def batches(solution, count, halved=False, contacts_move=True, terms=None):
    """The solved points of a solution in batches, each with its elements.

    Parameters
    ----------
    solution : Solution
    count : int
        Eigenvalues wanted.
    halved : bool
        Whether the only segment will be cut in two.
    contacts_move : bool
        False leaves out the sum over contacts in Q.
    terms : int, optional
        Bubbles per element, for all shapes; by default as many as each shape needs.

    Yields
    ------
    points : ndarray of int, shape (n,)
        Flat indices. Shapes whose phase √F ℓ is too long for the elements are left out.
    segments : tuple of Segment
    elements : Elements
    terms : int
        Bubbles per element.
    """
    state = solution.state
    solved = np.flatnonzero(solution.status == Status.SOLVED)
    for points, segments in [(solved, (STRAIGHT,))] if state.straight else solution.patterns(solved):
        p = FOUR_PI_SQUARED * solution.P.ravel()[points]
        if state.straight:
            lam, lengths = np.zeros((points.size, 1)), np.ones((points.size, 1))
        else:
            lam, lengths = (
                field.reshape(-1, len(segments))[points] for field in (solution.lam, solution.lengths)
            )
        fields = (
            np.maximum(p, AT_REST),
            solution.curvature.ravel()[points],
            solution.flat_length.ravel()[points],
            lam,
            lengths,
        )
        pendulums = pendulums_of(segments, fields[0], fields[1], lam.T)
        needed = _terms(pendulums, lengths.T / 2 if halved else lengths.T, state.straight)
        # Each segment has its share of the half waves of the highest mode, with π/2 bubbles for each.
        waves = -(-2 * (count + 1) // len(segments))
        if terms is not None:
            needed, waves = np.where(needed > 0, terms, 0), 0
        for number in np.unique(needed[needed > 0]):
            group = np.flatnonzero(needed == number)
            batch = max(1, BATCH_ENTRIES // (number * len(segments)) ** 2)
            for some in np.split(group, range(batch, group.size, batch)):
                own = [Pendulum(*(field[some] for field in q)) for q in pendulums]
                elements = _elements(
                    solution, segments, contacts_move, own, *(field[some] for field in fields)
                )
                yield points[some], segments, elements, int(number) + waves


def _terms(pendulums, lengths, straight):
    """Bubbles per element that the poles and waves of a shape ask for, shape (n,); 0: too many."""
    longest, poles = 0.0, 0.0
    for q, ell in zip(pendulums, lengths, strict=True):
        phase = q.r * ell
        longest = np.maximum(longest, phase)
        if not straight:
            distance = 2 * ellipkm1(np.maximum(q.m, TINY)) / phase
            digits = 2 * np.log(np.maximum(q.F / np.pi**2, 1.0)) - np.log(TRUNCATION)
            poles = np.maximum(poles, digits / (2 * np.arcsinh(distance)))
    terms = np.maximum(poles, longest / 2) + MORE_TERMS
    terms = TERMS_ROUNDED_TO * np.ceil(terms / TERMS_ROUNDED_TO)
    return np.where(longest <= (STRAIGHT_PHASE if straight else LONGEST_PHASE), terms, 0).astype(int)


def _elements(solution, segments, contacts_move, pendulums, p, kappa, flat_length, lam, lengths):
    """The elements of a batch of points that share their segments."""
    state, ends = solution.state, solution.ends
    edge = [None if end.clamped else Vertex(np.full_like(p, end.stiffness), np.ones_like(p)) for end in ends]
    if state.line:
        contacts = [None for _ in state.word]
    elif contacts_move:
        contacts = [Vertex(a + b, kappa) for a, b in pairwise(lam.T)]
    else:
        contacts = [Vertex(np.zeros_like(p), np.ones_like(p)) for _ in state.word]
    walls = state.walls
    sides = [*walls, walls[-1]] if walls else [1]
    flat = flat_length / max(len(walls), 1)
    return Elements(
        [segment.kind for segment in segments],
        [False] if state.straight else list(state.reversed_segments(ends)),
        sides,
        pendulums,
        list(lengths.T),
        [np.zeros_like(p), *(flat for _ in walls)],
        [edge[0], *contacts, edge[1]],
    )


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
    count = len(elements.kinds)
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
        thrust, theta = _profile(elements, i, terms)
        Q[:, place, place] += _stiffness(thrust, ell, terms)[:, local, local]
        constraints[:, place, i] = _integral(np.cos(theta), ell, terms)[:, local]
        if carried is not None:
            mass, drift, end = _moving(theta, ell, terms)
            _add_drift(weight, carried, place, drift[:, local], ell + elements.flats[i])
            carried[:, place] += end[:, local]
            weight[:, place, place] += mass[:, local, local]
        else:
            weight[:, place, place] += ell[:, None, None] * reference_element(terms)[4][local, local]
        if control.fixes_shortening:
            constraints[:, place, -1] += _integral(np.sin(theta), ell, terms)[:, local]
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
    def with_end_held(self):
        """The same with the last vertex held, where it was free."""
        return Forms(self.Q[:, :-1, :-1], self.weight[:, :-1, :-1], self.constraints[:, :-1])

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


def lowest(Q, weight, shift):
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


def sliding(kinds):
    """Number of full periods between places with θ = θ' = 0: each of a line state has an exact zero, θ'."""
    return sum(kind.start == int(kind.start) and not kind.springs for kind in kinds)


def with_zeros(values, number):
    """The `number` eigenvalues next to zero of each row, known to vanish, set to 0.0."""
    if number:
        nearest = np.abs(values).argsort(axis=1)[:, :number]
        np.put_along_axis(values, nearest, 0.0, axis=1)
    return values


def _profile(elements, i, terms):
    """Thrust p cos θ + λ sin θ along a segment and θ at the quadrature points, from its end next to A."""
    kind, q = elements.kinds[i], elements.pendulums[i]
    u = start_phase(kind, q)[:, None] + (q.r * elements.lengths[i])[:, None] * reference_element(terms)[0]
    psi = swing(q, u)
    theta = elements.sides[i] * (psi + q.alpha[:, None])
    if elements.reverse[i]:
        psi, theta = psi[:, ::-1], -theta[:, ::-1]
    return q.F[:, None] * np.cos(psi), theta


def _stiffness(thrust, ell, terms):
    """∫φ'g' − thrust φg over one segment, local order v₀, bubbles, v₁."""
    _, weights, basis, stiffness, _ = reference_element(terms)
    weighted = basis.T * (weights * ell[:, None] * thrust)[:, None, :]
    return stiffness / ell[:, None, None] - weighted @ basis


def _integral(factor, ell, terms):
    """The integrals of `factor` times each basis function over one segment, shape (n, terms + 2)."""
    _, weights, basis, *_ = reference_element(terms)
    return ((weights * ell[:, None] * factor)[:, None, :] @ basis)[:, 0]


def _moving(theta, ell, terms):
    """What a segment moves by itself: ∫|η|² as a matrix, ∫η_x and η_x at its end as rows."""
    _, weights, basis, *_ = reference_element(terms)
    across, along = (
        ell[:, None, None] * (running_integral(terms) @ (factor[:, :, None] * basis))
        for factor in (np.cos(theta), -np.sin(theta))
    )
    measure = (weights * ell[:, None])[:, None, :]
    both = np.concatenate([across, along], axis=1)
    mass = (both.transpose(0, 2, 1) * np.tile(measure, 2)) @ both
    return mass, (measure @ along)[:, 0], _integral(-np.sin(theta), ell, terms)


def _add_drift(weight, carried, place, drift, length):
    """Add to ∫|η|² what comes from the advance η_x = `carried` with which a segment begins.

    `drift` is ∫η_x of the segment by itself at its places, `length` its own and that of the flat before it.
    """
    cross = carried[:, :, None] * drift[:, None, :]
    weight[:, :, place] += cross
    weight[:, place, :] += cross.transpose(0, 2, 1)
    weight += length[:, None, None] * carried[:, :, None] * carried[:, None, :]
