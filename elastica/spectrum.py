"""Eigenvalues of the second variation with moving contacts, by Legendre elements.

Each free segment is one element with the two linear vertex functions and integrated Legendre polynomials
as bubbles; these are orthonormal in ∫φ'g', so the stiffness of an element is

             v₀   v₁   bubbles
        v₀ [  1   −1     0   ]
    1/ℓ v₁ [ −1    1     0   ]      contacts and pinned ends share a vertex, clamps and the ends of
  bubbles  [  0    0     I   ]      lines drop it; the reaction adds μ/κ to a contact's vertex

and Q differs from it by something compact. Each segment's height constraint is eliminated by an orthogonal
basis of its null space. The pencil (Q, ∫φ²) is solved shifted and inverted, 1/(ν + σ): so the low
eigenvalues keep the digits that the largest one, ∝ (terms)⁴, would take.

Symmetric states are solved by halves: rotations of the middle are free in even, zero in odd modes.
"""

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from elastica.codes import Status
from elastica.elliptic import jacobi
from elastica.equilibrium import pendulums_of
from elastica.euler import euler_root
from elastica.scales import FOUR_PI_SQUARED
from elastica.segments import start_phase, swing_at

TERMS_FOR_PHASE = {6.8: 32, 10.0: 56, 14.0: 84, 18.0: 112, 24.0: 144, 50.0: 288, 80.0: 448}
"""Bubbles per element for a pendulum phase L = √F ℓ up to the key. The pendulum's poles lie K' ≥ π/2 off the
real axis, so (without a margin) eigenvalues converge as exp(−2n asinh(π/L)) for n bubbles."""
BATCH_ENTRIES = 100_000
"""Matrix entries of a batch: larger ones leave the cache."""


