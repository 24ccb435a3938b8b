"""The one root of a word whose segments are all of kind S, without extra periods.

The length of such a state falls with κ, so there is one root at most: where the segments are longer than the
strip at κ = 0. Each point is reached from the nearest state with a closed form: from the line state that it
is about to leave, from small deflections, or where the strip is steep from one of these, or from the free
shape that just touches the walls, by moving the walls apart.

Not here: every other root (`sweep`), names and admissibility.
"""

import numpy as np

from elastica.equilibria.buckled import just_touching
from elastica.equilibria.line import line_roots
from elastica.equilibria.newton import (
    ROUNDING,
    Roots,
    below_right_angles,
    newton,
    regular,
    total_length,
)
from elastica.equilibria.small_deflections import (
    from_small_deflections,
    gentle_gap,
    small_deflection,
)
from elastica.equilibria.widening import move_walls, widening
from elastica.pendulum.line import rough_line_length

LONGER = 4 * ROUNDING
"""Surplus of the length at κ = 0 from which on a strip is longer, and not just the line state."""
LEAVING = 0.05
"""Surplus up to which a state is reached from the line state."""
NARROW_GAP = 0.02
"""Half gap that is small for every strip."""
FIRST_STEP = 1 / 16
"""Of walls that are moved all the way, as a share of it."""


def has_single_root(segments):
    """Whether segments have one root at most: all are of kind S, of which the length falls with κ."""
    return all(segment.kind.turning_points == 1 for segment in segments)


def alternating(segments, table):
    """The root of alternating words: it exists where the segments are longer than the strip at κ = 0.

    Parameters
    ----------
    segments : Mapping of Segment to int
        Of kind S, without extra periods.
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

    flattened = np.flatnonzero(np.abs(slack[close]) <= LONGER)
    roots.put(close[flattened], line.at(flattened))

    leaving = np.flatnonzero((slack[close] > LONGER) & (slack[close] < LEAVING))
    sought = slack > LONGER
    gentle = sought & (scene.H <= gentle_gap(segments, p))
    from_line = close[leaving]
    others = gentle.copy()
    others[from_line] = False
    others = np.flatnonzero(others)
    near = _from_nearest(segments, p, scene, from_line, line.lam[:, leaving], others)
    roots.put(np.concatenate([from_line, others]), near)

    # Newton from the line misses some that small deflections reach.
    again = from_line[gentle[from_line] & ~roots.found[from_line]]
    roots.put(again, from_small_deflections(segments, p[again], scene.at(again)))

    steep = np.flatnonzero(sought & ~roots.found)
    if steep.size:
        roots.put(steep, _by_moving_walls(segments, p[steep], scene.at(steep)))
    return roots


def is_longer(segments, table):
    """Whether the segments are longer than the strip at κ = 0, and shorter as taut strings.

    Their length falls with κ, so somewhere in between there is a root.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    slack, _, _ = _slack(segments, table.p, table.scene)
    return (slack > LONGER) & (table.scene.reach(segments) < 1)


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


def _from_nearest(segments, p, scene, from_line, lam, others):
    """Newton from the line state that points are about to leave, others from small deflections.

    Parameters
    ----------
    segments : Mapping of Segment to int
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.
    from_line, others : ndarray of int
        Positions of the points.
    lam : ndarray, shape (distinct segments, m)
        Of the line states; from there κ grows from 0 as the segments get longer.

    Returns
    -------
    Roots
        Of the points `from_line`, then of the others.
    """
    kappa, force = small_deflection(segments, p[others], scene.at(others))
    kappa = np.concatenate([np.zeros(from_line.size), kappa])
    at = np.concatenate([from_line, others])
    roots = newton(segments, p[at], scene.at(at), kappa, np.concatenate([lam, force], axis=1))
    first, rest = slice(from_line.size), slice(from_line.size, None)
    roots.found[first] &= regular(segments, p[from_line], roots.at(first), -1)
    roots.found[rest] &= below_right_angles(segments, p[others], roots.at(rest))
    return roots


def _by_moving_walls(segments, p, scene):
    """Roots reached from narrower walls; where it tells, without springs, from the table of such ways."""
    if any(segment.kind.springs for segment in segments):
        return _from_narrow_walls(segments, p, scene)
    roots = widening(tuple(segments.items())).roots(segments, p, scene)
    if len(segments) == 1:
        left = np.flatnonzero(~roots.found)
        free, touching = just_touching(segments, p[left], scene.at(left))
        roots.put(left, move_walls(segments, free, p[left], touching, scene.at(left), FIRST_STEP))
    return roots


def _from_narrow_walls(segments, p, scene):
    """Roots reached from walls that are as far apart as small deflections allow."""
    gaps = np.maximum(NARROW_GAP, gentle_gap(segments, p))
    narrow = scene._replace(H=np.minimum(scene.H, gaps))
    start = from_small_deflections(segments, p, narrow)
    failed = np.flatnonzero(~start.found)
    narrow.H[failed] = np.minimum(scene.H[failed], NARROW_GAP)
    start.put(failed, from_small_deflections(segments, p[failed], narrow.at(failed)))
    return move_walls(segments, start, p, narrow, scene, FIRST_STEP)
