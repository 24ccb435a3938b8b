"""Which equilibria a state has: where Newton starts for each family of states, and what it means.

The closed small-deflection forms serve where the root is unique (alternating words, line regime, free
buckling); a sweep in κ finds every root of the other words. What is too steep for a start from small
deflections is reached from there in small changes of H or P, so that it lies on the same branch.

Left out: names (`states`), admissibility, stability.
"""

import numpy as np

from elastica.euler import euler_root
from elastica.newton import ROUNDING, Roots, newton, regular, steepest_angle
from elastica.segments import geometry, length, pendulum
from elastica.sweep import sweep

RIGHT_ANGLE = np.pi / 2
TINY_THRUST = 1e-6
"""Thrust below which starting values are taken at this thrust: they only have to be near."""
LINE_FOLD = 0.528160307318
"""H√P at the fold of the clamped line states, the maximum of sin α √cos α (2E − K)/(π/2) at α = 47.761°;
beyond it there are none. A segment from a pin ends at half of it."""
BRANCH_STEPS = 24
LARGEST_K = 16.0
"""K(m) at which 1 − m = 2e-13 has lost all but three digits."""


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
        branch that grows from small deflections.
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
    """Thrust p above which a state exists but is too near the pendulum's separatrix to be computed.

    Free shapes with λ = 0 exist at every thrust above their Euler load, with K(m) ∝ √p.
    """
    for kind, *_ in state.segments(ends):
        if state.mode and not kind.second:
            return (kind.first * LARGEST_K) ** 2
    return np.inf


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

    Modes whose two ends carry the same reaction (λ = 0) exist at every higher load: K(m) ≈
    ln(4/√m₁) overestimates their amplitude, and as the length grows with κ Newton comes down to the
    root. The other modes start from their initial post-buckling, P/P_n − 1 ≈ 0.11 κ²/p.
    """
    ((kind, *_),) = segments
    roots = Roots.none(segments, p.size)
    buckled = np.flatnonzero(np.sqrt(p) > onset)
    p = p[buckled]
    H = np.zeros_like(p)
    if not kind.second:
        m1 = 16 * np.exp(-2 * np.sqrt(p) / kind.first)
        kappa = 2 * np.sqrt(p) * np.sqrt(1 - m1)
        roots.put(buckled, newton(segments, p, H, kappa, H[None]))
        return roots
    slope = np.tan((onset - kind.first * np.pi / 2) / kind.second)

    def start(p):
        kappa = np.sqrt((p / onset**2 - 1) / 0.11 * p)
        return kappa, (np.sqrt(p) * kappa * slope)[None]

    found = newton(segments, p, H, *start(p))
    found.found[:] &= regular(segments, p, found, +1)
    steep = np.flatnonzero(~(found.found & (steepest_angle(segments, p, found) < RIGHT_ANGLE)))
    begin = np.minimum(p[steep], 1.02 * onset**2)
    near = newton(segments, begin, H[steep], *start(begin))
    found.put(steep, _along(segments, near, (begin, p[steep]), (H[steep], H[steep]), +1))
    roots.put(buckled, found)
    return roots


def _alternating(segments, p, H, line):
    """Words whose segments are all of kind S: the length falls with κ, so there is one root at most.

    It exists where the segments are longer than the strip at κ = 0.
    """
    roots = Roots.none(segments, p.size)
    slack = _total_length(segments, p, line) - 1
    touching = np.flatnonzero(line.found & (np.abs(slack) <= 4 * ROUNDING))
    roots.put(touching, line.at(touching))

    sought = np.flatnonzero(~line.found | (slack > 4 * ROUNDING))
    p, H = p[sought], H[sought]
    found = newton(segments, p, H, *_small_deflection(segments, p, H))
    found.found[:] &= regular(segments, p, found, -1)
    steep = np.flatnonzero(~(found.found & (steepest_angle(segments, p, found) < RIGHT_ANGLE)))
    p, H = p[steep], H[steep]
    narrow = np.minimum(H, 0.02)
    near = newton(segments, p, narrow, *_small_deflection(segments, p, narrow))
    found.put(steep, _along(segments, near, (p, p), (narrow, H), -1))
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


def _along(segments, roots, p, H, sign):
    """Follow roots from (p[0], H[0]) to (p[1], H[1]) as long as the branch stays regular."""
    before = roots
    for step in range(1, BRANCH_STEPS + 1):
        if not roots.found.any():
            break
        share = step / BRANCH_STEPS
        p_, H_ = (start + share * (stop - start) for start, stop in (p, H))
        kappa, lam = 2 * roots.kappa - before.kappa, 2 * roots.lam - before.lam
        after = newton(segments, p_, H_, kappa, lam, most_steps=12)
        after.found[:] &= roots.found & regular(segments, p_, after, sign)
        before, roots = roots, after
    return roots


def _total_length(segments, p, roots):
    return sum(
        count * length(kind, pendulum(p, roots.kappa, lam))
        for ((kind, *_), count), lam in zip(segments.items(), roots.lam, strict=True)
    )
