"""Steep roots of words whose segments are all of kind S: the walls are moved apart, and a root with them.

So the root lies on the branch on which the strip was before. Without springs that is done once for strips of
every length and tabulated; then only what is next to the end of its branch is moved by itself.

Not here: from where to move (`alternating`).
"""

from functools import cache
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from elastica.equilibria.newton import Roots, below_right_angles, newton, regular
from elastica.equilibria.small_deflections import NEARLY_STEEP, from_small_deflections, quarter
from elastica.scene import Scene

# Safety: what is found lies on the branch.
SAME_BRANCH = 0.1
"""Relative change of κ within which Newton stays on the branch that it started from."""
TAUT = 5.0
"""Pull −λ in multiples of p with which a strip steeper than 90° is a taut string rather than a bent strip."""
EDGE, JUMP = 0.01, 0.1
"""Relative distance from the widest gap within which the table decides nothing, and from a fall of the widest
gap by as much from one strip to the next, which may be a jump."""

# Speed: how the walls are moved, and from where.
MOST_STEPS, SMALLEST_STEP = 150, 5e-4
LONGER, SHORTER = 1.2, 0.5
"""Factors of the step after one that succeeded, and after one that failed."""
NEWTON_STEPS, NEWTON_STEPS_FROM_TABLE = 6, 8
BACK, STEP_FROM_BACK = 0.9, 1 / 2
"""Share of what is certain from where the walls are moved, and the first step as a share of the way."""

# The table: what it covers, and how finely.
WIDEST_GAP = 0.5
"""Half gap of which no strip can touch both walls."""
STEEPEST = 1.1
"""√p times the rise of a quarter of a period that no such state exceeds."""
STRIPS, GAPS = 64, 20
TABLE_STEPS = 60
"""Steps of the walls for the table: all but taut strings need fewer."""
LAST_SHARE = 0.97
"""Largest s of the table: next to a fold states change without bound."""


def move_walls(segments, roots, p, begin, end, first_step):
    """Roots at the end of the way of the walls on the branches of those at its beginning, if they get there.

    Parameters
    ----------
    segments : Mapping of Segment to int
    roots : Roots
        Of n points, where the walls begin.
    p : ndarray, shape (n,)
    begin, end : Scene
    first_step : float
        As a share of the way.

    Returns
    -------
    Roots
    """
    *_, (roots, share) = _on_the_way(segments, roots, p, begin, end, first_step)
    roots.found[:] &= share == 1
    return roots


def _on_the_way(segments, roots, p, begin, end, first_step):
    """Follow roots as the walls move from where they begin to their end, as long as the branch stays regular.

    Each point takes its own steps, shortened where Newton fails or goes far, so that it does not jump over
    a fold to another branch, and lengthened where it does not, up to twice the first. Beyond 90° a strip
    that pulls hard on the walls is left: such branches tend to a taut string without end.

    Yields
    ------
    roots : Roots
        The same object after each step, changed.
    share : ndarray, shape (n,)
        Of the way that each point has gone.
    """
    roots = Roots(roots.found.copy(), roots.kappa.copy(), roots.lam.copy())
    share, step = np.zeros(p.size), np.full(p.size, first_step)
    # At small deflections a state grows in proportion to the gap.
    slope = np.stack([roots.kappa, *roots.lam]) * ((end.H - begin.H) / begin.H)
    live = np.flatnonzero(roots.found)
    yield roots, share
    for _ in range(MOST_STEPS):
        if not live.size:
            break
        here = roots.at(live)
        stride = np.minimum(step[live], 1 - share[live])
        start = np.stack([here.kappa, *here.lam]) + slope[:, live] * stride
        scene = begin.at(live).towards(end.at(live), share[live] + stride)
        there = newton(segments, p[live], scene, start[0], start[1:], most_steps=NEWTON_STEPS)
        bent = there.lam.max(axis=0) > -TAUT * p[live]
        good = _same_branch(segments, p[live], there, start[0])
        good &= bent | below_right_angles(segments, p[live], there)
        moved = live[good]
        change = np.stack([there.kappa - here.kappa, *(there.lam - here.lam)])
        slope[:, moved] = (change / stride)[:, good]
        roots.put(moved, there.at(good))
        share[moved] = np.where(stride[good] < step[moved], 1.0, share[moved] + stride[good])
        step[live] = np.minimum(step[live] * np.where(good, LONGER, SHORTER), 2 * first_step)
        live = live[(share[live] < 1) & (step[live] > SMALLEST_STEP)]
        yield roots, share


def _same_branch(segments, p, roots, kappa):
    """Whether Newton stayed on the branch that it started from at κ."""
    near = np.abs(roots.kappa - kappa) < SAME_BRANCH * kappa
    return roots.found & near & regular(segments, p, roots, -1)


