"""Eigenvalues of segments that hang together at contacts, counted and found one by one.

How many lie below x is known without finding any (W. H. Wittrick & F. W. Williams, A general algorithm for
computing natural frequencies of elastic structures, Quarterly Journal of Mechanics and Applied Mathematics
24, 1971): those of all segments with held ends, and the negative eigenvalues of the stiffness T(x) of the
contacts.
Counts bracket each of them, Newton's method closes in.

Not here: what a segment shows its neighbours (`held`), how contacts are eliminated (`contacts`).
"""

from typing import NamedTuple

import numpy as np

from elastica.stability.contacts import Between, Joined, nearest, negative
from elastica.stability.held import Half

ASIDE, CLOSER = 1e-8, (1e-10, 1e-12, 2e-14)
"""Relative distances from a held mode at which eigenvalues are counted: some coincide with it, and the closer
the less certain the count."""
SHARES, MOST_ROUNDS = np.arange(1, 4) / 4, 2
"""Where intervals are divided by counts, and how often: with many contacts one may hold many eigenvalues."""
SMALL, OVER, BLUR = 5e-12, 3e-12, 1e-12
"""Relative steps of Newton's method: below the first the next is rounding, the second is taken beyond its
end, and below the third the number of eigenvalues below is not certain."""
SMALL_BESIDE = 0.1
"""Part of the way to the nearest held mode: what leads there is not a step to an eigenvalue."""
NEAR_ZERO = 1e-9
"""In units of σ: an eigenvalue that is known to vanish is not below."""
CLOSED = 1e-14
"""Relative width of an interval that is narrow enough: where two eigenvalues coincide only this ends it."""
MOST_STEPS = 100
MOST_LOST = 3e6
"""Factor by which a held mode is larger than the rest from which on its rounding matters."""
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
    edges : tuple of Edge
        What becomes of the advance at ends A and B.
    """

    halves: list
    order: list
    supports: np.ndarray
    loads: np.ndarray
    edges: tuple

    @classmethod
    def joined(cls, parts):
        """Strips of the same segments as one."""
        first, *others = parts
        if not others:
            return first
        halves = [
            [Half.joined(halves) for halves in zip(*each, strict=True)]
            for each in zip(*(part.halves for part in parts), strict=True)
        ]
        supports, loads = (
            np.concatenate(fields, axis=-1)
            for fields in zip(*((part.supports, part.loads) for part in parts), strict=True)
        )
        return first._replace(halves=halves, supports=supports, loads=loads)

    def at(self, points):
        """The same at some of the points, which may be repeated."""
        halves = [[half.at(points) for half in each] for each in self.halves]
        supports, loads = (np.take(field, points, axis=-1) for field in (self.supports, self.loads))
        return self._replace(halves=halves, supports=supports, loads=loads)

    @property
    def talks(self):
        """Whether segments share anything."""
        return self.supports.shape[0] * self.supports.shape[1] > 0

    @property
    def held(self):
        """Eigenvalues with all contacts held and how many segments have each: (modes, n), (modes,)."""
        values, times = [], []
        for number, each in enumerate(self.halves):
            for half in each:
                values.append(half.held)
                times += [self.order.count(number)] * len(half.held)
        return np.concatenate(values), np.array(times)

    def to_held(self, x):
        """Way from x (n,) to the nearest of those."""
        ways = np.array([half.to_held(x) for each in self.halves for half in each])
        return np.take_along_axis(ways, np.abs(ways).argmin(axis=0)[None], axis=0)[0]

    def doubtful(self, x):
        """Whether so much of the stiffness at x (n,) is that of the nearest held mode that it hides the rest.

        A single unknown at each contact loses nothing.
        """
        if self.supports.shape[1] < 2:
            return np.zeros(x.size, bool)
        return np.max([half.loss(x) for each in self.halves for half in each], axis=0) > MOST_LOST

    @np.errstate(all="ignore")
    def below(self, x):
        """How many eigenvalues lie below x (n,)."""
        if not self.talks:
            return self._held_below(x)
        stiffness = [[half.dynamic_stiffness(x) for half in each] for each in self.halves]
        joined, released = self._joined(stiffness, x)
        return self._held_below(x) + released + negative(joined)

    def step(self, x):
        """The same, Newton's step to one of them, and how near one is."""
        dynamic = [[half.dynamic(x) for half in each] for each in self.halves]
        stiffness, masses = ([[half[i] for half in each] for each in dynamic] for i in (0, 1))
        joined, released = self._joined(stiffness, x)
        in_order = [masses[number] for number in self.order]
        for end, edge in zip((0, -1), self.edges, strict=True):
            in_order[end] = edge.mass(stiffness[self.order[end]], in_order[end])
        found, step, residual = nearest(joined, in_order, self.loads)
        return self._held_below(x) + released + found, step, residual

    def _held_below(self, x):
        return sum(
            self.order.count(number) * half.below(x)
            for number, each in enumerate(self.halves)
            for half in each
        )

    def _joined(self, stiffness, x):
        """What T(x) consists of, and the number of negative directions that are eliminated with its ends."""
        between = {number: Between.of(*stiffness[number]) for number in set(self.order[1:-1])}
        ends = [
            edge.stiffness(stiffness[self.order[end]]) for end, edge in zip((0, -1), self.edges, strict=True)
        ]
        inner = [between[number] for number in self.order[1:-1]]
        joined = Joined(ends[0][0], inner, ends[1][0], self.supports - x * self.loads)
        return joined, ends[0][1] + ends[1][1]


