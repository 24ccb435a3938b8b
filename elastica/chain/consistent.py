"""The consistent setting, of second order: the chain that `splitting` cuts, and what its contacts cost.

Rotate the pieces by φ. At a contact (drawing in `splitting`) the link without length that lies on the wall
turns by φ_c, and the place where the strip lies on the wall moves to where its angle vanishes again, δ =
−φ_c/κ_c; beyond first order the height there changes by φ_c²/2|κ_c|, and the reaction R works on it. With
the two half-link springs that join it to its neighbours, the contact adds

    Q_c = (φ_c − φ_l)²/a_l + (φ_r − φ_c)²/a_r + g φ_c²,     g = R/|κ_c|,     κ_c = (θ_r − θ_l)/(a_l + a_r)/EI.

φ_c has no mass and is minimised out, which leaves the chain's matrix as narrow as it was:

           φ_l        φ_c         φ_r                           φ_l            φ_r
        [  1/a_l     −1/a_l        0     ]                  [  k + G a_r²    −k + G a_r a_l  ]
        [ −1/a_l   1/a_l+1/a_r+g  −1/a_r ]      →           [ −k + G a_r a_l  k + G a_l²     ]
        [   0        −1/a_r       1/a_r  ]
                                                   k = 1/(a_l + a_r),   G = k² g/(1 + g k a_l a_r):

the spring k that the chain has there anyway and a correction of rank one, regular for ξ = 0 and 1. Heights of
contacts are kept to first order, Σ l cos θ φ = 0 in each segment; at prescribed shortening Σ l sin θ φ = 0
too. With g = 0 it is the conventional method: the contact held at its material point, its slope free.

Where a line begins and ends φ = 0: the pieces beside it are held by their own half, as at a clamp.

It assumes contacts that roll without friction and stay contacts (R > 0), walls that do not yield, and κ_c ≠
0. Eigenvalues are those of Q with weight Σ l φ², EI = L = 1: 4π² (Hessian of the dimensionless energy)/h.

Not here: the equilibrium itself (`equilibrium`), what the sign of an eigenvalue means (`verdict`).
"""

import numpy as np

from elastica.chain.bordered import QuadraticForm
from elastica.control import LOAD

MOST_CONTACTS: float = np.inf
STIFFEST_HOLD = 1e8
"""Hold of a piece (almost) without length beside a line, in units of the spring of a link."""
SECOND_ORDER = 1 / 12
"""Part of q⁴h² by which eigenvalues are off for waves of q² = F: what a second difference leaves out."""


def settled(state, shortening=None):
    """The chain as it is: links are cut already where the strip touches."""
    return state


def second_variation(state, contacts_move=True, control=LOAD):
    """The angles of the pieces; the contacts' own are minimised out."""
    pieces, theta = state.pieces, state.theta
    chain = pieces.chain
    diagonal, off = chain.hessian(theta, state.p, state.lam)
    if state.contacts.line:
        diagonal += _line_holds(state)
    elif contacts_move:
        diagonal, off = _with_contacts(state, diagonal, off)
    border = chain.constraint_slopes(theta, control)
    q = border.shape[1]
    return QuadraticForm(diagonal, off, border, np.zeros((q, q)), q, chain.lengths)


def contact_curvatures(state):
    """θ' at each contact, by the two pieces that meet there."""
    left, right = state.pieces.last[:-1], state.pieces.first[1:]
    half, theta = state.pieces.half, state.theta
    moments = (theta[right] - theta[left]) / (half[left] + half[right])
    return moments / state.mesh.profile(state.cuts)


def truncation(state):
    """Of second order."""
    F, h, softest = state.resultant, state.mesh.h, state.mesh.stiffness.min()
    return SECOND_ORDER * F**2 * h**2 / softest


def resolves_contacts(state):
    """Whether κ is larger than what θ'' leaves of it over a link."""
    unresolved = SECOND_ORDER * np.abs(state.lam).max() * np.sqrt(state.resultant) * state.mesh.h**2
    return np.abs(contact_curvatures(state)).min() > unresolved


def _with_contacts(state, diagonal, off):
    """The Hessian with the energy that moving contacts cost."""
    left, right = state.pieces.last[:-1], state.pieces.first[1:]
    a_l, a_r = state.pieces.half[left], state.pieces.half[right]
    total = a_l + a_r
    kappa = np.abs(contact_curvatures(state))
    # As (1/g + a_l a_r/total)⁻¹, so that κ = 0 is a limit.
    R = state.reactions
    stiffness = R / (kappa + R * a_l * a_r / total)
    on_left, on_right = a_r / total, a_l / total
    diagonal[left] += stiffness * on_left**2
    diagonal[right] += stiffness * on_right**2
    off[left] += stiffness * on_left * on_right
    return diagonal, off


def _line_holds(state):
    """Holds of the pieces where lines begin and end, and at clamps that rest, shape (n,)."""
    pieces, mesh = state.pieces, state.mesh
    holds = np.zeros(pieces.half.size)
    ends = [*pieces.last[:-1], *pieces.first[1:]]
    resting = state.contacts.resting
    ends += [place for place, rests in zip((0, holds.size - 1), resting, strict=True) if rests]
    softest = 1 / (STIFFEST_HOLD * mesh.links * mesh.stiffness[pieces.link[ends]])
    np.add.at(holds, ends, 1 / np.maximum(pieces.half[ends], softest))
    return holds