class Widening(NamedTuple):
    """States of strips of all lengths as the walls move apart, up to the fold or the widest gap.

    Without springs a state depends on √p and on H√p alone. Each strip has its own widest gap.

    Attributes
    ----------
    strip : ndarray, shape (strips,)
        √p, ascending.
    widest : ndarray, shape (strips,)
        H√p at which the branch ends.
    states : ndarray, shape (1 + distinct segments, gaps, strips)
        κ/(pH) and λ/(√p³H) at H√p = `widest` · s(2 − s), for equidistant s.
    """

    strip: np.ndarray
    widest: np.ndarray
    states: np.ndarray

    def roots(self, segments, p, scene):
        """The states of n points, as far as there are any on these branches."""
        found = Roots.none(segments, p.size)
        limits = self._limits(p)
        possible = np.flatnonzero(scene.H <= limits.beyond)
        p, scene, limits = p[possible], scene.at(possible), limits.at(possible)

        there = Roots.none(segments, p.size)
        certain = np.flatnonzero(scene.H <= limits.certain)
        there.put(certain, self._near(segments, p[certain], scene.at(certain), limits.at(certain)))

        left = np.flatnonzero(~there.found)
        p, scene, limits = p[left], scene.at(left), limits.at(left)
        back = scene._replace(H=np.minimum(scene.H, BACK * limits.certain))
        start = self._near(segments, p, back, limits)
        there.put(left, move_walls(segments, start, p, back, scene, STEP_FROM_BACK))
        found.put(possible, there)
        return found

    def _limits(self, p):
        """How far walls may be apart: as far as for both of the strips between which a point lies."""
        root_p = np.sqrt(p)
        left = np.clip(np.searchsorted(self.strip, root_p) - 1, 0, self.strip.size - 2)
        weight = (root_p - self.strip[left]) / (self.strip[left + 1] - self.strip[left])
        before, after = self.widest[left], self.widest[left + 1]
        between = before + weight * (after - before)
        falls, jumps = after < before, after < (1 - JUMP) * before
        certain = (1 - EDGE) * np.where(falls, after, between) / root_p
        beyond = (1 + np.where(jumps, JUMP, EDGE)) * np.where(falls, before, between) / root_p
        beyond[~((weight >= 0) & (weight <= 1))] = np.nan
        return _Limits(left, weight, between / root_p, certain, beyond)

    def _near(self, segments, p, scene, limits):
        """Newton from the table, linear between four of its states."""
        H = scene.H
        place = (1 - np.sqrt(1 - np.minimum(H / limits.widest, 1))) * (GAPS - 1) / LAST_SHARE
        row = np.clip(place.astype(int), 0, GAPS - 2)
        start: Any = 0.0
        for across, w in ((0, 1 - limits.weight), (1, limits.weight)):
            for down, v in ((0, 1 - (place - row)), (1, place - row)):
                start = start + v * w * self.states[:, row + down, limits.left + across]
        kappa, lam = start[0] * p * H, start[1:] * p**1.5 * H
        there = newton(segments, p, scene, kappa, lam, most_steps=NEWTON_STEPS_FROM_TABLE)
        there.found[:] = _same_branch(segments, p, there, kappa)
        return there


class _Limits(NamedTuple):
    """Where n points lie among the strips of a table, and how far their walls may be apart.

    Attributes
    ----------
    left, weight : ndarray, shape (n,)
        The shorter one of the two strips beside, and the share of the longer one.
    widest, certain, beyond : ndarray, shape (n,)
        Half gaps: at which the branch ends, roughly; up to which its state is there; from which on it is not,
        NaN outside the table.
    """

    left: np.ndarray
    weight: np.ndarray
    widest: np.ndarray
    certain: np.ndarray
    beyond: np.ndarray

    def at(self, where):
        """The limits of some of the points."""
        return _Limits(*(field[where] for field in self))


@cache
def widening(items):
    """Tabulate the states of `items` (pairs of segment and count) without springs.

    Returns
    -------
    Widening
    """
    segments = dict(items)
    first, second = (
        sum(count * getattr(segment.kind, name) for segment, count in items) for name in ("first", "second")
    )
    # Between the free buckling of a strip and its line states, at small deflections.
    angle = np.pi * (np.arange(STRIPS) + 0.5) / STRIPS
    strip = (first - second * np.cos(angle)) * np.pi / 2
    p = strip * strip
    each = quarter(segments) * strip
    narrow, wide = (
        Scene(None, H) for H in (0.1 * NEARLY_STEEP / each, np.minimum(WIDEST_GAP, STEEPEST / each))
    )
    near = from_small_deflections(segments, p, narrow)
    known = np.flatnonzero(near.found)
    p, strip, narrow, wide, near = (
        p[known],
        strip[known],
        narrow.at(known),
        wide.at(known),
        near.at(known),
    )
    trail = []
    way = _on_the_way(segments, near, p, narrow, wide, first_step=0.5 / GAPS)
    for roots, share in islice(way, TABLE_STEPS):
        H = narrow.towards(wide, share).H
        trail.append((H, roots.kappa / (p * H), *(roots.lam / (p**1.5 * H))))
    return Widening(strip, H * strip, _at_even_steps(np.array(trail)))


def _at_even_steps(trail):
    """Values on a way of the walls at H = s(2 − s) of their last gap.

    Parameters
    ----------
    trail : ndarray, shape (steps, 1 + values, strips)
        The gap first.

    Returns
    -------
    ndarray, shape (values, GAPS, strips)
    """
    s = np.linspace(0, LAST_SHARE, GAPS)
    _, values, strips = trail.shape
    states = np.empty((values - 1, GAPS, strips))
    for i, (gaps, *own) in enumerate(trail.transpose(2, 1, 0)):
        for j, value in enumerate(own):
            states[j, :, i] = np.interp(s * (2 - s) * gaps[-1], gaps, value)
    return states
