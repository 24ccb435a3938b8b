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
    NO_CUTS,
    Contacts,
    Mesh,
    Pieces,
    conditions,
    growth_of_gradient,
    moving_pieces,
    split,
)
from elastica.scene import Scene

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
    mesh : Mesh
    scene : Scene
        At one point: H is a number.
    contacts : Contacts
    p : float
        Thrust (EI = L = 1).
    pieces : Pieces
    theta : ndarray, shape (n,)
        Angles of the pieces.
    lam : ndarray, shape (segments,)
        Forces λ across the strip, positive where they push it down in the left part.
    cuts : ndarray, shape (q,)
        Arc lengths at which links are cut: one a point, two a line.
    """

    mesh: Mesh
    scene: Scene
    contacts: Contacts
    p: float
    pieces: Pieces
    theta: np.ndarray
    lam: np.ndarray
    cuts: np.ndarray

    @property
    def resultant(self):
        """Largest force F = √(p² + λ²) in a segment."""
        return float(np.hypot(self.p, self.lam).max())

    @property
    def reactions(self):
        """Force with which each wall pushes the strip back, shape (contacts,), EI/L² = 1."""
        return np.array(self.contacts.walls) * (self.lam[:-1] - self.lam[1:])


class NoEquilibrium(Exception):
    """Newton's method found nothing; the message says why."""


def equilibrium(mesh, contacts, start, shortening=None):
    """Newton's method from a start nearby, in its scene and under its thrust.

    Parameters
    ----------
    mesh, contacts : Mesh, Contacts
    start : Equilibrium
        On any mesh, with as many contacts.
    shortening : float, optional
        Prescribed in place of the thrust, which is an unknown then.

    Raises
    ------
    NoEquilibrium
    """
    cuts = start.cuts
    pieces = split(mesh, start.scene.ends, contacts, cuts)
    state = _placed(start._replace(mesh=mesh, contacts=contacts), pieces)
    centres = 0.5 * (cuts[1:-1:2] + cuts[2:-1:2]) if contacts.line else cuts
    return _newton(state, centres, shortening)


def equilibrium_of_links(start, pieces, shortening=None):
    """The same with contacts that stay where they are: links that lie on the wall are not among the pieces.

    The equilibrium found has no cuts.
    """
    state = _placed(start, pieces)._replace(cuts=NO_CUTS)
    return _newton(state, NO_CUTS, shortening)


def _placed(state, pieces):
    """A state with its angles at the middles of other pieces."""
    theta = np.interp(pieces.middles, state.pieces.middles, state.theta)
    return state._replace(pieces=pieces, theta=theta)


def _newton(state, centres, shortening):
    """Iterate until a step is rounding."""
    rounding = np.finfo(float).eps * state.mesh.links**2
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
    mesh, contacts, pieces = state.mesh, state.contacts, state.pieces
    chain, theta, lam, p = pieces.chain, state.theta, state.lam, state.p
    m, q = lam.size, state.cuts.size
    size = m + q + (shortening is not None)
    columns, rows = np.zeros((theta.size, size)), np.zeros((size, theta.size))
    corner, missing = np.zeros((size, size)), np.zeros(size)
    slopes = chain.rise_slopes(theta)
    columns[:, :m] = slopes
    rows[:m] = slopes.T
    missing[:m] = chain.rises(theta) - contacts.rises(state.scene)
    if q:
        placed = conditions(mesh, contacts, pieces, theta, state.cuts, centres)
        rows[m : m + q] = placed.by_theta
        corner[m : m + q, m : m + q] = placed.by_cut
        missing[m : m + q] = placed.values
    if shortening is not None:
        rows[-1] = chain.shortening_slopes(theta)
        columns[:, -1] = -rows[-1]
        missing[-1] = chain.shortening(theta) - shortening
    for k, moving in enumerate(moving_pieces(contacts, pieces) if q else ()):
        for piece, sign in moving:
            at, values = growth_of_gradient(mesh, pieces, piece, theta, p, lam)
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
        farthest = LARGEST_SHIFT * _shortest_segment(state.contacts, state.cuts)
        fraction = min(fraction, farthest / max(np.abs(step.cuts).max(), 1e-300))
    return fraction


def _shortest_segment(contacts, cuts):
    """Length of the shortest free segment."""
    bounds = np.concatenate([[0.0], cuts, [1.0]])
    return (bounds[contacts.stops + 1] - bounds[contacts.starts + 1]).min()


def _advanced(state, step, fraction):
    """The state after part of a step; angles of pieces whose link is cut elsewhere now are interpolated."""
    if not state.cuts.size:
        return state._replace(
            theta=state.theta + fraction * step.theta,
            lam=state.lam + fraction * step.lam,
            p=state.p + fraction * step.p,
        )
    cuts = state.cuts + fraction * step.cuts
    shortest = _shortest_segment(state.contacts, cuts)
    if not shortest >= FEWEST_LINKS * state.mesh.h:
        wanted = int(np.ceil(FEWEST_LINKS / max(shortest, 1e-9)))
        raise NoEquilibrium(
            f"a free segment of length {shortest:.3g} is under {FEWEST_LINKS} links; use links = {wanted}"
        )
    theta = state.theta + fraction * step.theta
    pieces = split(state.mesh, state.scene.ends, state.contacts, cuts)
    if pieces.link.size != theta.size or (pieces.link != state.pieces.link).any():
        theta = np.interp(pieces.middles, state.pieces.middles, theta)
    return state._replace(
        pieces=pieces,
        theta=theta,
        lam=state.lam + fraction * step.lam,
        cuts=cuts,
        p=state.p + fraction * step.p,
    )
