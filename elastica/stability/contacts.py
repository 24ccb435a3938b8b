"""Contacts eliminated one after the other from the stiffness that segments leave between them.

The stiffness T of the rotations (and advances) at contacts is block tridiagonal. Eliminating a contact next
to a segment with the halves A and B (`held`), where D is what lies on its far side, leaves at the next one

    D' = A + B − (B − A)P(B − A) = 4B + D − (2B + D)P(2B + D) = 4A + D − (2A + D)P(2A + D)

with P = (A + B + D)⁻¹.

Next to a held mode A or B is large, beside the transition to a line D is: of the three forms that one is used
which is a difference of the other two. The signs of all pivots tell how many negative eigenvalues T has. With
eliminations from both ends what is left at a contact is its Schur complement, whose derivative is the mass of
the vector that follows from there (I. S. Dhillon & B. N. Parlett, Multiple representations to compute
orthogonal eigenvectors of symmetric tridiagonal matrices, Linear Algebra and its Applications 387, 2004).

All matrices have the shape (u, u, n) with u = 1 or 2.

Not here: segments (`held`), eigenvalues (`counting`).
"""

from typing import NamedTuple

import numpy as np

from elastica.pendulum.segments import TINY


class Between(NamedTuple):
    """What two halves A and B of a segment are to the elimination of a contact.

    `smaller` is twice that of A and B which is not the larger one.
    """

    sum: np.ndarray
    difference: np.ndarray
    smaller: np.ndarray
    larger: np.ndarray
    of_A: np.ndarray

    @classmethod
    def of(cls, A, B):
        """Prepare for all eliminations next to this segment."""
        a, b = np.abs(A).max(axis=(0, 1)), np.abs(B).max(axis=(0, 1))
        of_A = a >= b
        return cls(A + B, B - A, 2 * np.where(of_A, B, A), np.maximum(a, b), of_A)


class Elimination(NamedTuple):
    """One contact eliminated.

    Attributes
    ----------
    rest : ndarray, shape (u, u, n)
        What it adds to the stiffness of the next contact.
    follows : ndarray, shape (u, u, n)
        From the unknowns u₁ there to û₀ where D is the largest of the three stiffnesses, to û₀ + u₁ where
        A is and to u₁ − û₀ where B is: what does not suffer from large numbers.
    of_D, of_A : ndarray of bool, shape (n,)
    negative : ndarray of int, shape (n,)
        Number of negative directions that are eliminated.
    """

    rest: np.ndarray
    follows: np.ndarray
    of_D: np.ndarray
    of_A: np.ndarray
    negative: np.ndarray

    @classmethod
    def of(cls, between, D):
        """Eliminate a contact on whose far side is D."""
        pivot = between.sum + D
        of_D = np.abs(D).max(axis=(0, 1)) > between.larger
        outer = between.smaller + D
        across = np.where(of_D, between.difference, outer)
        follows = _product(_inverse(pivot), across)
        rest = np.where(of_D, between.sum, between.smaller + outer) - _product(across, follows)
        return cls(rest, follows, of_D, between.of_A, _negative(pivot))

    def ends(self, unknown):
        """û₀ + u₁ and u₁ − û₀ for u₁ (u, n)."""
        image = _applied(self.follows, unknown)
        total = np.where(self.of_D, unknown + image, np.where(self.of_A, image, 2 * unknown - image))
        return total, 2 * unknown - total


class Edge(NamedTuple):
    """What becomes of the advance at an end of the strip.

    Attributes
    ----------
    advances : bool
        Whether it is an unknown of the segments; otherwise there is nothing to do.
    free : bool
        Whether it follows from the others; otherwise it vanishes.
    """

    advances: bool
    free: bool

    def stiffness(self, halves):
        """What is left of a segment at its contact (u, u, n), and how many negative directions are not."""
        if not self.advances:
            return np.sum(halves, axis=0), 0
        whole = _whole(halves)
        near = whole[1:, 1:]
        if not self.free:
            return near, 0
        follows = self._follows(whole)
        return near + whole[0, 1:, None] * follows, (whole[0, 0] < 0).astype(int)

    def mass(self, halves, masses):
        """−dS/dx of what is left."""
        if not self.advances:
            return np.sum(masses, axis=0)
        whole = _whole(masses)
        if not self.free:
            return whole[1:, 1:]
        follows = self._follows(_whole(halves))
        across = whole[0, 1:, None] * follows
        return whole[1:, 1:] + across + across.swapaxes(0, 1) + whole[0, 0] * follows[:, None] * follows

    @staticmethod
    def _follows(whole):
        """The far advance from the unknowns at the contact, shape (u, n)."""
        return -whole[0, 1:] / np.where(whole[0, 0] == 0, TINY, whole[0, 0])


def _whole(halves):
    """The matrix of a segment in its advance at the end of the strip and its unknowns at the contact."""
    if len(halves) == 1:
        last = len(halves[0]) - 1
        order = [last - 1, *range(last - 1), last]
        return halves[0][order][:, order]
    A, B = halves
    total, across = A + B, (A - B)[-1:]
    return np.concatenate(
        [
            np.concatenate([total[-1:, -1:], across], axis=1),
            np.concatenate([across.swapaxes(0, 1), total], axis=1),
        ]
    )


