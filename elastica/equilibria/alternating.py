"""The one root of a word whose segments are all of kind S, and how it is reached where the strip is steep.

The length of such a state falls with κ, so there is one root at most. Near small deflections their closed
form is start enough. Steeper states are reached by moving the walls apart from there, or from the free shape
that just touches them, so that they lie on the same branch; without springs that is done once for strips
of every length and tabulated (`_Widening`).

Not here: every other root (`sweep`), names and admissibility.
"""

from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np

from elastica.equilibria.buckled import just_touching
from elastica.equilibria.line import line_roots
from elastica.equilibria.newton import ROUNDING, Roots, below_right_angles, newton, regular, total_length
from elastica.pendulum.line import rough_line_length
from elastica.scene import Scene

TINY_THRUST = 1e-6
"""Thrust below which starting values are taken at this thrust: they only have to be near."""
NARROW_GAP = 0.02
"""Half gap that is small for every strip: there the small-deflection start converges."""
NEARLY_STEEP = 0.55
"""√p times the rise of a quarter of a period at which small-deflection starts mostly still converge."""
LEAVING = 0.05
"""Surplus of the length at κ = 0 up to which a state is reached from the line state."""
WIDEST_GAP = 0.5
"""Half gap of which no strip can touch both walls."""
MOST_BRANCH_STEPS, BRANCH_NEWTON_STEPS = 150, 6
SMALLEST_BRANCH_STEP, LONGEST_BRANCH_STEP = 5e-4, 0.1
FAR, NEAR = 1 / 16, 1 / 2
"""First step as a share of the way, from narrow walls and from walls that are only a little nearer."""
TAUT = 5.0
"""Pull −λ in multiples of p with which a strip steeper than 90° is a taut string rather than a bent strip."""
STRIPS, GAPS, TABLE_STEPS = 64, 20, 60
"""Strips and gaps of a table of widening walls, and steps on its way: all but taut strings need fewer."""
LAST_SHARE = 0.97
"""Largest s of the tables: next to a fold states change without bound."""
WIDEST = 1.1
"""√p times the rise of a quarter of a period that no such state exceeds."""
JUMP = 0.1
"""Relative fall of the widest gap from one strip to the next that may be a jump, and how far it may pass
both values before."""
EDGE, BACK = 0.01, 0.9
"""Relative distance of a gap from the widest that the table knows within which it decides nothing, and the
share of what is certain from where the walls are moved there."""


def alternating(segments, table):
    """The root of alternating words: it exists where the segments are longer than the strip at κ = 0.

    Parameters
    ----------
    segments : Mapping of Segment to int
        Of kind S, without further periods.
    table : LengthTable
        Of n points.

    Returns
    -------
    Roots
        Below 90°, or steeper on the branch that grows from small deflections or from a free shape that
        touches the wall.
    """
    p, scene = table.p, table.scene
    roots = Roots.none(segments, p.size)
    slack, close, line = _slack(segments, p, scene)
    flattened = np.flatnonzero(np.abs(slack[close]) <= 4 * ROUNDING)
    roots.put(close[flattened], line.at(flattened))

    longer = np.flatnonzero((slack[close] > 4 * ROUNDING) & (slack[close] < LEAVING))
    at = close[longer]
    roots.put(at, _from_line(segments, p[at], scene.at(at), line.lam[:, longer]))
    gentle = NEARLY_STEEP / (_quarter(segments) * np.sqrt(np.maximum(p, TINY_THRUST)))
    sought = (slack > 4 * ROUNDING) & ~roots.found
    near = np.flatnonzero(sought & (scene.H <= gentle))
    roots.put(near, _from_small_deflections(segments, p[near], scene.at(near)))
    steep = np.flatnonzero(sought & ~roots.found)
    p, scene, gentle = p[steep], scene.at(steep), gentle[steep]
    if any(segment.kind.springs for segment in segments):
        narrow = scene._replace(H=np.minimum(scene.H, np.maximum(NARROW_GAP, gentle)))
        near = _from_small_deflections(segments, p, narrow)
        failed = np.flatnonzero(~near.found)
        narrow.H[failed] = np.minimum(scene.H[failed], NARROW_GAP)
        near.put(failed, _from_small_deflections(segments, p[failed], narrow.at(failed)))
        reached = _move_walls(segments, near, p, narrow, scene, FAR)
    else:
        reached = _widening(tuple(segments.items())).roots(segments, p, scene)
        if len(segments) == 1:
            left = np.flatnonzero(~reached.found)
            free, touching = just_touching(segments, p[left], scene.at(left))
            reached.put(left, _move_walls(segments, free, p[left], touching, scene.at(left), FAR))
    roots.put(steep, reached)
    return roots


