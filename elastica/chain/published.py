"""The published setting, of first order: whole links on the wall and at clamps, a contact that shifts.

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
the chain's Hessian a border for δ:

          φ, one a free link     λ, one a side    δ
        [ Hessian, tridiagonal      l cos θ       mixed ]    mixed: ∓ k Δθ/2h at the ends of each spring and
        [ (l cos θ)ᵀ                0           ± sin θ ]           ∓ (p sin θ − λ cos θ) at the neighbours
        [ mixedᵀ                  ± sin θ       squared ]    squared: Σ k (Δθ)²/4h² over springs of both sides

The first derivatives by δ of both sides cancel only if the shape is symmetric and its sides shift alike:
one δ serves both, and the state is taken to be stationary. That restriction is the publication's. It
assumes one contact, and that it is far from becoming a line: the springs see a shift only where κ is well
above λh, the change of curvature over a link. Below, the form has large negative eigenvalues that mean
nothing (−1e3 at P = 3.9, H = 0.1, 100 links), so that the ends of a line, κ = 0, are held instead. (With k
= EI/(h ± δ) on the free side only, an equally plausible reading, it converges to the conventional result.)
δ has no mass. The conventional method holds the middle of the contact instead and lets its link turn.

Not here: the chain with cut links from which this one starts (`equilibrium`).
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.bordered import QuadraticForm
from elastica.chain.equilibrium import equilibrium_of_links
from elastica.chain.links import Chain
from elastica.chain.splitting import Pieces
from elastica.control import LOAD

FIRST_ORDER = 1 / 4
"""Part of √F h F by which eigenvalues are off, as seen at asymmetric states."""
MOST_CONTACTS: float = 1
UNRESOLVED_CURVATURE = 2.0
"""κ in units of λh below which links cannot tell a shift of the contact from a turn."""


class Frozen(NamedTuple):
    """Which links lie on the wall: from the link `begin` to before the link `end`."""

    begin: int
    end: int


def wall_links(mesh, contacts, cuts):
    """The links on the wall nearest to where a chain with split links touches it; None without contact."""
    if not cuts.size:
        return None
    n = mesh.links
    if not contacts.line:
        begin = min(int(cuts[0] * n), n - 1)
        return Frozen(begin, begin + 1)
    begin, end = np.rint(cuts * n).astype(int)
    return Frozen(int(begin), max(int(end), int(begin) + 1))


def free_links(mesh, ends, frozen):
    """The free links and what holds them.

    Parameters
    ----------
    mesh : Mesh
    ends : Ends
    frozen : Frozen or None

    Returns
    -------
    Pieces
        Whole links; `half` is half of the compliance h/EI of a spring.
    """
    n, h = mesh.links, mesh.h
    at_ends = tuple(zip((0, n - 1), ends, strict=True))
    free = np.ones(n, bool)
    free[[place for place, end in at_ends if end.clamped]] = False
    if frozen:
        free[frozen.begin : frozen.end] = False
    link = np.flatnonzero(free)
    between = mesh.stiffness[1:] / h
    adjacent = np.diff(link) == 1
    springs = np.where(adjacent, between[link[1:] - 1], 0.0)
    holds = np.zeros(n)
    holds[1:] += np.where(free[:-1], 0.0, between)
    holds[:-1] += np.where(free[1:], 0.0, between)
    for place, end in at_ends:
        if not end.clamped:
            holds[place] += end.stiffness
    segment = (link >= frozen.end).astype(int) if frozen else np.zeros(link.size, int)
    first = np.searchsorted(segment, np.arange(segment[-1] + 1))
    last = np.append(first[1:], link.size) - 1
    chain = Chain(np.full(link.size, h), springs, holds[link], segment)
    half = h / (2 * mesh.stiffness[link])
    return Pieces(chain, half, link, (link + 0.5) * h, first, last)


def settled(state, shortening=None):
    """The chain of whole links nearest to it; its cuts are where the wall's links begin and end."""
    frozen = wall_links(state.mesh, state.contacts, state.cuts)
    found = equilibrium_of_links(state, free_links(state.mesh, state.scene.ends, frozen), shortening)
    return found._replace(cuts=np.array(frozen, float) * state.mesh.h) if frozen else found


def second_variation(state, contacts_move=True, control=LOAD):
    """The angles of the free links, and the contact's shift or the angle of its link."""
    chain, theta = state.pieces.chain, state.theta
    diagonal, off = chain.hessian(theta, state.p, state.lam)
    border = chain.constraint_slopes(theta, control)
    q = border.shape[1]
    form = QuadraticForm(diagonal, off, border, np.zeros((q, q)), q, chain.lengths)
    if state.contacts.line or not state.contacts.walls:
        return form
    return _with_shift(form, state) if contacts_move else _with_contact_link(form, state)


def contact_curvatures(state):
    """θ' at the one contact, by the moments of the springs on both of its sides."""
    chain, theta = state.pieces.chain, state.theta
    left, right = state.pieces.last[0], state.pieces.first[1]
    moment = np.mean([chain.holds[piece] * abs(theta[piece]) for piece in (left, right)])
    stiffness = float(state.mesh.profile(state.cuts.mean()))
    return np.array([np.sign(theta[right] - theta[left]) * (moment / stiffness)])


def truncation(state):
    """Of first order."""
    F, h, softest = state.resultant, state.mesh.h, state.mesh.stiffness.min()
    return FIRST_ORDER * np.sqrt(F / softest) * h * F


def resolves_contacts(state):
    """Whether κ is well above λh."""
    h = state.mesh.h
    turn = min(abs(state.theta[place]) for place in (state.pieces.last[0], state.pieces.first[1]))
    return turn / h > UNRESOLVED_CURVATURE * np.abs(state.lam).max() * h


def _with_shift(form, state):
    """The form with the contact's shift δ as a variable without mass."""
    chain, theta, q = state.pieces.chain, state.theta, form.constraints
    h = state.mesh.h
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
    corner = np.zeros((q + 1, q + 1))
    corner[-1, :q] = corner[:q, -1] = np.append(rises, shortens)[:q]
    corner[-1, -1] = squared
    return form._replace(border=np.column_stack([form.border, mixed]), corner=corner)


def _with_contact_link(form, state):
    """The form with the angle of the wall's link, whose middle is held: half of it rises on either side."""
    mesh = state.mesh
    place = int(state.pieces.first[1])
    link = round(float(state.cuts[0]) * mesh.links)
    beside = mesh.stiffness[link : link + 2] / mesh.h
    slopes = np.zeros(form.constraints)
    slopes[: state.lam.size] = 0.5 * mesh.h
    return form._replace(
        diagonal=np.insert(form.diagonal, place, beside.sum() - mesh.h * state.p),
        off=np.concatenate([form.off[: place - 1], -beside, form.off[place:]]),
        border=np.insert(form.border, place, slopes, axis=0),
        mass=np.insert(form.mass, place, mesh.h),
    )
