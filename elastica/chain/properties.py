"""What is known of a chain in equilibrium: heights, curvature, energies, admissibility.

Not here: index and verdict (`verdict`), eigenvalues (`spectrum`).
"""

from typing import NamedTuple

import numpy as np

from elastica.codes import Status
from elastica.scales import FOUR_PI_SQUARED

TOUCHING = 1 / 12
"""Relative slack, in units of Fh²/EI, for what is exactly zero in the strip: a reaction, a clearance."""

RESTING_LINKS = 3
"""Links at the ends of a line's segments whose angles are too small to have a sign."""


class Outline(NamedTuple):
    """The polygon of a chain: arc length, x, y of its corners, and where its angles are known."""

    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    s_theta: np.ndarray
    theta: np.ndarray


def outline(state):
    """The polygon from end A to end B, flat stretches included, and the angle along it, linear between.

    Angles are known at the middles of the links, where they are zero, and at the ends.
    """
    pieces, theta = state.pieces, state.theta
    begins = pieces.middles - 0.5 * pieces.chain.lengths
    ends = pieces.middles + 0.5 * pieces.chain.lengths
    bounds = np.concatenate([[0.0], np.sort(np.concatenate([begins, ends])), [1.0]])
    s = np.unique(bounds)
    middles = 0.5 * (s[:-1] + s[1:])
    at = np.clip(np.searchsorted(begins, middles, side="right") - 1, 0, theta.size - 1)
    angle = np.where(middles < ends[at], np.where(middles > begins[at], theta[at], 0.0), 0.0)
    steps = np.diff(s)
    x, y = (np.concatenate([[0.0], np.cumsum(steps * f(angle))]) for f in (np.cos, np.sin))
    at_ends = [
        (place, 0.0 if end.clamped else theta[piece] / (1 + end.stiffness * pieces.half[piece]))
        for place, piece, end in zip((0.0, 1.0), (0, -1), state.scene.ends, strict=True)
    ]
    flat = np.concatenate([ends[pieces.last[:-1]], begins[pieces.first[1:]]])
    knots = np.concatenate([pieces.middles, flat, [0.0, 1.0]])
    angles = np.concatenate([theta, np.zeros(flat.size), [angle for _, angle in at_ends]])
    order = np.argsort(knots, kind="stable")
    return Outline(s, x, y, knots[order], angles[order])


def clearance(state):
    """H − max |y| over the interior extrema that are not contacts, H where there are none.

    They lie where angles change sign within a segment; the angle is linear between the middles of links.
    Where a line begins, and at a clamp that rests, angles are zero to within O(h²) and may have either
    sign.
    """
    chain, theta = state.pieces.chain, state.theta
    if state.contacts.line:
        theta = theta.copy()
        for offset in range(RESTING_LINKS):
            theta[state.pieces.first + offset] = theta[state.pieces.last - offset] = 0.0
    rises = chain.lengths * np.sin(theta)
    heights = np.cumsum(rises) - 0.5 * rises
    crossing = np.flatnonzero((theta[:-1] * theta[1:] < 0) & (chain.segment[:-1] == chain.segment[1:]))
    if not crossing.size:
        return state.scene.H
    part = theta[crossing] / (theta[crossing] - theta[crossing + 1])
    reach = np.diff(state.pieces.middles)[crossing] * part
    return state.scene.H - np.abs(heights[crossing] + 0.5 * theta[crossing] * reach).max()


def curvature(state, setting):
    """|θ'| where θ = 0: at the first contact; of a free strip at a clamp or the first crossing."""
    pieces, theta, mesh = state.pieces, state.theta, state.mesh
    if state.contacts.line or not theta.any():
        return 0.0
    if state.contacts.walls:
        return float(np.abs(setting.contact_curvatures(state)[0]))
    for place, piece, end in zip((0.0, 1.0), (0, -1), state.scene.ends, strict=True):
        if end.clamped:
            return float(pieces.chain.holds[piece] * abs(theta[piece]) / mesh.profile(place))
    crossing = np.flatnonzero(theta[:-1] * theta[1:] <= 0)
    if not crossing.size:
        return np.nan
    at = int(crossing[0])
    part = theta[at] / (theta[at] - theta[at + 1])
    place = pieces.middles[at] + part * (pieces.middles[at + 1] - pieces.middles[at])
    joints = 0.5 * (pieces.middles[:-1] + pieces.middles[1:])
    return float(abs(np.interp(place, joints, pieces.chain.moments(theta))) / mesh.profile(place))


def properties(state, lam_signs, setting, periods):
    """Values of the array attributes of `Solution` at one point, without the verdict.

    Parameters
    ----------
    state : Equilibrium
    lam_signs : ndarray, shape (segments,)
        1 or −1: sign of λ in each segment's rising convention.
    setting : Setting
    periods : ndarray, shape (segments,)

    Returns
    -------
    dict
    """
    pieces, theta, contacts = state.pieces, state.theta, state.contacts
    chain = pieces.chain
    bending, shorter = chain.bending_energy(theta), chain.shortening(theta)
    starts = pieces.middles[pieces.first] - 0.5 * chain.lengths[pieces.first]
    stops = pieces.middles[pieces.last] + 0.5 * chain.lengths[pieces.last]
    starts[0], stops[-1] = 0.0, 1.0
    gaps = starts[1:] - stops[:-1]
    flat = float(gaps.sum()) if contacts.line else 0.0
    position = stops[:-1] if contacts.line else 0.5 * (stops[:-1] + starts[1:])
    pushes = state.reactions
    gap = clearance(state)
    end_angles = outline(state).theta[[0, -1]]
    pull = state.p * np.abs(theta).max(initial=0.0) + np.abs(state.lam).max(initial=0.0)
    slack = 1e-9 + TOUCHING * state.resultant * state.mesh.h**2 / state.mesh.stiffness.min()
    fits = (pushes >= -slack * pull).all() and flat >= 0 and gap >= -slack * state.scene.H
    segments = state.lam.size if theta.any() else 0
    return {
        "P": state.p / FOUR_PI_SQUARED,
        "status": Status.SOLVED if fits else Status.INADMISSIBLE,
        "curvature": curvature(state, setting),
        "energy": (bending - state.p * shorter) / FOUR_PI_SQUARED,
        "bending_energy": bending / FOUR_PI_SQUARED,
        "shortening": shorter,
        "flat_length": flat,
        "max_slope": max(np.abs(theta).max(initial=0.0), np.abs(end_angles).max()),
        "clearance": gap,
        "reaction": pushes / FOUR_PI_SQUARED,
        "contact_position": position,
        "lam": (lam_signs * state.lam)[:segments],
        "lengths": (stops - starts)[:segments],
        "periods": periods[:segments],
    }


def contacts_hold(state, setting):
    """Whether the strip bends away from the wall at every point contact, as it must between the walls."""
    if state.contacts.line or not state.contacts.walls:
        return True
    return bool((np.array(state.contacts.walls) * setting.contact_curvatures(state) < 0).all())
