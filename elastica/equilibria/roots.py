"""Which equilibria a state has, and how its roots are numbered.

Words that alternate have one root without extra periods (`alternating`); a sweep in κ finds every other
root of a word (`sweep`). In the line regime each segment has one shape (`line`); free buckling is apart
(`buckled`).

Not here: names (`state`), admissibility, stability.
"""

from typing import NamedTuple

import numpy as np

from elastica.equilibria.admissibility import clearance
from elastica.equilibria.alternating import alternating, has_single_root, is_longer
from elastica.equilibria.buckled import buckled_at_load, periodic
from elastica.equilibria.lengths import LengthTable
from elastica.equilibria.newton import rows_at, total_length
from elastica.equilibria.periods import groups, most_periods, room, unsearched
from elastica.equilibria.sweep import every_root
from elastica.pendulum.elliptic import complementary_parameter
from elastica.pendulum.segments import arc, pendulum

CHUNK = 5000
"""Points of one table, so that it stays small."""


class Equilibria(NamedTuple):
    """Equilibria of one word at many points, one column each.

    Attributes
    ----------
    point : ndarray of int, shape (m,)
        Position in the arrays of p and H, ascending.
    number : ndarray of int, shape (m,)
        1 for the first root at that point, then 2 and so on.
    kappa : ndarray, shape (m,)
    lam : ndarray, shape (segments, m)
        From end A to end B.
    periods : ndarray of int, shape (segments, m)
        Extra full periods of each segment.
    p : ndarray, shape (m,)
        Thrust.
    """

    point: np.ndarray
    number: np.ndarray
    kappa: np.ndarray
    lam: np.ndarray
    periods: np.ndarray
    p: np.ndarray

    def at(self, where):
        """Some of the equilibria."""
        return Equilibria(*(f[where] if f.ndim == 1 else rows_at(f, where) for f in self))


def find(state, p, scene):
    """One root of a state at n points.

    Parameters
    ----------
    state : State
        Not the straight strip.
    p : ndarray, shape (n,)
        Thrust p = 4π²P ≥ 0; finite.
    scene : Scene
        Of the n points.

    Returns
    -------
    found : Equilibria
        With at most one column a point: none where the state has no equilibrium with |θ| < 90°, nor a
        steeper one on the branch that grows from small deflections or from a free shape that touches
        the wall.
    unfollowed : ndarray of bool, shape (n,)
        Where it was not found, but may lie beyond the end of the search (see `every`).
    """
    unfollowed = np.zeros(p.size, bool)
    if state.mode or (state.root == 1 and not state.line and has_single_root(state.segments(scene.ends))):
        plain = first(state, LengthTable(p, scene))
        there = np.full(p.size, bool(state.mode))
        there[plain.point] = True
        if there.all():
            return plain, unfollowed
        missing = np.flatnonzero(~there)
        p, scene = p[missing], scene.at(missing)
        others, beyond = _others(state, p, scene)
        beyond |= _taut(state, LengthTable(p, scene))
        others, unfollowed[missing] = of_root(state, numbered([others]), beyond)
        return _sorted([plain, others._replace(point=missing[others.point])]), unfollowed
    return of_root(state, *every(state, p, scene))


def of_root(state, found, beyond):
    """The root that a state's name has of all that were found, and where it may lie beyond the search.

    Parameters
    ----------
    state : State
    found : Equilibria
    beyond : ndarray of bool, shape (n,)
        As `every` gives it.

    Returns
    -------
    found : Equilibria
    unfollowed : ndarray of bool, shape (n,)
    """
    there = np.bincount(found.point, minlength=beyond.size)
    return found.at(found.number == state.root), (there < state.root) & beyond


def every(state, p, scene, table=None):
    """Every root of a word below 90°, by increasing κ; the first of an alternating word even if steeper.

    Of patterns of extra periods with the same κ, and in the line regime, those with fewer periods
    come first, then those that have them nearer to end A.

    Parameters
    ----------
    state : State
        A contact word; its own root number is not looked at.
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.
    table : LengthTable, optional
        Of the same points, shared between words.

    Returns
    -------
    found : Equilibria
    beyond : ndarray of bool, shape (n,)
        Where there may be more beyond the end of the search: at 90°, at a taut string or at the most extra
        periods. What would have to pull or to pass a wall there does not count.
    """
    points = table or LengthTable(p, scene)
    if state.line:
        return _lines(state, points), unsearched(state, p, scene)
    others, beyond = _others(state, p, scene, table)
    if not has_single_root(state.segments(scene.ends)):
        return numbered([others]), beyond
    plain = first(state, points)
    lost = np.setdiff1d(np.arange(p.size), plain.point, assume_unique=True)
    beyond[lost] |= _taut(state, LengthTable(p[lost], scene.at(lost)))
    return numbered([plain, others]), beyond


def first(state, table):
    """The root of a state that has one at most, without extra periods.

    Parameters
    ----------
    state : State
        A free shape, or a contact word whose segments have a single root (`has_single_root`).
    table : LengthTable
        Of the points.

    Returns
    -------
    Equilibria
    """
    ends = table.scene.ends
    plain = state.segments(ends)
    (group,) = groups(state, ends, 0)
    roots = buckled_at_load(state, table.p, table.scene) if state.mode else alternating(group.segments, table)
    found = np.flatnonzero(roots.found)
    return spread(plain, group, found, roots.at(found), table.p[found], number=1)


