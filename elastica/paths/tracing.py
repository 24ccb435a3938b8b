"""All curves of a state at the gaps of a scene, with their ends.

Not here: what happens on them (`curve`); the branches of the point regime (`equilibria.tracing`).
"""

import numpy as np

from elastica.codes import Event
from elastica.equilibria.branch import Points, steepest_angle
from elastica.equilibria.buckled import free_branch, periodic
from elastica.equilibria.euler import euler_root
from elastica.equilibria.periods import groups, most_periods
from elastica.equilibria.shortening_control import MOST_PERIODS
from elastica.equilibria.tracing import Loads
from elastica.paths.curve import Curve, FreeCurve, LineCurve, LoopCurve
from elastica.scales import FOUR_PI_SQUARED

NEAR_FOLD = 8
"""Further points of line states between the last load looked at and their fold."""
AT_RIGHT_ANGLE, AT_FOLD = 1e-3, 1e-6
"""How near to 90°, and to dP/dk = 0, a branch is cut that ends there."""
JUST_BUCKLED = 1e-5
"""Gap from which on shapes with λ are known at the wall: before, their load is that of Euler to rounding."""
LOOP = 4.0
"""−ln(1 − m) of a free shape just beyond κ/√p = 1.98."""


def curves(state, scene, control, P_max):
    """The curves of a state, for each pattern of extra periods.

    Parameters
    ----------
    state : State
        Not the straight strip; the number of its root is not looked at.
    scene : Scene
        Each gap once.
    control : Control
    P_max : float
        Load up to which they are looked for.

    Yields
    ------
    Curve
        With two known points at least, in order of gap, then of t.
    """
    if state.mode:
        yield _free(state, scene, control, P_max)
        return
    loads = Loads(scene, np.sqrt(FOUR_PI_SQUARED * P_max))
    for periods in range(min(MOST_PERIODS, most_periods(state, scene.ends, loads.table.p)) + 1):
        for group in groups(state, scene.ends, periods):
            known = (_line_points if state.line else _branch_points)(loads, group.segments)
            if known[0].size < 2:
                continue
            make = LineCurve if state.line else Curve
            for pattern in group.patterns:
                yield make(state, scene, control, group._replace(patterns=(pattern,)), *known)


def _branch_points(loads, segments):
    """Known points of the point regime, up to the ends of the branches.

    Returns
    -------
    gap, t, points, ends_at
        As `Curve` has them.
    """
    branch = loads.trace(segments)
    points = Points(np.ones(branch.k.size, bool), branch.k, branch.p, branch.lam)
    first = np.flatnonzero(np.diff(branch.gap, prepend=-1))
    last = np.flatnonzero(np.diff(branch.gap, append=-1))
    edges = np.concatenate([first, last])
    # A branch that is steep to its end was followed to the fold, or was left as a taut string.
    steep = np.abs(steepest_angle(segments, points.at(edges)) - np.pi / 2) < AT_RIGHT_ANGLE
    reasons = np.select(
        [branch.k[edges] == 0, steep, np.abs(branch.load_k[edges]) < AT_FOLD],
        [Event.POINT_TO_LINE, Event.RIGHT_ANGLE, Event.FOLD],
        -1,
    )
    ends_at = {int(i): Event(e) for i, e in zip(edges, reasons, strict=True) if e >= 0}
    return branch.gap, branch.k, points, ends_at


def _line_points(loads, segments):
    """Known points of the line regime, as `_branch_points` gives them: where all segments exist.

    Next to the fold everything changes with the root of the distance from it.
    """
    _, last, folds = loads.line_range(segments)
    gap, p = loads.gap, loads.table.p
    below = np.flatnonzero(p < last[gap])
    gap, p = gap[below], p[below]
    nearest = np.full(last.size, loads.first)
    np.maximum.at(nearest, gap, p)
    toward = nearest + (last - nearest) * (1 - (1 - np.linspace(0, 1, NEAR_FOLD + 1)[1:, None]) ** 2)
    toward[-1] = last
    gap = np.concatenate([gap, *[np.arange(last.size)] * NEAR_FOLD])
    p = np.concatenate([p, toward.ravel()])
    order = np.lexsort((p, gap))
    gap, p = gap[order], p[order]
    ends = np.flatnonzero(np.diff(gap, append=-1))
    return gap, p, None, {int(i): Event.FOLD for i in ends[folds[gap[ends]]]}


def _free(state, scene, control, P_max):
    """The curve of a free shape, which the walls do not bend."""
    (group,) = groups(state, scene.ends, 0)
    (kind,) = (segment.kind for segment in group.segments)
    branch = free_branch(kind, float(euler_root(state.mode, scene.ends)))
    k, H = branch.k, scene.H
    # A strip with κ/√p < H touches no wall.
    nodes = np.broadcast_to(k, (H.size, k.size)).copy()
    nodes[:, 0] = np.minimum(np.maximum(H, 0 if periodic(kind) else JUST_BUCKLED), k[1]) / 2
    if periodic(kind):
        longest = max(2 * np.sqrt(FOUR_PI_SQUARED * P_max) / kind.first, LOOP)
        loops = np.broadcast_to(np.arange(LOOP, longest + 1), (H.size, int(longest + 1 - LOOP) + 1))
        nodes = np.concatenate([-np.log1p(-(nodes**2) / 4), loops], axis=1)
    gap, node = (grid.ravel() for grid in np.indices(nodes.shape))
    known = state, scene, control, group, gap, nodes.ravel()
    if periodic(kind):
        return LoopCurve(*known, None, {})
    node = np.maximum(node, 1)
    k, p, ratio = (values[node] for values in (branch.k, branch.p, branch.ratio))
    return FreeCurve(*known, Points(np.ones(node.size, bool), k, p, (ratio * k * p)[None]), {}, ratio)
