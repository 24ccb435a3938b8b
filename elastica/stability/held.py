"""Each segment reduced to its ends: modes with both ends held, and the stiffness they leave between them.

Segments talk only through what they share at contacts: the rotation φ there and, where the advance η_x
counts, that too. With Q the second variation of one segment, W its weight and x = ν + σ, an eigenvalue ν seen
from −σ, all that lies inside is eliminated by the modes with held ends, W-orthonormal with eigenvalues x_k:

    S(x) = K − x M − x² Σ g_k g_kᵀ/(x_k − x),        −dS/dx = M + Σ g_k g_kᵀ ρ (2 + ρ),   ρ = x/(x_k − x)

with K and M the stiffness and the mass of the static shape ψ at x = 0 that has a unit at one end, and
g = modeᵀ W ψ (R. R. Craig & M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6,
1968). Nothing is left out: all modes that the Legendre terms have are kept.

A segment that is its own mirror image falls into two halves, even and odd in φ. With û₀ and u₁ the unknowns
at its ends, the even one sees only û₀ + u₁ and the odd one only u₁ − û₀:

    (û₀ + u₁)ᵀ A (û₀ + u₁) + (u₁ − û₀)ᵀ B (u₁ − û₀),      u = (φ, η_x)

where û₀ is the neighbour's u₁: between opposite walls, where θ is even, the advance changes its sign from one
frame to the next, and so does the frame; between a wall and itself, where θ is odd, neither does.

Not here: how segments hang together (`counting`).
"""

from typing import NamedTuple

import numpy as np

from elastica.pendulum.segments import TINY, Pendulum
from elastica.stability.elements import profile
from elastica.stability.quadrature import element, running_integral
from elastica.state import Segment

BELOW = 1e-20
"""Relative distance from a held mode of what coincides with it."""
HELD, FREE, SHARED = "held", "free", "shared"
"""What becomes of the rotation or of the advance at an end: it is zero, its own, or that of a contact."""


class End(NamedTuple):
    """What is asked of one end of a segment.

    Attributes
    ----------
    rotation : str
        HELD, FREE or SHARED.
    advance : str
        The same of η_x; "" where it does not matter.
    stiffness : float
        Of the spring that holds a free end.
    """

    rotation: str
    advance: str = ""
    stiffness: float = 0.0

    @property
    def unknowns(self):
        """Number of unknowns that are shared with a contact."""
        return (self.rotation == SHARED) + (self.advance == SHARED)


class Half(NamedTuple):
    """A segment, or its even or odd half, reduced to the unknowns at its ends.

    Attributes
    ----------
    held : ndarray, shape (modes, n)
        Its eigenvalues x_k with held ends, in no order; infinite where they are not resolved.
    coupling : ndarray, shape (u, u, modes, n)
        g_k g_kᵀ.
    stiffness, mass : ndarray, shape (u, u, n)
        K and M.
    """

    held: np.ndarray
    coupling: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray

    @classmethod
    def joined(cls, parts):
        """The same halves of different points as one; where there are fewer modes the rest is infinite."""
        modes = max(len(part.held) for part in parts)
        held, coupling = [], []
        for part in parts:
            missing = modes - len(part.held)
            held.append(np.pad(part.held, ((0, missing), (0, 0)), constant_values=np.inf))
            coupling.append(np.pad(part.coupling, ((0, 0), (0, 0), (0, missing), (0, 0))))
        ends = ([part.stiffness for part in parts], [part.mass for part in parts])
        return cls(*(np.concatenate(fields, axis=-1) for fields in (held, coupling, *ends)))

    def at(self, points):
        """The same at some of the points."""
        return Half(*(np.take(field, points, axis=-1) for field in self))

    def below(self, x):
        """How many x_k lie below x (n,)."""
        return (self.held < x).view(np.int8).sum(axis=0, dtype=np.int16)

    def dynamic_stiffness(self, x):
        """S(x), shape (u, u, n)."""
        return self.stiffness - x * (self.mass + _over_modes(self.coupling, self._ratio(x)))

    def dynamic(self, x):
        """S(x) and −dS/dx, shape (u, u, n) each."""
        ratio = self._ratio(x)
        stiffness = self.stiffness - x * (self.mass + _over_modes(self.coupling, ratio))
        return stiffness, self.mass + _over_modes(self.coupling, ratio * (2 + ratio))

    def loss(self, x):
        """How much larger than all else the nearest held mode is in S(x), shape (n,)."""
        own = np.abs(np.einsum("uun->un", self.stiffness)) + np.abs(x) * np.einsum("uun->un", self.mass)
        # What costs nothing, as an advance of the whole without inertia, is not coupled.
        share = np.einsum("uumn->umn", self.coupling) / np.where(own == 0, 1.0, own)[:, None]
        return np.abs(x * self._ratio(x) * share.max(axis=0)).max(axis=0)

    def _ratio(self, x):
        """x/(x_k − x); where x is a held mode, just below it."""
        gap = self.held - x
        return x / np.where(gap == 0, BELOW * np.abs(x), gap)

    def to_held(self, x):
        """Way from x (n,) to the nearest x_k."""
        ways = self.held - x
        return np.take_along_axis(ways, np.abs(ways).argmin(axis=0)[None], axis=0)[0]