def is_longer(segments, table):
    """Whether the segments are longer than the strip at κ = 0, and shorter as taut strings.

    Their length falls with κ, so somewhere in between there is a root.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    slack, _, _ = _slack(segments, table.p, table.scene)
    return (slack > 4 * ROUNDING) & (table.scene.reach(segments) < 1)


def _slack(segments, p, scene):
    """Length of the segments at κ = 0 less that of the strip, infinite beyond their fold.

    Also where that is close to zero and so not rough, and the line states there.
    """
    lengths = (
        count * rough_line_length(segment.kind, p, scene.rise(segment)) for segment, count in segments.items()
    )
    slack = sum(lengths) - 1
    close = np.flatnonzero(~(np.abs(slack) > LEAVING))
    line = line_roots(segments, p[close], scene.at(close))
    slack[close] = np.where(line.found, total_length(segments, p[close], line) - 1, np.inf)
    return slack, close, line


def _quarter(segments):
    """Greatest rise of a quarter of a period among segments, in multiples of H."""
    return max(segment.rise / (segment.kind.first + segment.kind.second) for segment in segments)


def _from_line(segments, p, scene, lam):
    """Newton from the line state that the points are about to leave: κ grows from 0 as they get longer."""
    roots = newton(segments, p, scene, np.zeros_like(p), lam)
    roots.found[:] &= regular(segments, p, roots, -1)
    return roots


def _from_small_deflections(segments, p, scene):
    """Newton from the small-deflection form; what is steeper than 90° may lie on any branch: not found."""
    roots = newton(segments, p, scene, *_small_deflection(segments, p, scene))
    roots.found[:] &= below_right_angles(segments, p, roots)
    return roots


def _small_deflection(segments, p, scene):
    """κ and λ of the linear strip θ'' + pθ = λ when all segments share one phase φ₀.

    With t = n_K π/2 + n_f φ₀ a segment has √p ℓ = t and p d = κ (n_f + t tan φ₀). A spring end is taken
    between the clamp and the pin, c : √p.
    """
    p = np.maximum(p, TINY_THRUST)
    root_p = np.sqrt(p)
    phases = []
    for kind, *_ in segments:
        firm = sum(c / (c + root_p) - 1 for c, _ in kind.springs)
        # A clamp adds K + f to a pin's.
        phases.append((kind.first + firm, kind.second + sum(s for _, s in kind.springs) + firm))
    counts = list(segments.values())
    first, second = (
        sum(count * phase[i] for count, phase in zip(counts, phases, strict=True)) for i in (0, 1)
    )
    phi = (root_p - first * np.pi / 2) / second
    phi = np.minimum(phi, np.pi / 2 - 1e-3)
    tan = np.tan(phi)
    kappas = [
        p * scene.rise(segment) / (second + (first * np.pi / 2 + second * phi) * tan)
        for segment, (first, second) in zip(segments, phases, strict=True)
    ]
    kappa = np.mean(kappas, axis=0)
    return kappa, np.tile(root_p * kappa * tan, (len(segments), 1))


def _move_walls(segments, roots, p, here, there, first_step):
    """Roots in the scene `there` on the branches of `roots`, which are `here`, where they get there."""
    *_, (roots, share) = _on_the_way(segments, roots, p, here, there, first_step)
    roots.found[:] &= share == 1
    return roots


def _on_the_way(segments, roots, p, begin, end, first_step):
    """Follow roots as the walls move from where they begin to their end, as long as the branch stays regular.

    Each point takes its own steps, halved where Newton fails or goes far, so that it does not jump over
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
    for _ in range(MOST_BRANCH_STEPS):
        if not live.size:
            break
        here = roots.at(live)
        stride = np.minimum(step[live], 1 - share[live])
        start = np.stack([here.kappa, *here.lam]) + slope[:, live] * stride
        scene = begin.at(live).towards(end.at(live), share[live] + stride)
        there = newton(segments, p[live], scene, start[0], start[1:], most_steps=BRANCH_NEWTON_STEPS)
        bent = there.lam.max(axis=0) > -TAUT * p[live]
        good = _next_to(segments, p[live], there, start[0])
        good &= bent | below_right_angles(segments, p[live], there)
        moved = live[good]
        change = np.stack([there.kappa - here.kappa, *(there.lam - here.lam)])
        slope[:, moved] = (change / stride)[:, good]
        roots.put(moved, there.at(good))
        share[moved] = np.where(stride[good] < step[moved], 1.0, share[moved] + stride[good])
        step[live] = np.minimum(step[live] * np.where(good, 1.2, 0.5), 2 * first_step)
        live = live[(share[live] < 1) & (step[live] > SMALLEST_BRANCH_STEP)]
        yield roots, share


