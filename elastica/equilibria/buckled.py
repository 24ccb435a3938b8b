"""Free buckling: shapes of the strip that touch no wall, of mode n from its Euler load on.

Modes whose two ends carry the same reaction have λ = 0 and exist at every higher load, with K(m) = √p/n_K.
All others lie on a branch of their own that is interpolated and refined, up to the loop where κ/√p = 1.98.
Neither depends on the gap.

Not here: the Euler loads (`euler`), whether the strip has room (`admissibility`).
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from elastica.equilibria.branch import bordered, settle, settle_at_shortening
from elastica.equilibria.euler import euler_root
from elastica.equilibria.newton import Bracket, Roots, newton
from elastica.pendulum.elliptic import complementary_parameter, integrals, parameter_of_shortening
from elastica.scene import Scene
from elastica.state import Segment

LARGEST_K = 350.0
"""K(m) at which 1 − m leaves the range of numbers."""
ENDS_MEET_K = 2.3210497325
"""K(m) where K = 2E: the ends of the free shape meet."""
NODES = (0.02, 0.1, *np.arange(0.2, 1.9, 0.1), *np.arange(1.84, 1.985, 0.02))
"""κ/√p of the nodes of a branch."""
PHASES = 4001
"""Values of φ₀ among which the infinitesimal mode is looked for."""


def periodic(kind):
    """Whether a free shape of this kind has λ = 0: it exists above its Euler load, K(m) ∝ √p."""
    return not kind.second and not kind.springs


def buckled_at_load(state, p, scene):
    """The free shape of a mode at given thrust, up to the fold of its branch if there is one.

    Parameters
    ----------
    state : State
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.

    Returns
    -------
    Roots
        Of the n points.
    """
    segment, onset = _segment_and_onset(state, scene.ends)
    roots = Roots.none((segment,), p.size)
    buckled = np.sqrt(p) > onset
    if periodic(segment.kind):
        at = np.flatnonzero(buckled)
        m1 = complementary_parameter(np.sqrt(p[at]) / segment.kind.first)
        roots.put(at, _without_reaction(p[at], m1))
        return roots
    branch = free_branch(segment.kind, onset)
    last = branch.last
    at = np.flatnonzero(buckled & (p <= branch.p[last]))
    p = p[at]
    # Near its Euler load a branch is a parabola, p − p_n ∝ k².
    k = np.sqrt(np.interp(p, branch.p[: last + 1], branch.k[: last + 1] ** 2))
    kappa = np.clip(k, 1e-12, branch.k[last] * (1 - 1e-3)) * np.sqrt(p)
    lam = (np.interp(k, branch.k, branch.ratio) * kappa * np.sqrt(p))[None]
    bracket = Bracket(np.zeros_like(p), branch.k[last] * np.sqrt(p), np.full(p.size, -1.0))
    roots.put(at, newton({segment: 1}, p, scene.at(at), kappa, lam, bracket))
    return roots


def buckled_at_shortening(state, shortening, scene):
    """The free shape of a mode at given shortening.

    Parameters
    ----------
    state : State
    shortening : ndarray, shape (n,)
    scene : Scene
        Of the n points.

    Returns
    -------
    which : ndarray of int, shape (m,)
        Positions of those that have one.
    p : ndarray, shape (m,)
    roots : Roots
        Of the m.
    beyond : ndarray of bool, shape (n,)
        Where the shortening is greater than those up to which the shapes are known.
    """
    segment, onset = _segment_and_onset(state, scene.ends)
    if periodic(segment.kind):
        largest = 2 - 2 / LARGEST_K
        which = np.flatnonzero((shortening > 0) & (shortening <= largest))
        m, m1 = parameter_of_shortening(shortening[which])
        p = (segment.kind.first * integrals(m1, np.zeros_like(m1), np.ones_like(m1))[0]) ** 2
        roots = Roots(np.ones(which.size, bool), 2 * np.sqrt(m * p), np.zeros((1, p.size)))
        return which, p, roots, shortening > largest
    branch = free_branch(segment.kind, onset)
    largest = branch.shorter[-1]
    which = np.flatnonzero((shortening > 0) & (shortening < largest))
    target = shortening[which]
    # At small deflections the shortening is proportional to k².
    k = np.sqrt(np.interp(target, branch.shorter, branch.k**2))
    p = np.interp(k, branch.k, branch.p)
    node = np.searchsorted(branch.shorter, target) - 1
    bracket = Bracket(branch.k[node], branch.k[node + 1], -np.ones_like(target))
    lam = (np.interp(k, branch.k, branch.ratio) * k * p)[None]
    points = settle_at_shortening({segment: 1}, scene.at(which), k, p, lam, target, bracket)
    good = points.found
    return which[good], points.p[good], points.at(good).roots, shortening >= largest


def unresolved_load(state, ends):
    """Thrust p above which a state may exist but is not followed.

    Free shapes with λ = 0 come too near the pendulum's separatrix for numbers, those of strips on springs
    are followed only up to the loop where κ/√p = 1.98.
    """
    if not state.mode:
        return np.inf
    segment, onset = _segment_and_onset(state, ends)
    if periodic(segment.kind):
        return (segment.kind.first * LARGEST_K) ** 2
    branch = free_branch(segment.kind, onset)
    return branch.p[branch.last] if branch.last + 1 == branch.p.size else np.inf


def just_touching(segments, p, scene):
    """The free shape with its top at a wall, where λ = 0, and the scene with that wall, for like ends.

    Only before its ends pass each other, 2E = K: the loops beyond are no neighbours of any other shape.

    Parameters
    ----------
    segments : Mapping of Segment to int
        Of the shape with its top as a contact: of one kind.
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.

    Returns
    -------
    Roots, Scene
    """
    (((kind, *_), count),) = segments.items()
    K = np.sqrt(p) / (count * kind.first)
    buckled = (np.pi / 2 < K) & (K < ENDS_MEET_K)
    roots = _without_reaction(p, complementary_parameter(np.where(buckled, K, 2.0)))
    return roots._replace(found=buckled), scene._replace(H=kind.second * roots.kappa / p)


def _segment_and_onset(state, ends):
    """The one segment of a free shape, and √p where it begins."""
    (segment,) = state.segments(ends)
    return segment, float(euler_root(state.mode, ends))


def _without_reaction(p, m1):
    """Shapes with λ = 0 and 1 − m (n,)."""
    return Roots(np.ones(p.size, bool), 2 * np.sqrt(p * (1 - m1)), np.zeros((1, p.size)))


class FreeBranch(NamedTuple):
    """Nodes of the branch of a free mode from its Euler load to the loop where κ/√p = 1.98.

    Attributes
    ----------
    k, p, ratio, shorter : ndarray, shape (nodes,)
        κ/√p, thrust, λ/(κ√p) and shortening.
    last : int
        Node of the fold, where p is largest, or the last one.
    """

    k: np.ndarray
    p: np.ndarray
    ratio: np.ndarray
    shorter: np.ndarray
    last: int


@cache
def free_branch(kind, onset):
    """The branch of a free mode with the Euler load √p = `onset`.

    Returns
    -------
    FreeBranch
    """
    segments = {Segment(kind, 0, 0): 1}
    no_walls = Scene(None, np.zeros(1))

    def at(k, p, ratio):
        """Load, ratio and shortening at k from a start, and the slope of the load."""
        point = settle(segments, no_walls, np.array([k]), np.array([p]), np.array([[ratio * k * p]]))
        linear = bordered(segments, point.p, no_walls, point.k, point.lam)
        here = point.p[0], point.lam[0, 0] / (k * point.p[0]), linear.shorter[0]
        return tuple(map(float, here)), float(linear.load_k[0]) if point.found[0] else np.nan

    nodes = [(0.0, onset**2, _onset_ratio(kind, onset), 0.0)]
    last = None
    for ahead in NODES:
        k, p, ratio, _ = nodes[-1]
        here, slope = at(ahead, p, ratio)
        if np.isnan(slope):
            break
        if slope < 0 and last is None:
            near = p, ratio
            fold = brentq(lambda k, near=near: at(k, *near)[1], k or 1e-3, ahead, xtol=1e-12)
            last = len(nodes)
            nodes.append((fold, *at(fold, *near)[0]))
        nodes.append((ahead, *here))
    k, p, ratio, shorter = np.array(nodes).T
    return FreeBranch(k, p, ratio, shorter, len(nodes) - 1 if last is None else last)


def _onset_ratio(kind, onset):
    """λ/(κ√p) = tan φ₀ of the infinitesimal mode: rise 0 at total phase √p = `onset`."""
    phi = np.linspace(-1, 1, PHASES)[1:-1] * np.pi / 2
    sin, cos = np.sin(phi), np.cos(phi)
    phase, jump = kind.first * np.pi / 2 + kind.second * phi, kind.second * cos
    for c, sigma in kind.springs:
        eta = np.arccos(np.clip(c * sigma * sin / np.hypot(c, onset), -1, 1)) - np.arctan2(c, onset)
        phase, jump = phase - eta, jump + sigma * np.cos(eta)
    rise = jump + phase * sin
    return float(np.tan(phi[np.argmin(np.abs(rise) + np.abs(phase - onset))]))