class Piece(NamedTuple):
    """A segment at n points, in its rising convention.

    Attributes
    ----------
    segment : Segment
    pendulum : Pendulum
    length : ndarray, shape (n,)
    start, end : End
    """

    segment: Segment
    pendulum: Pendulum
    length: np.ndarray
    start: End
    end: End

    @property
    def parity(self):
        """1 or −1 where θ is even or odd about the middle and both ends are alike, otherwise 0."""
        kind, start, end = self.segment.kind, self.start, self.end
        both = kind.start + kind.end
        if both != int(both) or kind.start_spring != kind.end_spring or FREE in (start.advance, end.advance):
            return 0
        if FREE in (start.rotation, end.rotation) and start != end:
            return 0
        return 1 if both % 2 else -1 if self.segment.rise == 0 else 0


def reduced(piece, terms, shift, unit, inertia):
    """A segment reduced to what its ends share with contacts.

    Parameters
    ----------
    piece : Piece
    terms : int
        Legendre bubbles.
    shift : ndarray, shape (n,)
        σ: x = ν + σ.
    unit : ndarray, shape (n,)
        Of the advance, which is small where angles are.
    inertia : bool
        Weight ∫ |η|² ds in place of ∫ φ² ds.

    Returns
    -------
    list of Half
        The even and the odd one, or the whole.
    """
    parity = piece.parity
    halves = []
    for half in (1, -1) if parity else (0,):
        Q, weight, inner = _constrained(*_forms(piece, terms, half, parity, unit, inertia))
        halves.append(_condensed(Q, weight, inner, shift))
    return halves


def _forms(piece, terms, half, parity, unit, inertia):
    """Q, its weight and the constraints of a half, or of the whole where `half` is 0.

    Unknowns are bubbles, ends that are free, what is shared: rotations, then advances.

    Returns
    -------
    Q, weight : ndarray, shape (n, size, size)
    constraints : list of ndarray, shape (n, size)
        Sums that vanish.
    inner, bubbles : int
        Number of unknowns that are not shared, and of bubbles among them.
    """
    ell, ends = piece.length[:, None], (piece.start, piece.end)
    points, weights, basis, stiffness, mass = element(terms, half)
    cos, sin, thrust = profile(piece.segment.kind, piece.pendulum, piece.length, points)
    measure = weights * ell
    bubbles = basis.shape[1] - (1 if half else 2)
    rotations = [ends[0]._replace(rotation=_joint(ends, "rotation"))] if half else ends
    place = [*range(bubbles)]
    for role in (FREE, SHARED):
        place += [bubbles + i for i, end in enumerate(rotations) if end.rotation == role]
    basis = basis[:, place]
    inner = bubbles + sum(end.rotation == FREE for end in rotations)

    weighted = basis.T * (measure * thrust)[:, None, :]
    # In C order also of a single point: BLAS rounds transposed matrices otherwise.
    stiffness, mass = (matrix[np.ix_(place, place)] for matrix in (stiffness, mass))
    Q = stiffness / ell[:, :, None] - weighted @ basis
    for i, end in enumerate(end for end in rotations if end.rotation == FREE):
        Q[:, bubbles + i, bubbles + i] += end.stiffness / (2 if half else 1)
    constraints = [_sum(measure * cos, basis)] if half >= 0 else []
    if not (inertia or piece.start.advance):
        return Q, ell[:, :, None] * mass, constraints, inner, bubbles

    along = half * parity
    drift = _sum(-measure * sin, basis)
    # Columns of the shared advances: what they move along all of it, and what they ask of its ends.
    rigid: list = []
    stretch: list = []
    if half and _joint(ends, "advance") == SHARED:
        rigid, stretch = ([0.5], [0.0]) if along < 0 else ([0.0], [1.0])
    elif not half:
        anchor = 1 if ends[0].advance == FREE else 0
        shared = [i for i, end in enumerate(ends) if end.advance == SHARED]
        rigid, stretch = [float(i == anchor) for i in shared], [2.0 * i - 1 for i in shared]
    more = len(rigid)
    Q = np.pad(Q, ((0, 0), (0, more), (0, more)))
    constraints = [np.pad(each, ((0, 0), (0, more))) for each in constraints]
    if along >= 0 and FREE not in (ends[0].advance, ends[1].advance):
        constraints.append(np.hstack([drift, -unit[:, None] * stretch]))
    if not inertia:
        weight = np.pad(ell[:, :, None] * mass, ((0, 0), (0, more), (0, more)))
        return Q, weight, constraints, inner, bubbles
    up = ell[:, :, None] * (running_integral(terms, half) @ (cos[:, :, None] * basis))
    on = ell[:, :, None] * (running_integral(terms, along) @ (-sin[:, :, None] * basis))
    if not half and ends[0].advance == FREE:
        on -= drift[:, None, :]
    carried = np.broadcast_to(unit[:, None, None] * rigid, (*on.shape[:2], more))
    on, up = np.concatenate([on, carried], axis=2), np.pad(up, ((0, 0), (0, 0), (0, more)))
    moved = np.concatenate([up, on], axis=1)
    weight = (moved * np.tile(measure, 2)[:, :, None]).transpose(0, 2, 1) @ moved
    return Q, weight, constraints, inner, bubbles