def with_zeros(strip, values, shift, number):
    """Eigenvalues ν (n, count); the `number` after the negative ones are known to vanish and set to 0.0."""
    if not number:
        return values
    after = np.arange(values.shape[1]) - strip.below(shift * (1 - NEAR_ZERO))[:, None]
    return np.where((after >= 0) & (after < number), 0.0, values)


@np.errstate(all="ignore")
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
    values : ndarray, shape (n, count)
        Ascending; infinite where there are not so many.
    doubtful : ndarray of bool, shape (n,)
        Where one lies so near a held mode that the stiffness there has lost digits.
    """
    held, times = strip.held
    order = np.argsort(held, axis=0, kind="stable")
    held, before = np.take_along_axis(held, order, axis=0), np.cumsum(times[order], axis=0) - times[order]
    if not strip.talks:
        which = (before[:, None] <= np.arange(count)[:, None]).sum(axis=0) - 1
        return np.take_along_axis(held, which, axis=0).T, np.zeros(least.size, bool)
    # As many eigenvalues lie below a held mode as there are held modes: no others matter.
    rows = min(len(held), count)
    needed = (before[:rows] < count) & np.isfinite(held[:rows])
    aside = ASIDE * (np.abs(held[:rows]) + scale)
    places = np.sort(np.concatenate([held[:rows] - aside, held[:rows] + aside]), axis=0)[:, None]
    low, high = np.broadcast_to(least, (count, least.size)), np.full((count, least.size), np.inf)
    low, high = _narrowed(strip, places, np.repeat(needed, 2, axis=0)[:, None], low, high)
    # Most states are stable: ν = 0 is a bound of all or all but few.
    low, high = _narrowed(strip, scale[None, None], np.ones((1, 1, scale.size), bool), low, high)
    middle = 0.5 * (low + high)
    beside = high - low <= 3 * ASIDE * (np.abs(middle) + scale)
    if beside.any():
        mode, point = where = np.nonzero(beside)
        middle[where] += strip.at(point).to_held(middle[where])
        for closer in CLOSER:
            aside = closer * (np.abs(middle) + scale)
            places = np.stack([middle - aside, middle + aside])
            low, high = _narrowed(strip, places, beside & (low < places) & (places < high), low, high)
    for _ in range(min(len(strip.order) // 2 - 1, MOST_ROUNDS)):
        places = low + (high - low) * SHARES[:, None, None]
        low, high = _narrowed(strip, places, np.isfinite(places) & ~beside, low, high)
    mode, point = where = np.nonzero(np.isfinite(high))
    result = high.copy()
    result[where] = _closed_in(strip, point, mode + 1, low[where], high[where], scale[point])
    doubtful = np.zeros(least.size, bool)
    doubtful[point[strip.at(point).doubtful(result[where])]] = True
    return result.T, doubtful


def _narrowed(strip, places, asked, low, high):
    """Intervals (count, n) of the eigenvalues once those below places (k, count or 1, n) are counted."""
    below, places = np.full(places.shape, np.iinfo(int).max), np.where(asked, places, np.inf)
    *_, point = where = np.nonzero(asked)
    below[where] = strip.at(point).below(places[where])
    fewer = below < np.arange(1, len(low) + 1)[:, None]
    low = np.maximum(low, np.where(fewer, places, -np.inf).max(axis=0))
    return low, np.minimum(high, np.where(fewer, np.inf, places).min(axis=0))


def _closed_in(strip, point, wanted, low, high, scale):
    """The eigenvalue with the number `wanted` in each interval of x, by Newton's method kept in it."""
    live, open_ = np.arange(point.size), np.ones(point.size, bool)
    own, x, narrow = strip.at(point), 0.5 * (low + high), np.full(point.size, np.inf)
    for turn in range(MOST_STEPS):
        below, move, residual = own.step(x)
        way = own.to_held(x)
        # Newton's step once the pole at the nearest held mode is multiplied away.
        move = move * way / (move + way)
        missing = wanted[live] - below
        above = missing > 0
        a, b = np.where(above, x, low[live]), np.where(above, high[live], x)
        size, width = scale[live] + np.abs(x), b - a
        near = np.maximum(residual, np.abs(move)) <= SMALL * size
        near &= np.abs(move) <= SMALL_BESIDE * np.abs(way)
        # The next above or below is the one that is wanted; too near, the count itself would be rounding.
        met = near & (np.abs(move) > BLUR * size) & (missing == above) & ((move > 0) == above)
        # A closed interval stays as it is, however long its neighbours take.
        going = live[open_]
        low[going] = np.where(met, x + move, a)[open_]
        high[going] = np.where(met, x + move, b)[open_]
        # From the other side it is told whether this is the one, also where two nearly coincide.
        ahead = x + move + np.where(near, np.where(above, OVER, -OVER) * size, 0.0)
        inside = (ahead > low[live]) & (ahead < high[live])
        if turn % PATIENCE == 0:
            inside &= near | (width <= 0.5 * narrow[live])
            narrow[live] = width
        x = np.where(inside, ahead, 0.5 * (low[live] + high[live]))
        open_ &= high[live] - low[live] > CLOSED * size
        if not open_.any():
            break
        if open_.sum() < FEWER * open_.size:
            left = np.flatnonzero(open_)
            live, x, open_, own = live[left], x[left], open_[left], own.at(left)
    return 0.5 * (low + high)
