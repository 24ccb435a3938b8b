"""Where Newton's method starts: the exact state of a uniform strip, then the stiffness profile in steps.

A strip with the profile EI(s) is reached through EI₀^(1−t) EI(s)^t, t from 0 to 1, EI₀ the stiffness with
the same mean compliance. A uniform strip of stiffness EI₀ under the thrust p is the exact one under p/EI₀.
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.equilibrium import Equilibrium, NoEquilibrium, equilibrium
from elastica.chain.splitting import Pattern, split, strip_of
from elastica.codes import Status
from elastica.scales import FOUR_PI_SQUARED
from elastica.shapes import WALL

SMALLEST_STEP = 1 / 512
FIRST_STEP = 1 / 4


def pattern_of(state, ends, uniform=True):
    """What a state touches."""
    resting = tuple(state.line and uniform and end.clamped for end in ends)
    return Pattern(tuple(WALL[letter] for letter in state.word), state.line, resting)


def exact_start(exact, point, strip, theta, rising):
    """An exact state in the unknowns of a chain.

    Parameters
    ----------
    exact : Solution
        Not the straight strip.
    point : int
        Flat index of a point where the state exists.
    strip : Strip
        Uniform.
    theta : ndarray, shape (links,)
        Exact angles at the middles of the links.
    rising : ndarray, shape (segments,)
        1 or −1: sign of λ in the rising convention of each segment.

    Returns
    -------
    Equilibrium
        Its angles belong to the uncut links; Newton's method interpolates them.
    """
    stiffness = float(strip.stiffness[0])
    pattern = pattern_of(exact.state, strip.ends)
    contacts = len(pattern.walls)
    position = exact.contact_position.reshape(exact.status.size, contacts)[point]
    lam = exact.lam.reshape(exact.status.size, -1)[point] * stiffness
    cuts = position
    if pattern.line:
        flat = exact.flat_length.ravel()[point] / contacts
        cuts = np.column_stack([position, position + flat]).ravel()
    uncut = split(strip, Pattern(()), np.zeros(0))
    p = FOUR_PI_SQUARED * exact.P.ravel()[point] * stiffness
    H = float(exact.H.ravel()[point])
    return Equilibrium(strip, pattern, H, p, uncut, theta, rising * lam, cuts)


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
    t, step = 0.0, FIRST_STEP
    while t < 1:
        ahead = min(1.0, t + step)
        stiffness = base ** (1 - ahead) * whole.stiffness**ahead
        strip = whole if ahead == 1 else whole._replace(stiffness=stiffness)
        try:
            found = target.solve(strip, start.pattern, state)
            if not _follows(state, found, ahead - t):
                raise NoEquilibrium("the state changes abruptly")
        except NoEquilibrium as problem:
            step /= 2
            if step < SMALLEST_STEP:
                raise NoEquilibrium(
                    f"the state of the uniform strip ends at {t:.1%} of the way to this stiffness profile: {problem}"
                ) from None
            continue
        state, t, step = found, ahead, 2 * step
    return state


LARGEST_CHANGE = 0.5
"""Part of the largest angle by which angles may change in one step of the continuation."""


def _follows(before, after, step):
    """Whether a state is the continuation of another and not a different one."""
    theta = np.interp(after.pieces.middles, before.pieces.middles, before.theta)
    change = np.abs(after.theta - theta).max()
    shift = np.abs(after.cuts - before.cuts).max(initial=0.0)
    size = np.abs(before.theta).max()
    return change <= LARGEST_CHANGE * size and shift <= 0.1


def mean_stiffness(links, profile, ends):
    """The uniform strip of the same mean compliance."""
    strip = strip_of(links, profile, ends)
    return strip._replace(stiffness=np.full(links, 1 / np.mean(1 / strip.stiffness)))


def exists(exact, point):
    """Whether an exact solution has its state at a point, admissible or not."""
    return exact.status.ravel()[point] in (Status.SOLVED, Status.INADMISSIBLE)