def _next_to(segments, p, roots, kappa):
    """Whether Newton stayed on the branch that it started from at κ."""
    near = np.abs(roots.kappa - kappa) < LONGEST_BRANCH_STEP * kappa
    return roots.found & near & regular(segments, p, roots, -1)


class _Widening(NamedTuple):
    """States of strips of all lengths as the walls move apart, up to the fold or the widest gap.

    Without springs a state depends on √p and on H√p alone. Each strip has its own widest gap.

    Attributes
    ----------
    strip : ndarray, shape (strips,)
        √p, ascending.
    widest : ndarray, shape (strips,)
        H√p at which the branch ends.
    table : ndarray, shape (1 + distinct segments, gaps, strips)
        κ/(pH) and λ/(√p³H) at H√p = `widest` · s(2 − s), for equidistant s.
    """

    strip: np.ndarray
    widest: np.ndarray
    table: np.ndarray

    def roots(self, segments, p, scene):
        """The states of n points, as far as there are any on these branches."""
        found = Roots.none(segments, p.size)
        cell = np.clip(np.searchsorted(self.strip, np.sqrt(p)) - 1, 0, self.strip.size - 2)
        weight = (np.sqrt(p) - self.strip[cell]) / (self.strip[cell + 1] - self.strip[cell])
        left, right = self.widest[cell], self.widest[cell + 1]
        between = left + weight * (right - left)
        falls, jumps = right < left, right < (1 - JUMP) * left
        certain = (1 - EDGE) * np.where(falls, right, between) / np.sqrt(p)
        beyond = (1 + np.where(jumps, JUMP, EDGE)) * np.where(falls, left, between) / np.sqrt(p)
        live = np.flatnonzero((weight >= 0) & (weight <= 1) & (scene.H <= beyond))
        p, scene, certain = p[live], scene.at(live), certain[live]
        place = cell[live], weight[live], between[live] / np.sqrt(p)
        near = scene._replace(H=np.minimum(scene.H, certain))
        there = self._near(segments, p, near, *place)
        there.found[near.H < scene.H] = False
        left = np.flatnonzero(~there.found)
        p, scene, certain = p[left], scene.at(left), certain[left]
        near = scene._replace(H=np.minimum(scene.H, BACK * certain))
        start = self._near(segments, p, near, *(values[left] for values in place))
        there.put(left, _move_walls(segments, start, p, near, scene, NEAR))
        found.put(live, there)
        return found

    def _near(self, segments, p, scene, cell, weight, widest):
        """Newton from the table."""
        H = scene.H
        place = (1 - np.sqrt(1 - np.minimum(H / widest, 1))) * (GAPS - 1) / LAST_SHARE
        row = np.clip(place.astype(int), 0, GAPS - 2)
        start = 0.0
        for across, w in ((0, 1 - weight), (1, weight)):
            for down, v in ((0, 1 - (place - row)), (1, place - row)):
                start = start + v * w * self.table[:, row + down, cell + across]
        kappa = start[0] * p * H
        there = newton(segments, p, scene, kappa, start[1:] * p**1.5 * H, most_steps=8)
        there.found[:] = _next_to(segments, p, there, kappa)
        return there


@cache
def _widening(items):
    """Tabulate the states of alternating `items` (pairs of segment and count) without springs."""
    segments = dict(items)
    first, second = (
        sum(count * getattr(segment.kind, name) for segment, count in items) for name in ("first", "second")
    )
    # Between the free buckling of a strip and its line states, at small deflections.
    angle = np.pi * (np.arange(STRIPS) + 0.5) / STRIPS
    strip = (first - second * np.cos(angle)) * np.pi / 2
    p = strip * strip
    quarter = _quarter(segments)
    narrow = Scene(None, 0.1 * NEARLY_STEEP / (quarter * strip))
    near = _from_small_deflections(segments, p, narrow)
    known = np.flatnonzero(near.found)
    p, strip, narrow, near = p[known], strip[known], narrow.at(known), near.at(known)
    wide = Scene(None, np.minimum(WIDEST_GAP, WIDEST / (quarter * strip)))
    trail = []
    way = _on_the_way(segments, near, p, narrow, wide, first_step=0.5 / GAPS)
    for roots, share in islice(way, TABLE_STEPS):
        H = narrow.towards(wide, share).H
        trail.append((H, roots.kappa / (p * H), *(roots.lam / (p**1.5 * H))))
    widest = H * strip
    s = np.linspace(0, LAST_SHARE, GAPS)
    table = np.empty((1 + len(segments), GAPS, p.size))
    for i, (gaps, *values) in enumerate(np.array(trail).transpose(2, 1, 0)):
        for j, value in enumerate(values):
            table[j, :, i] = np.interp(s * (2 - s) * gaps[-1], gaps, value)
    return _Widening(strip, widest, table)
