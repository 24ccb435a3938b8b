"""The strip as a chain of Legendre elements: quadratic forms of the rotation field φ and its constraints.

Each free segment is one element with the two linear vertex functions and integrated Legendre polynomials
as bubbles; these are orthonormal in ∫φ'g', so the stiffness of an element is

             v₀   v₁   bubbles
        v₀ [  1   −1     0   ]
    1/ℓ v₁ [ −1    1     0   ]      contacts and pinned ends share a vertex, clamps and the ends of
  bubbles  [  0    0     I   ]      lines drop it; the reaction adds μ/κ to a contact's vertex

and Q differs from it by something compact. Each segment's height constraint is eliminated by an orthogonal
basis of its null space.

The rotation φ moves the strip by η = ∫ φ (−sin θ, cos θ) ds from end A on. Across, η starts and ends at 0 in
every segment; along, it adds up from segment to segment, and flat stretches go along with it.
"""

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from elastica.codes import Status
from elastica.elliptic import jacobi
from elastica.equilibrium import pendulums_of
from elastica.scales import FOUR_PI_SQUARED
from elastica.segments import Kind, start_phase, swing_at
from elastica.shapes import WALL
from elastica.states import Segment

TERMS_FOR_PHASE = {6.8: 32, 10.0: 48, 14.0: 66, 18.0: 84, 24.0: 112, 50.0: 232, 80.0: 372}
"""Bubbles per element for a pendulum phase L = √F ℓ up to the key. The pendulum's poles lie K' ≥ π/2 off the
real axis, so (without a margin) eigenvalues converge as exp(−2n asinh(π/L)) for n bubbles."""
STRAIGHT_PHASE = 1 / 4
"""A straight strip has no poles: L/2 bubbles and some more resolve its waves."""
BATCH_ENTRIES = 100_000
"""Matrix entries of a batch: larger ones leave the cache."""
STRAIGHT = Segment(Kind(0, 1), 0, 0)
AT_REST = 1e-100
"""Thrust in place of none: the straight strip is the pendulum at rest, whose F must not vanish."""


class Contact(NamedTuple):
    """A vertex that may rotate: the coefficient of φ² in Q is reaction/curvature, arrays (n,)."""

    reaction: np.ndarray
    kappa: np.ndarray


class Elements(NamedTuple):
    """A chain of free segments: (n,) arrays in lists, one entry a segment, and the vertex conditions.

    `sides` is −1 for mirrored segments, `flats` the length that lies flat in front of each.
    `vertex[i]` belongs to the start of segment i, the last one to the end of the chain: None where
    φ = 0, otherwise a `Contact`; pinned ends have no reaction. `constrained` says whether the height
    of each segment is held.
    """

    kinds: list
    reverse: list
    sides: list
    pendulums: list
    lengths: list
    flats: list
    vertex: list
    constrained: bool = True

    def part(self, first, last):
        """Segments first … last − 1."""
        return Elements(*(field[first:last] for field in self[:6]), self.vertex[first : last + 1])


def check_count(count):
    """Raise ValueError if `count` is not a positive whole number."""
    if not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count = {count!r}; ask for at least one eigenvalue")


