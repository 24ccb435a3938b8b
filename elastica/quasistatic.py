"""A strip that is loaded slowly: it stays in its stable state until that is lost, then goes where it falls.

A state ends where it folds, buckles, lets go of a wall or touches one. Either another stable state begins
there with the same shape, and the strip passes into it, or none does: then a chain is let go (`descent`) a
little beyond, and where it comes to rest is looked up in the catalogue of all equilibria (`catalogue`).
"""

from typing import NamedTuple

import numpy as np

from elastica.arcs import Arc, arc_through
from elastica.catalogue import find_states
from elastica.chain.descent import between_walls, descend
from elastica.solution import solve
from elastica.states import MOST_ENUMERATED, parse_state
from elastica.transitions import NEXT_TO, distance

CHAINS = ((100, 0.02), (120, -0.02))
"""Links and nudge of the chains that are let go: where they part, so may strips."""
BEYOND = (1e-2, 3e-2)
"""How far beyond its end, relative, a lost state is let go: farther if a coarse chain still holds there."""
LIKE_SHAPE, LIKE_ENERGY = 0.2, 0.05
"""Relative difference of angles and of bending energy within which a chain is a state of the catalogue."""


def unloaded(ends, H, control):
    """The arc of the straight strip."""
    return arc_through(solve("0", H=H, ends=ends, **{control: 0.0}), control)


class Passage(NamedTuple):
    """What comes after the end of an arc.

    Attributes
    ----------
    arc : Arc or None
        Where the strip is then; None if it cannot be told.
    jump : bool
        Whether it had to jump there.
    given : float
        The prescribed quantity at which it happens.
    reason : str
        Why it cannot be told.
    other : str
        Where a chain of other links, nudged the other way, jumps to if not there; "?" if that cannot be told.
    """

    arc: Arc | None
    jump: bool
    given: float
    reason: str = ""
    other: str = ""


def passage(arc, upper):
    """What a strip does at the upper or lower end of an arc.

    Parameters
    ----------
    arc : Arc
    upper : bool
        Whether the prescribed quantity rises.

    Returns
    -------
    Passage
    """
    lost = arc.end(upper)
    given = arc.high if upper else arc.low
    for name, P in _beginning(lost):
        other = arc_through(solve(name, P=P, H=arc.H, ends=arc.ends), arc.control)
        if other is not None and other.state != arc.state and _leads_on(other, given, upper):
            return Passage(other, False, given)
    return _fallen(arc, lost, given, upper)


def _leads_on(arc, given, upper):
    """Whether an arc begins at a value of the prescribed quantity, to rounding, and goes beyond."""
    close = 10 * NEXT_TO * max(abs(given), NEXT_TO)
    return (
        arc.low <= given + close
        and arc.high >= given - close
        and (arc.high > given if upper else arc.low < given)
    )


def _beginning(lost):
    """Names and loads of equilibria next to a lost one that have its energy and curvature."""
    P, H, ends = (float(lost.P[0]), float(lost.H[0]), lost.ends)
    contacts = min(len(lost.state.word) + 1, MOST_ENUMERATED)
    found = find_states(P=np.array([1 - NEXT_TO, 1 + NEXT_TO]) * P, H=H, ends=ends, max_contacts=contacts)
    same = np.flatnonzero(np.isfinite(distance(found, lost.energy, lost.curvature)))
    return [(str(found.state[i]), float(found.P[i])) for i in same]


def _fallen(arc, lost, given, upper):
    """The passage of a strip whose state is lost."""
    landings = [_landing(arc, lost, given, upper, *chain) for chain in CHAINS]
    landed = [landing for landing, _ in landings if landing is not None]
    if not landed:
        reason = (
            f"{arc.state.name} is lost at {arc.control} = {given:.9g}; a chain let go there {landings[0][1]}"
        )
        return Passage(None, True, given, reason)
    names = [landing.state.name if landing is not None else "?" for landing, _ in landings]
    other = "" if names[0] == names[1] else names[1 - names.index(landed[0].state.name)]
    return Passage(landed[0], True, given, other=other)


def _landing(arc, lost, given, upper, links, nudge):
    """The arc on which a chain lands that is let go beyond a lost state; None and why, if there is none."""
    theta = lost.shape(2 * links + 1).theta[0, 1::2]
    reason = "does not come to rest"
    for part in BEYOND:
        beyond = given * (1 + part if upper else 1 - part)
        rest = descend(between_walls(links, arc.ends, arc.H, **{arc.control: beyond}), theta, nudge)
        if rest is None:
            continue
        landed = _arc_of(rest, arc, given, beyond)
        if landed is not None:
            return landed, ""
        touches = f"touches the walls as {rest.word}" if rest.word else "touches no wall"
        reason = (
            f"{touches} at shortening {rest.shortening:.4g} and turns by up to "
            f"{np.degrees(np.abs(rest.theta).max()):.0f} degrees, which is no stable state that is known"
        )
    return None, reason


def _arc_of(rest, arc, given, beyond):
    """The arc from `given` to `beyond` of the state that a chain at rest is, None if there is none."""
    if len(rest.word) > MOST_ENUMERATED:
        return None
    word = parse_state(rest.word, arc.ends).word if rest.word else ""
    found = find_states(P=rest.P, H=arc.H, ends=arc.ends, max_contacts=len(rest.word))
    nearest = LIKE_SHAPE, None
    for name in found.state.tolist():
        if parse_state(name, arc.ends).word != word:
            continue
        other = arc_through(solve(name, P=rest.P, H=arc.H, ends=arc.ends), arc.control)
        if other is None or min(given, beyond) < other.low or max(given, beyond) > other.high:
            continue
        exact = other.at(np.array([beyond]))
        theta = exact.shape(2 * rest.theta.size + 1).theta[0, 1::2]
        images = [theta, -theta, theta[::-1], -theta[::-1]] if arc.ends.alike else [theta, -theta]
        away = min(np.sqrt(np.mean((image - rest.theta) ** 2) / np.mean(theta**2)) for image in images)
        if away < nearest[0] and abs(rest.bending_energy / exact.bending_energy[0] - 1) < LIKE_ENERGY:
            nearest = away, other
    return nearest[1]