def eigenvalues(solution, count):
    """The `count` lowest eigenvalues of Q at every solved point of a solution.

    Parameters
    ----------
    solution : Solution
    count : int
        At least 1.

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
    if not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count = {count!r}; ask for at least one eigenvalue")
    shape = solution.status.shape
    result = np.full((solution.status.size, count), np.nan)
    solved = np.flatnonzero(solution.status == Status.SOLVED)
    p = FOUR_PI_SQUARED * solution.P.ravel()[solved]
    if solution.state.straight:
        result[solved] = euler_root(np.arange(1, count + 1), solution.ends) ** 2 - p[:, None]
        return result.reshape(*shape, count)
    for points, segments in solution.patterns(solved):
        result[points] = _of_pattern(solution, points, segments, count)
    return result.reshape(*shape, count)


def _of_pattern(solution, points, segments, count):
    """Eigenvalues at points that share their segments, shape (points, count)."""
    p = FOUR_PI_SQUARED * solution.P.ravel()[points]
    kappa = solution.curvature.ravel()[points]
    lam, lengths = (array.reshape(-1, len(segments))[points] for array in (solution.lam, solution.lengths))
    result = np.full((points.size, count), np.nan)
    halved = solution.state.mode and solution.ends.alike
    phase = (np.sqrt(np.hypot(p[:, None], lam)) * lengths / (2 if halved else 1)).max(axis=1)
    lower = 0.0
    for upper, terms in TERMS_FOR_PHASE.items():
        group = np.flatnonzero((phase > lower) & (phase <= upper))
        lower = upper
        batch = max(1, BATCH_ENTRIES // (terms * len(segments)) ** 2)
        for some in np.split(group, range(batch, group.size, batch)):
            if some.size:
                fields = (field[some] for field in (p, kappa, lam, lengths))
                result[some] = _lowest(solution, segments, *fields, terms + count, count)
    return result


class Contact(NamedTuple):
    """A vertex that may rotate: the coefficient of φ² in Q is reaction/curvature, arrays (n,)."""

    reaction: np.ndarray
    kappa: np.ndarray


class Elements(NamedTuple):
    """A chain of free segments: (n,) arrays in lists, one entry a segment, and the vertex conditions.

    `vertex[i]` belongs to the start of segment i, the last one to the end of the chain: None where
    φ = 0, otherwise a `Contact`; pinned ends have no reaction. `constrained` says whether the height
    of each segment is held.
    """

    kinds: list
    reverse: list
    pendulums: list
    lengths: list
    vertex: list
    constrained: bool = True


def _lowest(solution, segments, p, kappa, lam, lengths, terms, count):
    """Eigenvalues of a batch, shape (n, count)."""
    state, ends = solution.state, solution.ends
    kinds = [segment.kind for segment in segments]
    last = len(kinds) - 1
    pendulums = pendulums_of(segments, p, kappa, lam.T)
    edge = [None if end.clamped else Contact(np.full_like(p, end.stiffness), np.ones_like(p)) for end in ends]
    contacts = [None if state.line else Contact(a + b, kappa) for a, b in pairwise(lam.T)]
    whole = Elements(
        kinds,
        list(state.reversed_segments(ends)),
        pendulums,
        list(lengths.T),
        [edge[0], *contacts, edge[1]],
    )
    if state.line:
        values = [_spectrum(_part(whole, i, i + 1), terms, count) for i in range(last + 1)]
        for kind, eigenvalues_of_segment in zip(kinds, values, strict=True):
            # A full period between places with θ = θ' = 0 slides at no cost.
            if kind.start == int(kind.start) and not kind.springs:
                nearest = np.abs(eigenvalues_of_segment).argmin(axis=1)
                np.put_along_axis(eigenvalues_of_segment, nearest[:, None], 0.0, axis=1)
    elif len(segments) % 2 == 0 and state.symmetric(ends) and segments == segments[::-1]:
        half = _part(whole, 0, (last + 1) // 2)
        middle = half.vertex[-1]
        even = half._replace(vertex=[*half.vertex[:-1], middle._replace(reaction=middle.reaction / 2)])
        odd = half._replace(vertex=[*half.vertex[:-1], None])
        values = [_spectrum(part, terms, count) for part in (even, odd)]
    elif state.mode and ends.alike:
        # Halves of the only segment; odd modes keep the height of the ends by themselves.
        free = Contact(np.zeros_like(p), np.ones_like(p))
        even = whole._replace(lengths=[lengths[:, 0] / 2], vertex=[edge[0], free])
        odd = even._replace(vertex=[edge[0], None], constrained=False)
        values = [_spectrum(part, terms, count) for part in (even, odd)]
    else:
        values = [_spectrum(whole, terms, count)]
    return np.sort(np.concatenate(values, axis=1), axis=1)[:, :count]


def _part(elements, first, last):
    """Segments first … last − 1 of a chain."""
    return Elements(*(field[first:last] for field in elements[:4]), elements.vertex[first : last + 1])


def _spectrum(elements, terms, count):
    """Lowest eigenvalues of one chain of elements, shape (n, count)."""
    vertices = [i for i, spring in enumerate(elements.vertex) if spring is not None]
    size = len(vertices) + terms * len(elements.kinds)
    n = elements.lengths[0].size
    Q, mass = np.zeros((2, n, size, size))
    heights = np.zeros((n, size, len(elements.kinds)))
    for i, (kind, reverse, q, ell) in enumerate(
        zip(elements.kinds, elements.reverse, elements.pendulums, elements.lengths, strict=True)
    ):
        local = [v for v in (0, 1) if i + v in vertices]
        place = [vertices.index(i + v) for v in local]
        place += range(len(vertices) + i * terms, len(vertices) + (i + 1) * terms)
        local += range(2, terms + 2)
        stiffness, inertia, height = _element(kind, reverse, q, ell, terms)
        block, rows = np.ix_(range(n), place, place), np.ix_(local, local)
        Q[block] += stiffness[:, rows[0], rows[1]]
        mass[block] += inertia[:, rows[0], rows[1]]
        heights[:, place, i] = height[:, local]
    for place, vertex in enumerate(vertices):
        # In the unit of rotation 1/√(1 + μℓ/κ) the stiffness μ/κ stays finite as κ → 0.
        reaction, kappa = elements.vertex[vertex]
        total = kappa + np.abs(reaction) * elements.lengths[0]
        unit = np.sqrt(kappa / total)[:, None]
        for matrix in (Q, mass):
            matrix[:, place, :] *= unit
            matrix[:, :, place] *= unit
        heights[:, place, :] *= unit
        Q[:, place, place] += reaction / total
    if elements.constrained:
        basis = np.linalg.qr(heights, mode="complete")[0][:, :, len(elements.kinds) :]
        across = basis.transpose(0, 2, 1)
        Q, mass = across @ Q @ basis, across @ mass @ basis
    # Q ≥ −F ∫φ², since the reactions of a solved state push.
    shift = np.max([q.F for q in elements.pendulums], axis=0)[:, None]
    lower = np.linalg.inv(np.linalg.cholesky(Q + shift[:, :, None] * mass))
    inverse = np.linalg.eigvalsh(lower @ mass @ lower.transpose(0, 2, 1))
    with np.errstate(divide="ignore"):
        return 1 / inverse[:, ::-1][:, :count] - shift


def _element(kind, reverse, q, ell, terms):
    """Q, mass and height constraint of one segment, local order v₀, v₁, bubbles."""
    points, weights, basis, stiffness, inertia = _reference(terms)
    u = start_phase(kind, q)[:, None] + (q.r * ell)[:, None] * points
    sn, cn, _ = jacobi(u, q.K[:, None], q.m[:, None])
    psi = swing_at(q, sn, cn)
    if reverse:
        basis = basis[::-1]
    weighted = basis.T * (weights * ell[:, None] * q.F[:, None] * np.cos(psi))[:, None, :]
    Q = stiffness / ell[:, None, None] - weighted @ basis
    cos_theta = np.cos(psi + q.alpha[:, None])
    height = ((weights * ell[:, None] * cos_theta)[:, None, :] @ basis)[:, 0]
    return Q, inertia * ell[:, None, None], height


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
