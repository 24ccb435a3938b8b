"""The published setting: whole links on the wall, frozen end links, an energy method that shifts the contact.

           frozen       free          on the wall          free       frozen
        A ===h=== o ---h--- o --- … o =====h===== o … --- o ---h--- o ===h=== B   ===: θ = 0
                                    |begin     end|

Equilibrium: links between the frozen ones are free, each with its own angle, and rise by ±H on either side.
The springs stand between the middles of neighbours, k_i = EI_i/h, also where one of the two is frozen; a
spring end holds its link directly. All of it is of first order in h: the clamp acts half a link too far
inside, the contact is a link long and is found to a link.

Energy method with element splitting: let the contact shift by δ along the strip. The wall's link is split
there; the part that leaves the wall goes to the neighbour on the left, which grows to h + δ, and as much of
the neighbour on the right joins the wall, h − δ. Both springs of a neighbour span the way between middles,
k = EI/(h ± δ/2), so that a shift at constant curvature costs no bending. The Lagrangian then has besides
the chain's Hessian

    ∂²/∂δ²      Σ_sides Σ_springs k (Δθ)²/4h²
    ∂²/∂δ∂θ     ∓ k Δθ/2h at the ends of each spring, ∓ (p sin θ − λ cos θ) at the neighbour,
    ∂/∂δ        ± sin θ in the height of each side.

The first derivatives by δ of both sides cancel only if the shape is symmetric and its sides shift alike:
one δ serves both, and the state is taken to be stationary. That restriction is the publication's. It
assumes one contact, and that it is far from becoming a line: the springs see a shift only where κ is well
above λh, the change of curvature over a link. Below, the form has large negative eigenvalues that mean
nothing (−1e3 at P = 3.9, H = 0.1, 100 links), so that the ends of a line, κ = 0, are held instead. (With k
= EI/(h ± δ) on the free side only, an equally plausible reading, it converges to the conventional result.)
δ has no mass. The conventional method holds the middle of the contact instead and lets its link turn.
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.bordered import Bordered
from elastica.chain.equilibrium import equilibrium_of_links
from elastica.chain.links import Chain
from elastica.chain.splitting import Split


class Frozen(NamedTuple):
    """Which links of a published chain lie on the wall: from the link `begin` to before the link `end`."""

    begin: int
    end: int


def wall_links(strip, pattern, cuts):
    """The links on the wall nearest to where a chain with split links touches it; None without contact."""
    if not cuts.size:
        return None
    n = strip.links
    if not pattern.line:
        begin = min(int(cuts[0] * n), n - 1)
        return Frozen(begin, begin + 1)
    begin, end = np.rint(cuts * n).astype(int)
    return Frozen(int(begin), max(int(end), int(begin) + 1))


def published_pieces(strip, frozen):
    """The free links of a published chain and what holds them.

    Returns
    -------
    Split
        Whole links; `half` is half of the compliance h/EI of a spring.
    """
    n, h = strip.links, strip.h
    free = np.ones(n, bool)
    free[[place for place, end in ((0, strip.ends.A), (n - 1, strip.ends.B)) if end.clamped]] = False
    if frozen:
        free[frozen.begin : frozen.end] = False
    link = np.flatnonzero(free)
    between = strip.stiffness[1:] / h
    adjacent = np.diff(link) == 1
    springs = np.where(adjacent, between[link[1:] - 1], 0.0)
    held = np.zeros(n)
    held[1:] += np.where(free[:-1], 0.0, between)
    held[:-1] += np.where(free[1:], 0.0, between)
    for place, end in ((0, strip.ends.A), (n - 1, strip.ends.B)):
        if not end.clamped:
            held[place] += end.stiffness
    segment = (link >= frozen.end).astype(int) if frozen else np.zeros(link.size, int)
    first = np.searchsorted(segment, np.arange(segment[-1] + 1))
    last = np.append(first[1:], link.size) - 1
    chain = Chain(np.full(link.size, h), springs, held[link], segment)
    half = h / (2 * strip.stiffness[link])
    return Split(chain, half, link, (link + 0.5) * h, first, last)


def published_equilibrium(state, shortening=None):
    """The published chain nearest to a chain with split links.

    Parameters
    ----------
    state : Equilibrium
        With at most one contact.
    shortening : float, optional
        Prescribed in place of the load.

    Returns
    -------
    Equilibrium
        Its cuts are where the wall's links begin and end.
    """
    frozen = wall_links(state.strip, state.pattern, state.cuts)
    found = equilibrium_of_links(state, published_pieces(state.strip, frozen), shortening)
    return found._replace(cuts=np.array(frozen, float) * state.strip.h) if frozen else found


def published_variation(state, contacts_move=True, fixed_shortening=False):
    """The second variation of a published chain: links' angles and the contact's shift.

    Parameters
    ----------
    state : Equilibrium
        Its cuts are where the wall's links begin and end.
    contacts_move : bool
        False for the conventional method, with the wall's link among the unknowns.
    fixed_shortening : bool

    Returns
    -------
    Bordered
    """
    pieces, theta = state.pieces, state.theta
    chain = pieces.chain
    diagonal, off = chain.hessian(theta, state.p, state.lam)
    heights = chain.rise_slopes(theta)
    shorter = chain.lengths * np.sin(theta)
    mass = chain.lengths
    if state.pattern.walls and not contacts_move and not state.pattern.line:
        return _with_contact_link(state, diagonal, off, heights, shorter, fixed_shortening)
    border = heights
    if fixed_shortening:
        border = np.column_stack([border, shorter])
    q = border.shape[1]
    corner = np.zeros((q, q))
    if state.pattern.walls and not state.pattern.line:
        mixed, squared, rises, shortens = _shift(state)
        border = np.column_stack([border, mixed])
        corner = np.zeros((q + 1, q + 1))
        corner[-1, -1] = squared
        corner[-1, : rises.size] = corner[: rises.size, -1] = rises
        if fixed_shortening:
            corner[-1, q - 1] = corner[q - 1, -1] = shortens
    return Bordered(diagonal, off, border, corner, q, mass)


def _shift(state):
    """Second derivatives by the contact's shift, mixed (n,) and pure; slopes of heights and shortening."""
    chain, theta = state.pieces.chain, state.theta
    h = state.strip.h
    mixed, rises = np.zeros(theta.size), np.zeros(state.lam.size)
    squared = shortens = 0.0
    loads = chain.load(theta, state.p, state.lam)
    left, right = int(state.pieces.last[0]), int(state.pieces.first[1])
    for piece, behind, grows in ((left, left - 1, 1), (right, right + 1, -1)):
        towards_wall = chain.holds[piece] * theta[piece]
        away = chain.springs[min(piece, behind)] * (theta[piece] - theta[behind])
        mixed[piece] -= grows * ((towards_wall + away) / (2 * h) + loads[piece])
        mixed[behind] += grows * away / (2 * h)
        squared += (towards_wall * theta[piece] + away * (theta[piece] - theta[behind])) / (4 * h**2)
        rises[chain.segment[piece]] += grows * np.sin(theta[piece])
        shortens += grows * (1 - np.cos(theta[piece]))
    return mixed, squared, rises, shortens


def _with_contact_link(state, diagonal, off, heights, shorter, fixed_shortening):
    """The conventional method: the middle of the wall's link is held, the link may turn."""
    strip, pieces = state.strip, state.pieces
    place = int(pieces.first[1])
    link = round(float(state.cuts[0]) * strip.links)
    beside = strip.stiffness[link : link + 2] / strip.h
    diagonal = np.insert(diagonal, place, beside.sum() - strip.h * state.p)
    off = np.concatenate([off[: place - 1], -beside, off[place:]])
    border = np.insert(heights, place, 0.5 * strip.h, axis=0)
    if fixed_shortening:
        border = np.column_stack([border, np.insert(shorter, place, 0.0)])
    q = border.shape[1]
    mass = np.insert(pieces.chain.lengths, place, strip.h)
    return Bordered(diagonal, off, border, np.zeros((q, q)), q, mass)
