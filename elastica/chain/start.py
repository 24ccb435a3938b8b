"""Where Newton's method starts: the exact state of a uniform strip, then the stiffness profile in steps.

A strip with the profile EI(s) is reached through EI₀^(1−t) EI(s)^t, t from 0 to 1, EI₀ the stiffness with
the same mean compliance. A uniform strip of stiffness EI₀ under the thrust p is the exact one under p/EI₀.

A line next to a clamp is a singular place to start from. In a strip that is not uniform

    ½ M²/EI − p cos θ − λ sin θ     changes along the strip by     −½ ∫ κ² EI' ds,

so with θ = M = 0 where the line begins the clamp carries M₀² = EI ∫ κ² EI' ds from clamp to line. Where
that is negative (strips that are stiffer near the clamp) there is no such state: the contact stays a point.
Otherwise M₀ grows like √t, as if the shape had slid into the clamp by M₀/λ, and that is where the first
step starts.

Not here: the exact state itself (`elastica.solution`), the steps of Newton's method (`equilibrium`).
"""

import numpy as np

from elastica.chain.equilibrium import Equilibrium, NoEquilibrium, equilibrium
from elastica.chain.splitting import Contacts, split
from elastica.scales import FOUR_PI_SQUARED
from elastica.shapes import angles

SMALLEST_STEP = 1 / 512
FIRST_STEP = 1 / 4
LARGEST_CHANGE = 0.5
"""Part of the largest angle by which angles may change in one step of the continuation."""
LARGEST_MOVE = 0.1
"""Arc length by which a contact may move."""


def contacts_of(state, ends):
    """What a state of a uniform strip touches: clamps next to lines rest."""
    resting = tuple(state.line and end.clamped for end in ends)
    return Contacts(tuple(state.walls), state.line, resting)


def lam_signs(exact):
    """1 or −1: sign of the chain's λ in the rising convention of each segment, shape (segments,).

    The straight strip has one segment here, as all chains have.
    """
    walls = exact.state.walls
    sides = np.array([*walls, walls[-1]] if walls else [1])
    return np.where(exact.state.reversed_segments(exact.ends), -sides, sides)


def exact_start(exact, point, mesh, scene):
    """An exact state in the unknowns of a chain.

    Parameters
    ----------
    exact : Solution
    point : int
        A point of a flat solution where the state exists.
    mesh : Mesh
        Uniform; if its EI is not 1, `exact` is the solution with load and springs in units of it.
    scene : Scene
        Of the chain at that point.

    Returns
    -------
    Equilibrium
        Its angles belong to the uncut links; Newton's method interpolates them.
    """
    stiffness = float(mesh.stiffness[0])
    contacts = contacts_of(exact.state, scene.ends)
    cuts = position = exact.contact_position[point]
    if contacts.line:
        flat = exact.flat_length[point] / position.size
        cuts = np.column_stack([position, position + flat]).ravel()
    uncut = split(mesh, scene.ends)
    p = FOUR_PI_SQUARED * float(exact.P[point]) * stiffness
    if exact.state.straight:
        theta, lam = np.zeros(mesh.links), np.zeros(1)
    else:
        theta = angles(exact, point, uncut.middles)
        lam = lam_signs(exact) * exact.lam[point] * stiffness
    return Equilibrium(mesh, scene, contacts, p, uncut, theta, lam, cuts)


def continued(start, mesh, shortening=None):
    """Carry a state of a uniform strip over to a stiffness profile.

    Parameters
    ----------
    start : Equilibrium
        Of the uniform strip.
    mesh : Mesh
        Of the other, with as many links.
    shortening : float, optional
        Prescribed in place of the thrust.

    Raises
    ------
    NoEquilibrium
        If the state comes to an end on the way.
    """
    base = float(start.mesh.stiffness[0])
    state = equilibrium(start.mesh, start.contacts, start, shortening)
    contacts = start.contacts._replace(resting=(False, False))
    t, step = 0.0, FIRST_STEP
    while t < 1:
        ahead = min(1.0, t + step)
        stage = mesh._replace(stiffness=base ** (1 - ahead) * mesh.stiffness**ahead) if ahead < 1 else mesh
        try:
            found = equilibrium(stage, contacts, _slid(state, stage), shortening)
            if not follows(state, found):
                raise NoEquilibrium("the state changes abruptly")
        except NoEquilibrium as problem:
            step /= 2
            if step < SMALLEST_STEP:
                raise NoEquilibrium(
                    f"the uniform strip's state ends at {t:.1%} of the way to this profile: {problem}"
                ) from None
            continue
        state, t, step = found, ahead, 2 * step
    return state


def _slid(state, mesh):
    """A state whose clamps rest, slid into them as far as their moments on the new mesh ask for."""
    theta, cuts = state.theta, state.cuts.copy()
    middles = state.pieces.middles
    kappa = np.gradient(theta, middles) if any(state.contacts.resting) else theta
    for rests, segment, inwards, cut in zip(state.contacts.resting, (0, -1), (1, -1), (0, -1), strict=True):
        if not rests:
            continue
        own = slice(state.pieces.first[segment], state.pieces.last[segment] + 1)
        s = middles[own]
        stiffness = mesh.stiffness[state.pieces.link[own]]
        gain = inwards * np.trapezoid(kappa[own] ** 2 * np.gradient(stiffness, s), s)
        if gain <= 0:
            raise NoEquilibrium("the strip is stiffer at a clamp than beside it, its contact stays a point")
        slide = np.sqrt(stiffness[0 if inwards > 0 else -1] * gain) / abs(state.lam[segment])
        theta = theta.copy()
        theta[own] = np.interp(s + inwards * slide, s, theta[own])
        cuts[cut] -= inwards * slide
    return state._replace(theta=theta, cuts=cuts)


def follows(before, after):
    """Whether a state is the continuation of another and not a different one."""
    theta = np.interp(after.pieces.middles, before.pieces.middles, before.theta)
    moved = np.abs(after.cuts - before.cuts).max(initial=0.0)
    return np.abs(after.theta - theta).max() <= LARGEST_CHANGE * np.abs(theta).max() and moved <= LARGEST_MOVE
