"""Equilibria of a chain between two walls by Newton's method, with the places of contact among the unknowns.

              θ          λ       cuts    p
          [ Hessian   l cos θ   growth   ·  ]   gradient of the Lagrangian
          [ (l cos θ)ᵀ   0      ± sin θ  0  ]   heights of the segments
          [ local        0       local   0  ]   θ lies on the wall at each cut
          [ (l sin θ)ᵀ   0     ±(1 − cos θ) 0 ]   prescribed shortening

The first block is tridiagonal, all others are narrow: a step costs O(N). When a cut passes from one link to
the next all equations stay continuous and their slopes jump a little; Newton's method does not mind.

Not here: where to start (`start`), what a state means (`properties`, `verdict`).
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.bordered import solve_bordered
from elastica.chain.splitting import (
    FEWEST_LINKS,
    Pattern,
    Split,
    Strip,
    conditions,
    growth_of_gradient,
    moving_pieces,
    split,
)

MOST_STEPS = 40
LARGEST_TURN = 0.5
"""Radians that one step may turn a link."""
LARGEST_SHIFT = 0.2
"""Part of the shortest segment by which one step may move a contact."""
CONVERGED = 1e-9
"""Relative step after which the next would be rounding."""


class Equilibrium(NamedTuple):
    """A chain in equilibrium.

    Attributes
    ----------
    strip : Strip
    pattern : Pattern
    H, p : float
        Half gap and thrust (EI = L = 1).
    pieces : Split
    theta : ndarray, shape (n,)
        Angles of the pieces.
    lam : ndarray, shape (segments,)
        Forces λ across the strip, positive where they push it down in the left part.
    cuts : ndarray, shape (q,)
        Arc lengths at which links are cut: one a point, two a line.
    """

    strip: Strip
    pattern: Pattern
    H: float
    p: float
    pieces: Split
    theta: np.ndarray
    lam: np.ndarray
    cuts: np.ndarray


class NoEquilibrium(Exception):
    """Newton's method found nothing; the message says why."""


def equilibrium(strip, pattern, H, start, p=None, shortening=None):
    """Newton's method from a start nearby.

    Parameters
    ----------
    strip, pattern : Strip, Pattern
    H : float
    start : Equilibrium
        Of any strip with any number of links, with the same pattern.
    p, shortening : float
        One of them: the thrust, or the shortening at which it is unknown.

    Returns
    -------
    Equilibrium

    Raises
    ------
    NoEquilibrium
    """
    cuts = start.cuts.copy()
    state = _placed(start, strip, pattern, H, start.p if p is None else p, cuts, split(strip, pattern, cuts))
    centres = 0.5 * (cuts[1:-1:2] + cuts[2:-1:2]) if pattern.line else cuts
    return _newton(state, centres, shortening)


def equilibrium_of_links(start, pieces, shortening=None):
    """Newton's method with contacts that stay where they are: links that lie on the wall are left out.

    Parameters
    ----------
    start : Equilibrium
    pieces : Split
        The free links.
    shortening : float, optional
        Prescribed in place of the load.

    Returns
    -------
    Equilibrium
        Without cuts.

    Raises
    ------
    NoEquilibrium
    """
    state = _placed(start, start.strip, start.pattern, start.H, start.p, np.zeros(0), pieces)
    return _newton(state, np.zeros(0), shortening)


def _placed(start, strip, pattern, H, p, cuts, pieces):
    """A state with the angles of another."""
    theta = np.interp(pieces.middles, start.pieces.middles, start.theta)
    return Equilibrium(strip, pattern, H, p, pieces, theta, start.lam.copy(), cuts)


def _newton(state, centres, shortening):
    """Iterate until a step is rounding."""
    rounding = np.finfo(float).eps * state.strip.links**2
    for _ in range(MOST_STEPS):
        step = _step(state, centres, shortening)
        fraction = _fraction(state, step)
        state = _advanced(state, step, fraction)
        size = np.abs(step.theta).max() / max(np.abs(state.theta).max(), 1e-300)
        if fraction == 1.0 and size <= max(CONVERGED, rounding):
            return state
    raise NoEquilibrium(
        "Newton's method does not settle; near a fold a chain of few links loses a state of the strip"
    )