def chains(solution, count, halved=False, contacts_move=True):
    """The solved points of a solution in batches, each with its chain of elements.

    Parameters
    ----------
    solution : Solution
    count : int
        Eigenvalues wanted.
    halved : bool
        Whether the only segment will be cut in two.
    contacts_move : bool
        False leaves out the sum over contacts in Q.

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
        shorter = STRAIGHT_PHASE if state.straight else 1 / 2 if halved else 1
        phase = (np.sqrt(np.hypot(p[:, None], lam)) * lengths * shorter).max(axis=1, initial=0)
        lower = -1.0
        for upper, terms in TERMS_FOR_PHASE.items():
            group = np.flatnonzero((phase > lower) & (phase <= upper))
            lower = upper
            batch = max(1, BATCH_ENTRIES // (terms * len(segments)) ** 2)
            for some in np.split(group, range(batch, group.size, batch)):
                if some.size:
                    elements = _chain(solution, segments, contacts_move, *(field[some] for field in fields))
                    yield points[some], segments, elements, terms + count


def _chain(solution, segments, contacts_move, p, kappa, flat_length, lam, lengths):
    """The elements of a batch of points that share their segments."""
    state, ends = solution.state, solution.ends
    edge = [None if end.clamped else Contact(np.full_like(p, end.stiffness), np.ones_like(p)) for end in ends]
    if state.line:
        contacts = [None for _ in state.word]
    elif contacts_move:
        contacts = [Contact(a + b, kappa) for a, b in pairwise(lam.T)]
    else:
        contacts = [Contact(np.zeros_like(p), np.ones_like(p)) for _ in state.word]
    walls = [WALL[letter] for letter in state.word]
    sides = [*walls, walls[-1]] if walls else [1]
    flat = flat_length / max(len(walls), 1)
    return Elements(
        [segment.kind for segment in segments],
        [False] if state.straight else list(state.reversed_segments(ends)),
        sides,
        pendulums_of(segments, p, kappa, lam.T),
        list(lengths.T),
        [np.zeros_like(p), *(flat for _ in walls)],
        [edge[0], *contacts, edge[1]],
    )


def quadratic_forms(elements, terms, inertia=False, fixed_shortening=False):
    """Matrices of Q and of its weight on the φ that keep the constraints.

    Parameters
    ----------
    elements : Elements
    terms : int
    inertia : bool
        Weight ∫ |η|² ds in place of ∫ φ² ds.
    fixed_shortening : bool
        Whether ∫ sin θ φ ds = 0 is one more constraint.

    Returns
    -------
    Q, weight : ndarray, shape (n, size, size)
    """
    vertices = [i for i, spring in enumerate(elements.vertex) if spring is not None]
    count = len(elements.kinds)
    size = len(vertices) + terms * count
    n = elements.lengths[0].size
    Q, weight = np.zeros((2, n, size, size))
    constraints = np.zeros((n, size, count + fixed_shortening))
    carried = np.zeros((n, size)) if inertia else None
    for i, ell in enumerate(elements.lengths):
        local = [v for v in (0, 1) if i + v in vertices]
        place = [vertices.index(i + v) for v in local]
        place += range(len(vertices) + i * terms, len(vertices) + (i + 1) * terms)
        local += range(2, terms + 2)
        thrust, theta = _profile(elements, i, terms)
        stiffness, mass, height = _element(thrust, theta, ell, terms)
        block, rows = np.ix_(range(n), place, place), np.ix_(local, local)
        Q[block] += stiffness[:, rows[0], rows[1]]
        constraints[:, place, i] = height[:, local]
        if inertia:
            mass, drift, end = (part[..., local] for part in _moving(theta, ell, terms))
            _add_drift(weight, carried, place, drift, ell + elements.flats[i])
            carried[:, place] += end
            weight[block] += mass[:, local]
        else:
            weight[block] += mass[:, rows[0], rows[1]]
        if fixed_shortening:
            constraints[:, place, -1] += _integral(np.sin(theta), ell, terms)[:, local]
    for place, vertex in enumerate(vertices):
        # In the unit of rotation 1/√(1 + μℓ/κ) the stiffness μ/κ stays finite as κ → 0.
        reaction, kappa = elements.vertex[vertex]
        total = kappa + np.abs(reaction) * elements.lengths[0]
        unit = np.sqrt(kappa / total)[:, None]
        for matrix in (Q, weight):
            matrix[:, place, :] *= unit
            matrix[:, :, place] *= unit
        constraints[:, place, :] *= unit
        Q[:, place, place] += reaction / total
    if not elements.constrained:
        return Q, weight
    basis = np.linalg.qr(constraints, mode="complete")[0][:, :, constraints.shape[2] :]
    across = basis.transpose(0, 2, 1)
    return across @ Q @ basis, across @ weight @ basis


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
    u = start_phase(kind, q)[:, None] + (q.r * elements.lengths[i])[:, None] * _reference(terms)[0]
    sn, cn, _ = jacobi(u, q.K[:, None], q.m[:, None])
    psi = swing_at(q, sn, cn)
    theta = elements.sides[i] * (psi + q.alpha[:, None])
    if elements.reverse[i]:
        psi, theta = psi[:, ::-1], -theta[:, ::-1]
    return q.F[:, None] * np.cos(psi), theta


def _element(thrust, theta, ell, terms):
    """Q, ∫φ² and height constraint of one segment, local order v₀, v₁, bubbles."""
    _, weights, basis, stiffness, mass = _reference(terms)
    weighted = basis.T * (weights * ell[:, None] * thrust)[:, None, :]
    Q = stiffness / ell[:, None, None] - weighted @ basis
    return Q, mass * ell[:, None, None], _integral(np.cos(theta), ell, terms)


def _integral(factor, ell, terms):
    """The integrals of `factor` times each basis function over one segment, shape (n, terms + 2)."""
    _, weights, basis, *_ = _reference(terms)
    return ((weights * ell[:, None] * factor)[:, None, :] @ basis)[:, 0]


def _moving(theta, ell, terms):
    """What a segment moves by itself: ∫|η|² as a matrix, ∫η_x and η_x at its end as rows."""
    _, weights, basis, *_ = _reference(terms)
    across, along = (
        ell[:, None, None] * (_running_integral(terms) @ (factor[:, :, None] * basis))
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


@cache
def _reference(terms):
    """Quadrature and the basis v₀, v₁, integrated Legendre bubbles on [0, 1].

    Returns
    -------
    points, weights : ndarray, shape (2·terms,)
    basis : ndarray, shape (2·terms, terms + 2)
    stiffness, mass : ndarray, shape (terms + 2, terms + 2)
    """
    x, weights = leggauss(2 * terms)
    points, weights = (x + 1) / 2, weights / 2
    legendre = legvander(x, terms + 1)
    k = np.arange(1, terms + 1)
    bubbles = (legendre[:, 2:] - legendre[:, :-2]) / (2 * np.sqrt(2 * k + 1))
    basis = np.column_stack([1 - points, points, bubbles])
    stiffness = np.eye(terms + 2)
    stiffness[0, 1] = stiffness[1, 0] = -1
    return points, weights, basis, stiffness, (basis.T * weights) @ basis


@cache
def _running_integral(terms):
    """Matrix from values at the quadrature points to their integrals from 0 up to each of them.

    Exact for what the points interpolate, by ∫P_k = (P_{k+1} − P_{k−1})/(2k + 1).
    """
    x, weights = leggauss(2 * terms)
    legendre = legvander(x, 2 * terms)
    inner = legendre[:, 2:] - legendre[:, :-2]
    antiderivatives = np.column_stack([1 + x, inner]) / 4
    return antiderivatives @ (legendre[:, :-1].T * weights)
