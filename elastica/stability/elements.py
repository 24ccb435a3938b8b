"""The free segments of a strip at many points, in batches, and how many Legendre terms they need.

θ has poles K'(m) off the real axis of its phase √F s, so on a segment of phase L eigenvalues converge as
exp(−2n asinh(2K'/L)). Shallow segments have distant poles and need few.

Not here: what is made of them (`held`, `dense`).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import ellipkm1

from elastica.codes import Status
from elastica.equilibria.roots import pendulums_of
from elastica.pendulum.segments import TINY, Kind, Pendulum
from elastica.pendulum.swing import directions, start_phase
from elastica.scales import FOUR_PI_SQUARED
from elastica.state import Segment

TRUNCATION = 1e-11
"""Relative error that is left to the poles of θ where F = π²; it falls as F⁻², since eigenvalues near
zero are differences of terms ∝ F, and squared frequencies of terms ∝ F²."""
MORE_TERMS = 6
"""Bubbles beyond those, beyond half a bubble per radian of phase and beyond `LEAST_TERMS`, that the lowest
eigenvalues need."""
LEAST_TERMS = 4
TERMS_ROUNDED_TO, OF_LONG_WORDS, LONG_WORD = 4, 6, 8
"""Points with about as many terms share a batch; of words with more segments than the last the work is that
of handing out many small arrays, and batches are larger."""
LARGEST_GROWTH = 9.0
"""−ω² in units of c² stays below this (`vibration`)."""
SHIFT = 1e-3
"""σ in the same units: far above rounding, small enough to keep the digits of ω²."""
LONGEST_PHASE = 80.0
"""Longer segments are left out."""
STRAIGHT_PHASE = 320.0
"""The same for the straight strip, which has no poles."""
BATCH_ENTRIES = 400_000
"""Entries of the matrices of a batch: larger ones leave the cache."""
BATCH_VALUES = 8_000
"""Eigenvalues of a batch."""
STRAIGHT = Segment(Kind(0, 1), 0, 0)
AT_REST = 1e-100
"""Thrust in place of none: the straight strip is the pendulum at rest, whose F must not vanish."""


class Vertex(NamedTuple):
    """A contact or an end that may rotate: the coefficient of φ² in Q is reaction/curvature, arrays (n,)."""

    reaction: np.ndarray
    kappa: np.ndarray


class Elements(NamedTuple):
    """The free segments from end A to end B at n points, and the vertex conditions.

    Attributes
    ----------
    segments : tuple of Segment
    reverse : list of bool
        Whether each runs towards end A in its rising convention.
    sides : list of int
        −1 for mirrored segments.
    pendulums : list of Pendulum
    lengths : list of ndarray, shape (n,)
    flats : list of ndarray, shape (n,)
        Length that lies flat in front of each.
    vertex : list of Vertex or None
        `vertex[i]` belongs to the start of segment i, the last one to end B: None where φ = 0. Pinned
        ends have no reaction.
    """

    segments: tuple
    reverse: list
    sides: list
    pendulums: list
    lengths: list
    flats: list
    vertex: list

    @property
    def largest_thrust(self):
        """F, for which Q ≥ −F ∫φ²: the reactions of a solved state push; shape (n,)."""
        return np.max([q.F for q in self.pendulums], axis=0)

    @property
    def growth(self):
        """c², of which −ω² is at most `LARGEST_GROWTH` times (`vibration`), shape (n,)."""
        return np.max([q.F * (1 + 4 * q.m) for q in self.pendulums], axis=0) ** 2

    @property
    def sliding(self):
        """Full periods between places with θ = θ' = 0: of a line state each has an exact zero, θ'."""
        return sum(
            segment.kind.start == int(segment.kind.start) and not segment.kind.springs
            for segment in self.segments
        )


def profile(kind, pendulum, length, points):
    """The cosine and sine of θ, and the thrust p cos θ + λ sin θ, along a segment in its rising convention.

    Parameters
    ----------
    kind : Kind
    pendulum : Pendulum
        Arrays of shape (n,).
    length : ndarray, shape (n,)
    points : ndarray, shape (q,)
        Places between 0 and 1.

    Returns
    -------
    cos, sin, thrust : ndarray, shape (n, q)
    """
    q = Pendulum(*(field[:, None] for field in pendulum))
    cos_psi, sin_psi = directions(q, start_phase(kind, pendulum)[:, None] + q.r * length[:, None] * points)
    cos = q.cos_alpha * cos_psi - q.sin_alpha * sin_psi
    return cos, q.cos_alpha * sin_psi + q.sin_alpha * cos_psi, q.F * cos_psi


def batches(solution, count, contacts_move=True, terms=None, only=None, joined=False):
    """The solved points of a solution in batches, each with its elements.

    Parameters
    ----------
    solution : Solution
    count : int
        Eigenvalues wanted.
    contacts_move : bool
        False leaves out the sum over contacts in Q.
    terms : int, optional
        Bubbles per element, for all shapes; by default as many as each shape needs.
    only : ndarray of int, optional
        Flat indices of the points to look at.
    joined : bool
        Whether matrices are made of all segments together.

    Yields
    ------
    points : ndarray of int, shape (n,)
        Flat indices. Shapes whose phase √F ℓ is too long for the elements are left out.
    elements : Elements
    terms : int
        Bubbles per element.
    """
    state = solution.state
    solved = np.flatnonzero(solution.status == Status.SOLVED)
    if only is not None:
        solved = np.intersect1d(solved, only)
    for points, segments in [(solved, (STRAIGHT,))] if state.straight else solution.patterns(solved):
        p = np.maximum(FOUR_PI_SQUARED * solution.P.ravel()[points], AT_REST)
        kappa = solution.curvature.ravel()[points]
        if state.straight:
            # The least swing of which it is known where θ = 0.
            kappa = 2 * np.sqrt(p) * np.sqrt(TINY)
            lam, lengths = np.zeros((points.size, 1)), np.ones((points.size, 1))
        else:
            lam, lengths = (
                field.reshape(-1, len(segments))[points] for field in (solution.lam, solution.lengths)
            )
        fields = (
            p,
            kappa,
            solution.flat_length.ravel()[points],
            lam,
            lengths,
        )
        pendulums = pendulums_of(segments, fields[0], fields[1], lam.T)
        rounded_to = OF_LONG_WORDS if len(segments) > LONG_WORD else TERMS_ROUNDED_TO
        needed = _terms(pendulums, lengths.T, state.straight, rounded_to)
        # Each segment has its share of the half waves of the highest mode, with π/2 bubbles for each.
        waves = -(-2 * (count + 1) // len(segments))
        if terms is not None:
            needed, waves = np.where(needed > 0, terms, 0), 0
        for number in np.unique(needed[needed > 0]):
            group = np.flatnonzero(needed == number)
            entries = (number * (len(segments) if joined else 1)) ** 2
            batch = max(1, min(BATCH_ENTRIES // entries, BATCH_VALUES // count))
            for some in np.split(group, range(batch, group.size, batch)):
                own = [Pendulum(*(field[some] for field in q)) for q in pendulums]
                elements = _elements(
                    solution, segments, contacts_move, own, *(field[some] for field in fields)
                )
                yield points[some], elements, int(number) + waves


def _terms(pendulums, lengths, straight, rounded_to):
    """Bubbles per element that the poles and waves of a shape ask for, shape (n,); 0: too many."""
    longest, poles = 0.0, 0.0
    for q, ell in zip(pendulums, lengths, strict=True):
        phase = q.r * ell
        longest = np.maximum(longest, phase)
        if not straight:
            distance = 2 * ellipkm1(np.maximum(q.m, TINY)) / phase
            digits = 2 * np.log(np.maximum(q.F / np.pi**2, 1.0)) - np.log(TRUNCATION)
            poles = np.maximum(poles, digits / (2 * np.arcsinh(distance)))
    terms = np.maximum(np.maximum(poles, longest / 2), LEAST_TERMS) + MORE_TERMS
    terms = rounded_to * np.ceil(terms / rounded_to)
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
        segments,
        [False] if state.straight else list(state.reversed_segments(ends)),
        sides,
        pendulums,
        list(lengths.T),
        [np.zeros_like(p), *(flat for _ in walls)],
        [edge[0], *contacts, edge[1]],
    )