class Joined(NamedTuple):
    """What T consists of.

    Attributes
    ----------
    first, last : ndarray, shape (u, u, n)
        Stiffness of the first and of the last segment at its contact.
    inner : list of Between
        The segments from contact to contact.
    supports : ndarray, shape (contacts, u, u, n)
        What contacts add.
    """

    first: np.ndarray
    inner: list
    last: np.ndarray
    supports: np.ndarray


def negative(joined):
    """Number of negative eigenvalues of T, eliminated from end A on; shape (n,)."""
    first, inner, last, supports = joined
    found, D = 0, first + supports[0]
    for between, support in zip(inner, supports[1:], strict=True):
        elimination = Elimination.of(between, D)
        found, D = found + elimination.negative, elimination.rest + support
    return found + _negative(D + last)


def nearest(joined, masses, loads):
    """The same, and Newton's step to a singular T from the contact where T is nearest to singular.

    Parameters
    ----------
    joined : Joined
    masses : list
        −dS/dx of the first segment, of both halves of each inner one, of the last.
    loads : ndarray, shape (contacts, u, u, n)
        −d(supports)/dx.

    Returns
    -------
    negative : ndarray of int, shape (n,)
    step : ndarray, shape (n,)
        Of x.
    residual : ndarray, shape (n,)
        An eigenvalue is about so near: beside a pole of what is left at a contact the step is small as well.
    """
    first, inner, last, supports = joined
    left, near = [], [first + supports[0]]
    for between, support in zip(inner, supports[1:], strict=True):
        left.append(Elimination.of(between, near[-1]))
        near.append(left[-1].rest + support)
    right, far = [], [last]
    for between, support in zip(inner[::-1], supports[:0:-1], strict=True):
        right.append(Elimination.of(between, far[-1] + support))
        far.append(right[-1].rest)
    gamma = [a + b for a, b in zip(near, far[::-1], strict=True)]
    found = sum(each.negative for each in left) + _negative(gamma[-1])

    values, vectors = zip(*map(_smallest, gamma), strict=True)
    values = np.array(values)
    chosen = np.abs(values).argmin(axis=0)
    begin = [np.where(chosen == i, vector, 0.0) for i, vector in enumerate(vectors)]
    onward, after = _followed(right[::-1], begin)
    back, before = _followed(left[::-1], begin[::-1])
    slope = 0.0
    for (A, B), (a, b), (c, d) in zip(masses[1:-1], after, before[::-1], strict=True):
        # One of both is zero: each segment lies on one side of the chosen contact.
        slope = slope + _form(A, a + c) + _form(B, b + d)
    shape = [a + b - c for a, b, c in zip(onward, back[::-1], begin, strict=True)]
    for load, unknown in zip(loads, shape, strict=True):
        slope = slope + _form(load, unknown)
    slope = slope + _form(masses[0], shape[0]) + _form(masses[-1], shape[-1])
    sides = [masses[0], *(A + B for A, B in masses[1:-1]), masses[-1]]
    own = [_form(a + b + load, v) for a, b, load, v in zip(sides, sides[1:], loads, vectors, strict=False)]
    value, mass = (np.take_along_axis(np.array(each), chosen[None], axis=0)[0] for each in (values, own))
    return found, value / slope, np.abs(value) / np.sqrt(slope * mass)


def _followed(eliminations, begin):
    """Unknowns at all contacts that follow from where they begin, and û₀ + u₁, u₁ − û₀ of each segment."""
    unknowns, ends = [begin[0]], []
    for elimination, start in zip(eliminations, begin[1:], strict=True):
        total, difference = elimination.ends(unknowns[-1])
        unknowns.append(0.5 * (total - difference) + start)
        ends.append((total, difference))
    return unknowns, ends


def _product(a, b):
    return a * b if len(a) == 1 else (a[:, :, None] * b).sum(axis=1)


def _applied(a, vector):
    return a[0] * vector if len(a) == 1 else (a * vector).sum(axis=1)


def _form(a, vector):
    return (vector * _applied(a, vector)).sum(axis=0)


def _inverse(a):
    """Inverse of symmetric matrices; of a singular one a large number."""
    if len(a) == 1:
        return 1 / np.where(a == 0, TINY, a)
    determinant = _determinant(a)
    adjugate = np.array([[a[1, 1], -a[0, 1]], [-a[1, 0], a[0, 0]]])
    return adjugate / np.where(determinant == 0, TINY, determinant)


def _determinant(a):
    return a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]


def _negative(a):
    """Number of negative eigenvalues of symmetric matrices."""
    if len(a) == 1:
        return (a[0, 0] < 0).astype(int)
    return np.where(_determinant(a) < 0, 1, 2 * (a[0, 0] + a[1, 1] < 0))


def _smallest(a):
    """The eigenvalue of symmetric matrices that is least in size, and its unit vector (u, n)."""
    if len(a) == 1:
        return a[0, 0], np.ones_like(a[0])
    half, mean = 0.5 * (a[0, 0] - a[1, 1]), 0.5 * (a[0, 0] + a[1, 1])
    radius = np.hypot(half, a[0, 1])
    largest = mean + np.where(mean < 0, -radius, radius)
    value = _determinant(a) / np.where(largest == 0, TINY, largest)
    angle = 0.5 * np.arctan2(a[0, 1], half) + np.where(mean < 0, 0.0, 0.5 * np.pi)
    return value, np.array([np.cos(angle), np.sin(angle)])
