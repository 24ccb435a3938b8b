"""Which equilibria a state has: where Newton starts for each family of states, and what it means.

The closed small-deflection forms serve where the root is unique (alternating words, line regime, free
buckling); a sweep in κ finds every root of the other words. What is too steep for a start from small
deflections is reached by moving the walls from there, or from the free shape that just touches them, so
that it lies on the same branch.

Left out: names (`states`), admissibility, stability.
"""

from functools import cache
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from elastica.elliptic import complementary_parameter
from elastica.euler import euler_root
from elastica.newton import ROUNDING, Bracket, Roots, arrow_system, newton, regular, steepest_angle
from elastica.segments import geometry, length, pendulum
from elastica.states import Segment
from elastica.sweep import sweep

RIGHT_ANGLE = np.pi / 2
TINY_THRUST = 1e-6
"""Thrust below which starting values are taken at this thrust: they only have to be near."""
LINE_FOLD = 0.528160307318
"""H√P at the fold of the clamped line states, the maximum of sin α √cos α (2E − K)/(π/2) at α = 47.761°;
beyond it there are none. A segment from a pin ends at half of it."""
NARROW_GAP = 0.02
"""Half gap that is small for every strip: there the small-deflection start converges."""
MOST_BRANCH_STEPS, SMALLEST_BRANCH_STEP, LONGEST_BRANCH_STEP = 150, 1e-4, 0.1
LARGEST_K = 350.0
"""K(m) at which 1 − m leaves the range of numbers."""
ENDS_MEET_K = 2.3210497325
"""K(m) where K = 2E: the ends of the free shape meet."""
FOLD_SCAN = np.arange(0.05, 2.0, 0.05)


def find(state, ends, p, H):
    """Unknowns of `state` at n points.

    Parameters
    ----------
    state : State
    ends : Ends
    p, H : ndarray, shape (n,)
        Thrust p = 4π²P ≥ 0 and half gap H > 0; finite.

    Returns
    -------
    Roots
        `found` is False where the state has no equilibrium with |θ| < 90°, nor a steeper one on the
        branch that grows from small deflections or from a free shape that touches the wall.
    """
    segments = state.distinct_segments(ends)
    if state.mode:
        return _free(segments, p, float(euler_root(state.mode, ends)))
    alternating = all(segment.kind.turning_points == 1 for segment in segments)
    if (state.line or alternating) and state.root > 1:
        return Roots.none(segments, p.size)
    line = _line(segments, p, H)
    if state.line:
        return line
    if alternating:
        return _alternating(segments, p, H, line)
    roots = sweep(segments, p, H, line, state.root)
    roots.found[:] &= ~(steepest_angle(segments, p, roots) >= RIGHT_ANGLE)
    return roots


def unresolved_load(state, ends):
    """Thrust p above which a state exists but lies too near the pendulum's separatrix for numbers."""
    periodic = _periodic_kind(state, ends)
    return (periodic.first * LARGEST_K) ** 2 if periodic else np.inf


def pendulums_of(state, ends, p, kappa, lam):
    """The pendulums of a state's segments.

    Parameters
    ----------
    state, ends : State, Ends
    p, kappa : ndarray, shape (n,)
    lam : sequence of ndarray, shape (n,)

    Returns
    -------
    list of Pendulum
        Of free shapes with λ = 0, whose K(m) is known, with all digits of 1 − m.
    """
    periodic = _periodic_kind(state, ends)
    m1 = complementary_parameter(np.maximum(np.sqrt(p) / periodic.first, np.pi / 2)) if periodic else None
    return [pendulum(p, kappa, values, m1) for values in lam]


def _periodic_kind(state, ends):
    """The kind of a free shape with λ = 0: it exists at every load above its Euler load, K(m) ∝ √p."""
    if state.mode:
        ((kind, *_),) = state.segments(ends)
        return None if kind.second else kind
    return None


