"""Where Newton's method starts: the exact state of a uniform strip, then the stiffness profile in steps.

A strip with the profile EI(s) is reached through EI₀^(1−t) EI(s)^t, t from 0 to 1, EI₀ the stiffness with
the same mean compliance. A uniform strip of stiffness EI₀ under the thrust p is the exact one under p/EI₀.

A line next to a clamp is a singular place to start from. In a strip that is not uniform

    ½ M²/EI − p cos θ − λ sin θ     changes along the strip by     −½ ∫ κ² EI' ds,

so with θ = M = 0 where the line begins the clamp carries M₀² = EI ∫ κ² EI' ds from clamp to line. Where
that is negative (strips that are stiffer near the clamp) there is no such state: the contact stays a point.
Otherwise M₀ grows like √t, as if the shape had slid into the clamp by M₀/λ, and that is where the first
step starts.
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.equilibrium import Equilibrium, NoEquilibrium, equilibrium
from elastica.chain.splitting import Pattern, split, strip_of
from elastica.scales import FOUR_PI_SQUARED
from elastica.shapes import WALL, angles

SMALLEST_STEP = 1 / 512
FIRST_STEP = 1 / 4
LARGEST_CHANGE = 0.5
"""Part of the largest angle by which angles may change in one step of the continuation."""
LARGEST_MOVE = 0.1
"""Arc length by which a contact may move."""


def pattern_of(state, ends, uniform=True):
    """What a state touches."""
    resting = tuple(state.line and uniform and end.clamped for end in ends)
    return Pattern(tuple(WALL[letter] for letter in state.word), state.line, resting)


def exact_start(exact, point, strip, rising):
    """An exact state in the unknowns of a chain.

    Parameters
    ----------
    exact : Solution
        Not the straight strip.
    point : int
        A point of a flat solution where the state exists.
    strip : Strip
        Uniform.
    rising : ndarray, shape (segments,)
        1 or −1: sign of λ in the rising convention of each segment.

    Returns
    -------
    Equilibrium
        Its angles belong to the uncut links; Newton's method interpolates them.
    """
    stiffness = float(strip.stiffness[0])
    pattern = pattern_of(exact.state, strip.ends)
    cuts = position = exact.contact_position[point]
    if pattern.line:
        flat = exact.flat_length[point] / position.size
        cuts = np.column_stack([position, position + flat]).ravel()
    uncut = split(strip, Pattern(()), np.zeros(0))
    theta = angles(exact, point, uncut.middles)
    p = FOUR_PI_SQUARED * float(exact.P[point]) * stiffness
    lam = rising * exact.lam[point] * stiffness
    return Equilibrium(strip, pattern, float(exact.H[point]), p, uncut, theta, lam, cuts)


class Target(NamedTuple):
    """What is prescribed at a point: the half gap and either the thrust or the shortening."""

    H: float
    p: float | None
    shortening: float | None

    def solve(self, strip, pattern, start):
        """The equilibrium near a start."""
        return equilibrium(strip, pattern, self.H, start, self.p, self.shortening)


def continued(links, profile, ends, start, target):
    """Carry a state of a uniform strip over to a stiffness profile.

    Parameters
    ----------
    links : int
    profile : Profile
    ends : Ends
    start : Equilibrium
        Of the uniform strip.
    target : Target

    Returns
    -------
    Equilibrium

    Raises
    ------
    NoEquilibrium
        If the state comes to an end on the way.
    """
    whole = strip_of(links, profile, ends)
    base = float(start.strip.stiffness[0])
    state = target.solve(start.strip, start.pattern, start)
    pattern = start.pattern._replace(resting=(False, False))
    t, step = 0.0, FIRST_STEP
    while t < 1:
        ahead = min(1.0, t + step)
        stiffness = base ** (1 - ahead) * whole.stiffness**ahead
        strip = whole if ahead == 1 else whole._replace(stiffness=stiffness)
        try:
            found = target.solve(strip, pattern, _slid(state, strip))
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


def _slid(state, strip):
    """A state whose clamps rest, slid into them as far as their moments on the new strip ask for."""
    theta, cuts = state.theta, state.cuts.copy()
    middles = state.pieces.middles
    kappa = np.gradient(theta, middles) if any(state.pattern.resting) else theta
    for rests, segment, inwards, cut in zip(state.pattern.resting, (0, -1), (1, -1), (0, -1), strict=True):
        if not rests:
            continue
        own = slice(state.pieces.first[segment], state.pieces.last[segment] + 1)
        s = middles[own]
        stiffness = strip.stiffness[state.pieces.link[own]]
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