class _Step(NamedTuple):
    """Changes of the unknowns."""

    theta: np.ndarray
    lam: np.ndarray
    cuts: np.ndarray
    p: float


def _step(state, centres, shortening):
    """The Newton step."""
    strip, pattern, pieces = state.strip, state.pattern, state.pieces
    chain, theta, lam, p = pieces.chain, state.theta, state.lam, state.p
    m, q = lam.size, state.cuts.size
    size = m + q + (shortening is not None)
    columns, rows = np.zeros((theta.size, size)), np.zeros((size, theta.size))
    corner, missing = np.zeros((size, size)), np.zeros(size)
    slopes = chain.rise_slopes(theta)
    columns[:, :m] = slopes
    rows[:m] = slopes.T
    missing[:m] = chain.rises(theta) - pattern.drops(state.H)
    if q:
        placed = conditions(strip, pattern, pieces, theta, state.cuts, centres)
        rows[m : m + q] = placed.by_theta
        corner[m : m + q, m : m + q] = placed.by_cut
        missing[m : m + q] = placed.values
    if shortening is not None:
        columns[:, -1] = -chain.lengths * np.sin(theta)
        rows[-1] = chain.lengths * np.sin(theta)
        missing[-1] = chain.shortening(theta) - shortening
    for k, moving in enumerate(moving_pieces(pattern, pieces) if q else ()):
        for piece, sign in moving:
            at, values = growth_of_gradient(strip, pieces, piece, theta, p, lam)
            columns[at, m + k] += sign * values
            corner[chain.segment[piece], m + k] += sign * np.sin(theta[piece])
            if shortening is not None:
                corner[-1, m + k] += 2 * sign * np.sin(0.5 * theta[piece]) ** 2
    try:
        diagonal, off = chain.hessian(theta, p, lam)
        gradient = chain.gradient(theta, p, lam)
        x, y = solve_bordered(diagonal, off, columns, rows, corner, -gradient, -missing)
    except np.linalg.LinAlgError as problem:
        raise NoEquilibrium(f"the chain is at a singular point: {problem}") from None
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise NoEquilibrium("Newton's method diverges on this chain")
    return _Step(x, y[:m], y[m : m + q], y[-1] if shortening is not None else 0.0)


def _fraction(state, step):
    """Part of a step that turns no link and moves no contact too far."""
    fraction = min(1.0, LARGEST_TURN / max(np.abs(step.theta).max(), 1e-300))
    if state.cuts.size:
        bounds = np.concatenate([[0.0], state.cuts, [1.0]])
        spans = bounds[state.pattern.stops + 1] - bounds[state.pattern.starts + 1]
        farthest = LARGEST_SHIFT * spans.min()
        fraction = min(fraction, farthest / max(np.abs(step.cuts).max(), 1e-300))
    return fraction


def _advanced(state, step, fraction):
    """The state after part of a step; angles of pieces whose link is cut elsewhere now are interpolated."""
    if not state.cuts.size:
        return state._replace(
            theta=state.theta + fraction * step.theta,
            lam=state.lam + fraction * step.lam,
            p=state.p + fraction * step.p,
        )
    cuts = state.cuts + fraction * step.cuts
    bounds = np.concatenate([[0.0], cuts, [1.0]])
    spans = bounds[state.pattern.stops + 1] - bounds[state.pattern.starts + 1]
    if not spans.min() >= FEWEST_LINKS * state.strip.h:
        wanted = int(np.ceil(FEWEST_LINKS / max(spans.min(), 1e-9)))
        raise NoEquilibrium(
            f"a free segment of length {spans.min():.3g} is under {FEWEST_LINKS} links; use links = {wanted}"
        )
    theta = state.theta + fraction * step.theta
    pieces = split(state.strip, state.pattern, cuts)
    if pieces.link.size != theta.size or (pieces.link != state.pieces.link).any():
        theta = np.interp(pieces.middles, state.pieces.middles, theta)
    return state._replace(
        pieces=pieces,
        theta=theta,
        lam=state.lam + fraction * step.lam,
        cuts=cuts,
        p=state.p + fraction * step.p,
    )