def _line(segments, p, H):
    """Line regime: every segment has its rise at κ = 0, from the small-deflection λ = p·rise/ℓ.

    The rise is a concave function of λ up to the fold of the line states, so Newton climbs to the
    root without passing it.
    """
    roots = Roots.none(segments, p.size)
    turns = np.array([(kind.first + kind.second) * np.pi / 2 for kind, *_ in segments])
    rises = np.array([segment.rise for segment in segments])
    scaled = np.max(rises / turns) * H * np.sqrt(p)
    below = np.flatnonzero(scaled <= LINE_FOLD * (1 + 1e-9))
    p, H = p[below], H[below]
    lam = p * np.sqrt(p) * H * (rises / turns)[:, None]
    line = newton(segments, p, H, np.zeros_like(p), lam, fixed_kappa=True)
    for j, (kind, *_) in enumerate(segments):
        line.found[:] &= geometry(kind, pendulum(p, line.kappa, line.lam[j])).rise_lam > 0
    roots.put(below, line)
    return roots


def _free(segments, p, onset):
    """Buckling without contact, from its Euler load √p = `onset` on, up to a fold if there is one.

    Modes whose two ends carry the same reaction (λ = 0) exist at every higher load, with K(m) = √p/n_K.
    The others, κ/√p being a function of p alone, exist up to the fold of that function; they start from
    their initial post-buckling, P/P_n − 1 ≈ 0.11 κ²/p.
    """
    ((kind, *_),) = segments
    roots = Roots.none(segments, p.size)
    if not kind.second:
        buckled = np.flatnonzero(np.sqrt(p) > onset)
        m1 = complementary_parameter(np.sqrt(p[buckled]) / kind.first)
        kappa = 2 * np.sqrt(p[buckled] * (1 - m1))
        roots.put(buckled, Roots(np.ones(buckled.size, bool), kappa, np.zeros((1, buckled.size))))
        return roots
    slope = np.tan((onset - kind.first * np.pi / 2) / kind.second)
    kappa_fold, root_p_fold = _fold_of_free(kind, slope)
    buckled = np.flatnonzero((np.sqrt(p) > onset) & (np.sqrt(p) <= root_p_fold))
    p = p[buckled]
    high = kappa_fold * np.sqrt(p)
    kappa = np.minimum(np.sqrt((p / onset**2 - 1) / 0.11 * p), 0.9 * high)
    lam = (np.sqrt(p) * kappa * slope)[None]
    bracket = Bracket(np.zeros_like(p), high, np.full(p.size, -1.0))
    roots.put(buckled, newton(segments, p, np.zeros_like(p), kappa, lam, bracket))
    return roots


@cache
def _fold_of_free(kind, slope):
    """κ/√p and √p at the fold of a free mode with λ ≠ 0, where its length at p = 1 is largest."""
    segments = {Segment(kind, 0, 0): 1}
    one, zero = np.ones(1), np.zeros(1)

    def settle(kappa, lam):
        found = newton(segments, one, zero, np.array([kappa]), lam, fixed_kappa=True)
        return found.lam, arrow_system(segments, one, zero, found.kappa, found.lam)

    lam, arrow = settle(FOLD_SCAN[0], np.array([[FOLD_SCAN[0] * slope]]))
    for before, kappa in pairwise(FOLD_SCAN):
        ahead, after = settle(kappa, lam + arrow.along * (kappa - before))
        if after.pivot[0] < 0:
            break
        lam, arrow = ahead, after
    fold = brentq(lambda kappa: float(settle(kappa, lam)[1].pivot[0]), before, kappa, xtol=1e-14)
    return fold, 1 + float(settle(fold, lam)[1].excess[0])


