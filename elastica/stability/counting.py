"""Eigenvalues of segments that hang together at contacts, counted and found one by one.

How many lie below x is known without finding any (W. H. Wittrick & F. W. Williams, A general algorithm for
computing natural frequencies of elastic structures, Quarterly Journal of Mechanics and Applied Mathematics 24,
1971): those of all segments with held ends, and the negative pivots of the block tridiagonal stiffness T(x) of
the contacts. Each pivot tells as well how far T is from singular there, and a step of Newton's method where the
eigenvector is largest closes in on an eigenvalue that is bracketed by counts.

Eliminating a contact next to a symmetric segment with halves A and B, where D is what lies on its far side:

    P = (A + B + D)⁻¹,    D' = A + B − (B − A)P(B − A) = 4B + D − (2B + D)P(2B + D) = 4A + D − (2A + D)P(2A + D)

Next to a held mode A or B is large, beside the transition to a line D: the form is used that is a difference of
the other two.

Not here: what a segment shows its neighbours (`held`).
"""

from typing import NamedTuple

import numpy as np

TINY = np.finfo(float).tiny
ASIDE = (-1e-8, -2e-14, 2e-14, 1e-8)
"""Relative distances from a held mode at which eigenvalues are counted: some coincide with it."""
ROUNDING = np.finfo(float).eps
SMALL, OVER, BLUR = 1e-10, 1e-11, 1e-12
"""Relative steps of Newton's method: below the first the next is rounding, the second is taken beyond its end,
and below the third the number of eigenvalues below is not certain."""
SMALL_BESIDE = 1e-3
"""Relative to the distance from the nearest held mode, next to which each step is small."""
MOST_STEPS = 200
PATIENCE = 6
"""Steps in which an interval has to have been halved, or it is."""
FEWER = 0.75
"""Share of the points left at which they are copied to go on alone."""


class Strip(NamedTuple):
    """Segments reduced to their ends, from end A to end B, at n points.

    Attributes
    ----------
    halves : list of list of Half
        Of each distinct segment.
    order : list of int
        Which of them follow each other from end A to end B.
    supports : ndarray, shape (contacts, u, u, n)
        What contacts add to the stiffness at x = 0.
    loads : ndarray, shape (contacts, u, u, n)
        What they add to the mass.
    """

    halves: list
    order: list
    supports: np.ndarray
    loads: np.ndarray

    def at(self, points):
        """The same at some of the points, which may be repeated."""
        halves = [[half.at(points) for half in each] for each in self.halves]
        return Strip(halves, self.order, self.supports[..., points], self.loads[..., points])

    def held(self):
        """Eigenvalues with all contacts held and how many segments have each: (modes, n), (modes,)."""
        values, times = [], []
        for number, each in enumerate(self.halves):
            for half in each:
                values.append(half.held)
                times += [self.order.count(number)] * len(half.held)
        return np.concatenate(values), np.array(times)

    def held_below(self, x):
        """How many of those lie below x (n,)."""
        return sum(
            self.order.count(number) * (half.held < x).sum(axis=0)
            for number, each in enumerate(self.halves)
            for half in each
        )

    def nearest(self, x):
        """Distance of x (n,) from the nearest of those."""
        return np.min([np.abs(half.held - x).min(axis=0) for each in self.halves for half in each], axis=0)


def eigenvalues(strip, count, least, scale):
    """The `count` lowest eigenvalues x.

    Parameters
    ----------
    strip : Strip
        At n points.
    count : int
    least : ndarray, shape (n,)
        Below all of them.
    scale : ndarray, shape (n,)
        The size of what they are differences of.

    Returns
    -------
    ndarray, shape (n, count)
        Ascending; infinite where there are not so many.
    """
    held, times = strip.held()
    order = np.argsort(held, axis=0, kind="stable")
    held, before = np.take_along_axis(held, order, axis=0), np.cumsum(times[order], axis=0) - times[order]
    if not strip.supports[..., 0].size:
        which = (before[:, None] <= np.arange(count)[:, None]).sum(axis=0) - 1
        return np.take_along_axis(held, which, axis=0).T
    # As many eigenvalues lie below a held mode as there are held modes: no others matter.
    rows = min(len(held), count)
    size = np.abs(held[:rows]) + scale
    places = np.sort(np.concatenate([held[:rows] + aside * size for aside in ASIDE]), axis=0)
    asked, point = np.nonzero(np.repeat(before[:rows] < count, len(ASIDE), axis=0) & np.isfinite(places))
    below = np.full(places.shape, np.iinfo(int).max)
    below[asked, point] = number_below(strip.at(point), places[asked, point])
    wanted = np.arange(1, count + 1)[:, None, None]
    low = np.maximum(least, np.where(below < wanted, places, -np.inf).max(axis=1))
    high = np.where(below >= wanted, places, np.inf).min(axis=1)
    mode, point = np.nonzero(np.isfinite(high))
    result = high.T.copy()
    result[point, mode] = _closed_in(
        strip, point, mode + 1, low[mode, point], high[mode, point], scale[point]
    )
    return result