def _taut(state, table):
    """Whether a word with a single root has it all the same where it was not found: as a taut string."""
    (group,) = groups(state, table.scene.ends, 0)
    return is_longer(group.segments, table)


def _others(state, p, scene, table=None):
    """Roots that a sweep finds: those with extra periods, and of words that do not alternate all.

    Also where there may be more beyond, as `every` tells.
    """
    ends = scene.ends
    found, beyond = [], unsearched(state, p, scene)
    least = int(has_single_root(state.segments(ends)))
    pressed = np.flatnonzero(p > 0)
    if table is None:
        # By load: those that have room for more periods come last.
        pressed = pressed[np.argsort(p[pressed], kind="stable")]
    for points in np.split(pressed, range(CHUNK, pressed.size, CHUNK)):
        shared = table or LengthTable(p[points], scene.at(points))
        for periods in range(least, most_periods(state, ends, p[points]) + 1):
            begin = 0 if table else np.searchsorted(room(p[points]), periods)
            for group in groups(state, ends, periods):
                sweep = every_root(group.segments, shared, begin)
                if sweep.points.size:
                    place = points[sweep.points]
                    found.append(spread(state.segments(ends), group, place, sweep.roots, p[place]))
                if sweep.cut_points.size:
                    place = points[sweep.cut_points]
                    beyond[place[_possible(state, group, sweep.cut, p[place], scene.at(place))]] = True
    return _sorted(found) if found else no_equilibria(len(state.word) + 1), beyond


def _possible(state, group, cut, p, scene):
    """Indices of those ends of a sweep at which, in some pattern, all contacts push.

    What pulls or passes a wall there does so beyond, and no strip is longer than itself.
    """
    some = np.flatnonzero((scene.reach(group.segments) < 1) & ~(cut.lam.max(axis=0) < 0))
    patterns = spread(state.segments(scene.ends), group, some, cut.at(some), p[some])
    some = np.unique(patterns.point[~(patterns.lam[:-1] + patterns.lam[1:] < 0).any(axis=0)])
    q = [pendulum(p[some], cut.kappa[some], lam) for lam in cut.lam[:, some]]
    arcs = [arc(segment.kind, own) for segment, own in zip(group.segments, q, strict=True)]
    return some[~(clearance(arcs, group.segments, scene.at(some)) < 0)]


def _lines(state, table):
    """Line regime: every segment has its rise at κ = 0; with extra periods only where they fit."""
    found = []
    p, ends = table.p, table.scene.ends
    for periods in range(most_periods(state, ends, p) + 1):
        for group in groups(state, ends, periods):
            roots = table.line_roots(group.segments)
            if periods:
                roots.found[:] &= total_length(group.segments, p, roots) <= 1
            there = np.flatnonzero(roots.found)
            found.append(spread(state.segments(ends), group, there, roots.at(there), p[there]))
    return numbered(found)


def spread(plain, group, points, roots, p, number=2):
    """Roots of a group as equilibria of each of its patterns, with λ from end A to end B."""
    distinct = list(group.segments)
    columns = []
    for pattern in group.patterns:
        order = [
            distinct.index(segment._replace(kind=segment.kind.extended(extra)))
            for segment, extra in zip(plain, pattern, strict=True)
        ]
        periods = np.repeat(np.array(pattern)[:, None], points.size, axis=1)
        columns.append(
            Equilibria(points, np.full_like(points, number), roots.kappa, roots.lam[order], periods, p)
        )
    return joined_columns(columns)


def joined_columns(parts):
    """Columns of several equilibria side by side."""
    if len(parts) == 1:
        return parts[0]
    return Equilibria(*(np.concatenate(fields, axis=-1) for fields in zip(*parts, strict=True)))


def _sorted(parts):
    """Equilibria in order of their points, otherwise as they come."""
    joined = joined_columns(parts)
    return joined.at(np.argsort(joined.point, kind="stable"))


def numbered(parts):
    """Equilibria numbered at each point by increasing κ, after those that have the number 1 already."""
    joined = joined_columns(parts)
    few = joined.periods.sum(axis=0)
    joined = joined.at(np.lexsort((*-joined.periods[::-1], few, joined.kappa, joined.number, joined.point)))
    begins = np.searchsorted(joined.point, joined.point, side="left")
    return joined._replace(number=np.arange(joined.point.size) - begins + 1)


def no_equilibria(segments):
    """No columns, of a word with this many segments."""
    nothing = np.zeros(0, int)
    empty = np.zeros((segments, 0))
    return Equilibria(nothing, nothing, np.zeros(0), empty, empty.astype(int), np.zeros(0))


def pendulums_of(segments, p, kappa, lam):
    """The pendulums of a state's segments.

    Parameters
    ----------
    segments : sequence of Segment
    p, kappa : ndarray, shape (n,)
    lam : sequence of ndarray, shape (n,)

    Returns
    -------
    list of Pendulum
        Of free shapes with λ = 0, whose K(m) is known, with all digits of 1 − m.
    """
    m1 = None
    free = len(segments) == 1 and segments[0].start == segments[0].end == 0
    if free and periodic(segments[0].kind):
        m1 = complementary_parameter(np.maximum(np.sqrt(p) / segments[0].kind.first, np.pi / 2))
    return [pendulum(p, kappa, values, m1) for values in lam]