def _alternating(segments, p, H, line):
    """Words whose segments are all of kind S: the length falls with κ, so there is one root at most.

    It exists where the segments are longer than the strip at κ = 0.
    """
    roots = Roots.none(segments, p.size)
    slack = _total_length(segments, p, line) - 1
    flattened = np.flatnonzero(line.found & (np.abs(slack) <= 4 * ROUNDING))
    roots.put(flattened, line.at(flattened))

    sought = np.flatnonzero(~line.found | (slack > 4 * ROUNDING))
    p, H = p[sought], H[sought]
    found = newton(segments, p, H, *_small_deflection(segments, p, H))
    found.found[:] &= regular(segments, p, found, -1)
    steep = np.flatnonzero(~(found.found & (steepest_angle(segments, p, found) < RIGHT_ANGLE)))
    p, H = p[steep], H[steep]
    narrow = np.minimum(H, NARROW_GAP)
    near = newton(segments, p, narrow, *_small_deflection(segments, p, narrow))
    near.found[:] &= regular(segments, p, near, -1)
    found.put(steep, _move_walls(segments, near, p, (narrow, H)))
    wide = np.flatnonzero(~found.found[steep])
    if len(segments) == 1 and wide.size:
        free, height = _just_touching(segments, p[wide])
        found.put(steep[wide], _move_walls(segments, free, p[wide], (height, H[wide])))
    roots.put(sought, found)
    return roots


def _small_deflection(segments, p, H):
    """κ and λ of the linear strip θ'' + pθ = λ when all segments share one phase φ₀.

    With t = n_K π/2 + n_f φ₀ a segment has √p ℓ = t and p d = κ (n_f + t tan φ₀).
    """
    p = np.maximum(p, TINY_THRUST)
    root_p = np.sqrt(p)
    first = sum(count * kind.first for (kind, *_), count in segments.items())
    second = sum(count * kind.second for (kind, *_), count in segments.items())
    phi = (root_p - first * np.pi / 2) / second
    phi = np.minimum(phi, np.pi / 2 - 1e-3)
    tan = np.tan(phi)
    kappas = [
        p * (end - start) * H / (kind.second + (kind.first * np.pi / 2 + kind.second * phi) * tan)
        for kind, start, end in segments
    ]
    kappa = np.mean(kappas, axis=0)
    return kappa, np.tile(root_p * kappa * tan, (len(segments), 1))


def _just_touching(segments, p):
    """The free shape with its top at a wall, where λ = 0, and that wall's distance, for like ends.

    Only before its ends pass each other, 2E = K: the loops beyond are no neighbours of any other shape.
    """
    (((kind, *_), count),) = segments.items()
    K = np.sqrt(p) / (count * kind.first)
    buckled = (np.pi / 2 < K) & (K < ENDS_MEET_K)
    m1 = complementary_parameter(np.where(buckled, K, 2.0))
    kappa = 2 * np.sqrt(p * (1 - m1))
    return Roots(buckled, kappa, np.zeros((1, p.size))), kind.second * kappa / p


def _move_walls(segments, roots, p, H):
    """Follow roots as the gap changes from H[0] to H[1], as long as the branch stays regular.

    Each point takes its own steps, halved where Newton fails or goes far, so that it does not jump over
    a fold to another branch, and lengthened where it does not.
    """
    share, step = np.zeros(p.size), np.full(p.size, 1 / 16)
    found = roots.found.copy()
    for _ in range(MOST_BRANCH_STEPS):
        live = np.flatnonzero(found & (share < 1))
        if not live.size:
            break
        here = roots.at(live)
        ahead = np.minimum(share[live] + step[live], 1.0)
        H_ = H[0][live] + ahead * (H[1][live] - H[0][live])
        there = newton(segments, p[live], H_, here.kappa, here.lam, most_steps=8)
        near = np.abs(there.kappa - here.kappa) < LONGEST_BRANCH_STEP * here.kappa
        good = there.found & near & regular(segments, p[live], there, -1)
        roots.put(live[good], there.at(good))
        share[live[good]] = ahead[good]
        step[live] *= np.where(good, 1.5, 0.5)
        found[live] = step[live] > SMALLEST_BRANCH_STEP
    roots.found[:] = found & (share == 1)
    return roots


def _total_length(segments, p, roots):
    return sum(
        count * length(kind, pendulum(p, roots.kappa, lam))
        for ((kind, *_), count), lam in zip(segments.items(), roots.lam, strict=True)
    )