def number_below(strip, x):
    """How many eigenvalues lie below x (n,)."""
    return strip.held_below(x) + Pivots.of(strip, x).negative


def _closed_in(strip, point, wanted, low, high, scale):
    """The eigenvalue with the number `wanted` in each interval of x, by Newton's method kept in it."""
    result = 0.5 * (low + high)
    live = np.arange(point.size)
    own, x, narrow = strip.at(point), result.copy(), np.full(point.size, np.inf)
    for step in range(MOST_STEPS):
        pivots = Pivots.of(own, x)
        missing = wanted[live] - own.held_below(x) - pivots.negative
        below = missing > 0
        low[live], high[live] = np.where(below, x, low[live]), np.where(below, high[live], x)
        move, size = pivots.newton(), scale[live] + np.abs(x)
        width, middle = high[live] - low[live], 0.5 * (low[live] + high[live])
        near = np.abs(move) <= SMALL * size
        # The next above or below is the one that is wanted; too near, the count itself would be rounding.
        next_ = np.where(below, (missing == 1) & (move > 0), (missing == 0) & (move < 0))
        met = near & next_ & (np.abs(move) > BLUR * size) & (np.abs(move) < SMALL_BESIDE * own.nearest(x))
        result[live] = np.where(met, x + move, middle)
        # From the other side it is told whether this is the one, also where two nearly coincide.
        over = np.where(below, OVER, -OVER) * size
        ahead = x + move + np.where(near, over, 0.0)
        stuck = False
        if step % PATIENCE == 0:
            stuck = width > 0.5 * narrow[live]
            narrow[live] = width
        x = np.where((ahead > low[live]) & (ahead < high[live]) & ~stuck, ahead, middle)
        open_ = ~met & (width > 4 * ROUNDING * size)
        if not open_.any():
            break
        if open_.sum() < FEWER * open_.size:
            live, x, own = live[open_], x[open_], own.at(open_)
    return result


class _Elimination(NamedTuple):
    """One contact eliminated next to a symmetric segment.

    Attributes
    ----------
    rest : ndarray, shape (u, u, n)
        What it adds to the stiffness of the next contact.
    follows : ndarray, shape (u, u, n)
        From the unknowns u₁ there to û₀ + u₁ where A is the largest of the three stiffnesses, to u₁ − û₀ where
        B is and to û₀ where D is: what does not suffer from large numbers.
    of_A, of_B : ndarray of bool, shape (n,)
    negative : ndarray of int, shape (n,)
        Number of negative directions that are eliminated.
    """

    rest: np.ndarray
    follows: np.ndarray
    of_A: np.ndarray
    of_B: np.ndarray
    negative: np.ndarray

    @classmethod
    def of(cls, A, B, D):
        """Eliminate a contact on whose far side is D."""
        pivot = A + B + D
        a, b, d = (np.abs(each).max(axis=(0, 1)) for each in (A, B, D))
        of_A, of_B = (a >= b) & (a >= d), (b > a) & (b >= d)
        own = np.where(of_A, 4 * B + D, np.where(of_B, 4 * A + D, A + B))
        across = np.where(of_A, 2 * B + D, np.where(of_B, 2 * A + D, B - A))
        follows = _product(_inverse(pivot), across)
        return cls(own - _product(across, follows), follows, of_A, of_B, _negative(pivot))

    def ends(self, unknown):
        """û₀ + u₁ and u₁ − û₀ for u₁ (u, n)."""
        image = _applied(self.follows, unknown)
        total = np.where(self.of_A, image, unknown + np.where(self.of_B, unknown - image, image))
        return total, 2 * unknown - total


