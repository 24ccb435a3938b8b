"""The energy method with element splitting, of second order: what rotations of a cut chain cost.

Rotate the pieces by φ. At a contact (drawing in `splitting`) the link without length that lies on the wall
turns by φ_c, and the place where the strip lies on the wall moves to where its angle vanishes again, δ =
−φ_c/κ_c; beyond first order the height there changes by φ_c²/2|κ_c|, and the reaction R works on it. With
the two half-link springs that join it to its neighbours, the contact adds

    Q_c = (φ_c − φ_l)²/a_l + (φ_r − φ_c)²/a_r + g φ_c²,     g = R/|κ_c|,     κ_c = (θ_r − θ_l)/(a_l + a_r)/EI.

φ_c has no mass and is minimised out: with its free value φ̄ = (a_r φ_l + a_l φ_r)/(a_l + a_r),

    Q_c = (φ_r − φ_l)²/(a_l + a_r) + g φ̄²/(1 + g a_l a_r/(a_l + a_r)),

the spring that the chain has there anyway and a correction of rank one, regular for ξ = 0 and 1. Heights of
contacts are kept to first order, Σ l cos θ φ = 0 in each segment; at prescribed shortening Σ l sin θ φ = 0
too. With g = 0 it is the conventional method: the contact held at its material point, its slope free.

Where a line begins and ends φ = 0: the pieces beside it are held by their own half, as at a clamp.

It assumes contacts that roll without friction and stay contacts (R > 0), walls that do not yield, and κ_c ≠
0. Eigenvalues are those of Q with weight Σ l φ², EI = L = 1: 4π² (Hessian of the dimensionless energy)/h.
"""

import numpy as np

from elastica.chain.bordered import Bordered

STIFFEST_HOLD = 1e8
"""Hold of a piece (almost) without length beside a line, in units of the spring of a link."""


def second_variation(state, contacts_move=True, fixed_shortening=False):
    """The second variation of a chain in equilibrium.

    Parameters
    ----------
    state : Equilibrium
    contacts_move : bool
        False holds each contact at its material point: the conventional method.
    fixed_shortening : bool

    Returns
    -------
    Bordered
    """
    pieces, theta = state.pieces, state.theta
    chain = pieces.chain
    diagonal, off = chain.hessian(theta, state.p, state.lam)
    if state.pattern.line:
        diagonal += _line_holds(state)
    elif contacts_move:
        diagonal, off = _with_contacts(state, diagonal, off)
    border = chain.rise_slopes(theta)
    if fixed_shortening:
        border = np.column_stack([border, chain.lengths * np.sin(theta)])
    q = border.shape[1]
    return Bordered(diagonal, off, border, np.zeros((q, q)), q, chain.lengths)


def floor(state):
    """A number below all eigenvalues of T: minus the largest load p cos θ + λ sin θ, and some more."""
    chain = state.pieces.chain
    forces = state.p * np.cos(state.theta) + state.lam[chain.segment] * np.sin(state.theta)
    return -1.05 * max(float(forces.max()), 0.0) - 1.0


def contact_curvatures(state):
    """θ' at each point contact, negative at the upper wall, shape (contacts,)."""
    left, right = state.pieces.last[:-1], state.pieces.first[1:]
    half, theta = state.pieces.half, state.theta
    moments = (theta[right] - theta[left]) / (half[left] + half[right])
    return moments / state.strip.profile(state.cuts)


def reactions(state):
    """Force with which each wall pushes the strip back, shape (contacts,), EI/L² = 1."""
    return np.array(state.pattern.walls) * (state.lam[:-1] - state.lam[1:])


def _with_contacts(state, diagonal, off):
    """The Hessian with the energy that moving contacts cost."""
    left, right = state.pieces.last[:-1], state.pieces.first[1:]
    a_l, a_r = state.pieces.half[left], state.pieces.half[right]
    total = a_l + a_r
    kappa = np.abs(contact_curvatures(state))
    # As (1/g + a_l a_r/total)⁻¹, so that κ = 0 is a limit.
    R = reactions(state)
    stiffness = R / (kappa + R * a_l * a_r / total)
    on_left, on_right = a_r / total, a_l / total
    diagonal[left] += stiffness * on_left**2
    diagonal[right] += stiffness * on_right**2
    off[left] += stiffness * on_left * on_right
    return diagonal, off


def _line_holds(state):
    """Holds of the pieces where lines begin and end, and at clamps that rest, shape (n,)."""
    pieces, strip = state.pieces, state.strip
    holds = np.zeros(pieces.half.size)
    ends = [*pieces.last[:-1], *pieces.first[1:]]
    ends += [place for place, rests in zip((0, holds.size - 1), state.pattern.resting, strict=True) if rests]
    softest = 1 / (STIFFEST_HOLD * strip.links * strip.stiffness[pieces.link[ends]])
    np.add.at(holds, ends, 1 / np.maximum(pieces.half[ends], softest))
    return holds