def _joint(ends, what):
    """What both ends of a symmetric segment make of its halves' only unknown: shared where one of them is."""
    roles = [getattr(end, what) for end in ends]
    return SHARED if SHARED in roles else roles[0]


def _over_modes(coupling, factor):
    """Sum over modes, one after the other: of a single point NumPy would add them in another order."""
    if factor.shape[-1] == 1:
        return _over_modes(*(np.repeat(each, 2, axis=-1) for each in (coupling, factor)))[..., :1]
    return np.einsum("uvmn,mn->uvn", coupling, factor)


def _sum(factor, basis):
    """∑ factor·basis over the quadrature points, shape (n, functions)."""
    return (factor[:, None, :] @ basis)[:, 0]


def _constrained(Q, weight, constraints, inner, bubbles):
    """Q and its weight on what keeps the constraints, one inner unknown less for each.

    A reflection of the bubbles turns a constraint into one on the first of them and the ends; that one
    follows from the others.
    """
    while constraints:
        first, *constraints = constraints
        norm = np.maximum(np.sqrt((first[:, :bubbles] ** 2).sum(axis=1)), TINY)
        v = np.zeros_like(first)
        v[:, :bubbles] = first[:, :bubbles] / norm[:, None]
        sign = np.where(v[:, 0] < 0, -1.0, 1.0)
        v[:, 0] += sign
        v /= np.sqrt(np.abs(v[:, :1]))
        t = -first / (sign * norm)[:, None]
        t[:, :bubbles] = 0
        constraints = [_followed(each - v * (v * each).sum(axis=1)[:, None], t) for each in constraints]
        Q, weight = (_kept(matrix, v, t) for matrix in (Q, weight))
        inner, bubbles = inner - 1, bubbles - 1
    return Q, weight, inner


def _followed(row, t):
    """A constraint once the first unknown is −t·(the others)."""
    return (row - row[:, :1] * t)[:, 1:]


def _kept(matrix, v, t):
    """(I − vvᵀ) matrix (I − vvᵀ), then its first unknown replaced by −t·(the others)."""
    w = (matrix @ v[:, :, None])[:, :, 0]
    w -= 0.5 * (v * w).sum(axis=1)[:, None] * v
    column = matrix[:, :, 0] - v * w[:, :1] - w * v[:, :1]
    column = column - 0.5 * column[:, :1] * t
    v, w, t, column = v[:, 1:], w[:, 1:], t[:, 1:], column[:, 1:]
    return matrix[:, 1:, 1:] - np.stack([v, w, t, column], axis=2) @ np.stack([w, v, column, t], axis=1)


def _condensed(Q, weight, inner, shift):
    """Modes with held ends, and what the shared unknowns see of them."""
    Q = Q + shift[:, None, None] * weight
    inverse = np.linalg.inv(Q[:, :inner, :inner])
    lower = np.linalg.cholesky(weight[:, :inner, :inner])
    root = inverse @ lower
    a, z = np.linalg.eigh(lower.transpose(0, 2, 1) @ root)
    # Below rounding the sign of an inverse means nothing.
    resolved = np.abs(a) > np.finfo(float).eps * np.abs(a).max(axis=1, keepdims=True)
    held = np.where(resolved, 1 / np.where(resolved, a, 1.0), np.inf)
    static = -inverse @ Q[:, :inner, inner:]
    across = weight[:, :inner, inner:] + weight[:, :inner, :inner] @ static
    modes = (root @ z) * np.where(resolved, held, 0.0)[:, None, :]
    coupling = modes.transpose(0, 2, 1) @ across
    stiffness = Q[:, inner:, inner:] + Q[:, inner:, :inner] @ static
    turned = static.transpose(0, 2, 1)
    mass = weight[:, inner:, inner:] + weight[:, inner:, :inner] @ static + turned @ across
    coupling = np.moveaxis(coupling, 0, -1)
    return Half(
        np.ascontiguousarray(held.T),
        np.moveaxis(coupling, 1, 0)[:, None] * np.moveaxis(coupling, 1, 0)[None],
        np.ascontiguousarray(np.moveaxis(stiffness, 0, -1)),
        np.ascontiguousarray(np.moveaxis(mass, 0, -1)),
    )