class Pivots(NamedTuple):
    """T(x) eliminated from both ends towards each contact.

    Attributes
    ----------
    negative : ndarray of int, shape (n,)
        Number of its negative eigenvalues.
    gamma : list of ndarray, shape (u, u, n)
        What is left at each contact when all others are eliminated.
    left, right : list of _Elimination
        Of each contact but the last, and of each but the first.
    masses : list
        −dS/dx of the first segment, of the halves of each inner one, and of the last.
    loads : ndarray, shape (contacts, u, u, n)
    """

    negative: np.ndarray
    gamma: list
    left: list
    right: list
    masses: list
    loads: np.ndarray

    @classmethod
    def of(cls, strip, x):
        """Eliminate at x (n,)."""
        dynamic = [[half.dynamic(x) for half in each] for each in strip.halves]
        first, last = ([sum(field) for field in zip(*dynamic[strip.order[end]], strict=True)] for end in (0, -1))
        inner = [dynamic[number] for number in strip.order[1:-1]]
        supports = strip.supports - x * strip.loads
        left, right, near, far = [], [], [first[0] + supports[0]], [last[0]]
        for (A, _), (B, _), support in zip(*_columns(inner), supports[1:], strict=True):
            left.append(_Elimination.of(A, B, near[-1]))
            near.append(left[-1].rest + support)
        for (A, _), (B, _), support in zip(*_columns(inner[::-1]), supports[:0:-1], strict=True):
            right.append(_Elimination.of(A, B, far[-1] + support))
            far.append(right[-1].rest)
        gamma = [a + b for a, b in zip(near, far[::-1], strict=True)]
        negative = sum(each.negative for each in left) + _negative(gamma[-1])
        masses = [first[1], *((A[1], B[1]) for A, B in inner), last[1]]
        return cls(negative, gamma, left, right[::-1], masses, strip.loads)

    def newton(self):
        """Newton's step (n,) for what is left at the contact where T is nearest to singular."""
        values, vectors = zip(*(_smallest(gamma) for gamma in self.gamma), strict=True)
        chosen = np.abs(values).argmin(axis=0)
        begin = [np.where(chosen == i, vector, 0.0) for i, vector in enumerate(vectors)]
        slope = 0.0
        rightward, leftward = [begin[0]], [begin[-1]]
        inner = self.masses[1:-1]
        for elimination, (A, B), start in zip(self.right, inner, begin[1:], strict=True):
            slope = slope + _carry(elimination, A, B, rightward, start)
        for elimination, (A, B), start in zip(self.left[::-1], inner[::-1], begin[-2::-1], strict=True):
            slope = slope + _carry(elimination, A, B, leftward, start)
        shape = [a + b - c for a, b, c in zip(rightward, leftward[::-1], begin, strict=True)]
        for load, unknown in zip(self.loads, shape, strict=True):
            slope = slope + _form(load, unknown)
        slope = slope + _form(self.masses[0], shape[0]) + _form(self.masses[-1], shape[-1])
        return np.take_along_axis(np.array(values), chosen[None], axis=0)[0] / slope


def _carry(elimination, A, B, unknowns, start):
    """Continue the eigenvector to the next contact; gives what the segment between has in mass."""
    total, difference = elimination.ends(unknowns[-1])
    unknowns.append(0.5 * (total - difference) + start)
    return _form(A, total) + _form(B, difference)


def _columns(pairs):
    """A list of pairs as a pair of lists."""
    return tuple(zip(*pairs, strict=True)) or ((), ())


def _product(a, b):
    """Product of small matrices, shape (u, u, n)."""
    return (a[:, :, None] * b).sum(axis=1)


def _applied(a, vector):
    """A small matrix (u, u, n) times a vector (u, n)."""
    return (a * vector).sum(axis=1)


def _form(a, vector):
    """The quadratic form of a small matrix."""
    return (vector * _applied(a, vector)).sum(axis=0)


def _inverse(a):
    """Inverse of symmetric matrices, shape (u, u, n), u = 1 or 2; of a singular one a large number."""
    if len(a) == 1:
        return 1 / np.where(a == 0, TINY, a)
    determinant = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    adjugate = np.array([[a[1, 1], -a[0, 1]], [-a[1, 0], a[0, 0]]])
    return adjugate / np.where(determinant == 0, TINY, determinant)


def _negative(a):
    """Number of negative eigenvalues of symmetric matrices, u = 1 or 2."""
    if len(a) == 1:
        return (a[0, 0] < 0).astype(int)
    determinant = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    return np.where(determinant < 0, 1, 2 * (a[0, 0] + a[1, 1] < 0))


def _smallest(a):
    """The eigenvalue of symmetric matrices, u = 1 or 2, that is least in size, and its unit vector (u, n)."""
    if len(a) == 1:
        return a[0, 0], np.ones_like(a[0])
    half, mean = 0.5 * (a[0, 0] - a[1, 1]), 0.5 * (a[0, 0] + a[1, 1])
    radius = np.hypot(half, a[0, 1])
    largest = mean + np.where(mean < 0, -radius, radius)
    value = (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]) / np.where(largest == 0, TINY, largest)
    angle = 0.5 * np.arctan2(a[0, 1], half) + np.where(mean < 0, 0.0, 0.5 * np.pi)
    return value, np.array([np.cos(angle), np.sin(angle)])
