"""A strip that is loaded slowly: it stays in its stable state until that is lost, then goes where it falls.

A state ends where it folds, buckles, lets go of a wall or touches one. Either another stable state begins
there with the same shape, and the strip passes into it, or none does: then a chain is let go (`descent`) a
little beyond, and the equilibrium at which it comes to rest, or the one into which that passes on the way
back to where the state was lost, is where the strip goes.
"""

from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from elastica.chain.descent import between_walls, descend
from elastica.codes import Status
from elastica.control import LOAD
from elastica.finding import search
from elastica.paths.arcs import Arc, arc_through, just_buckled
from elastica.paths.transitions import NEXT_TO, neighbours
from elastica.scene import Scene
from elastica.solving import solve
from elastica.state import MOST_ENUMERATED, is_canonical, parse_state

CHAINS = ((100, 0.02), (120, -0.02))
"""Links and nudge of the chains that are let go: where they part, so may strips."""
BEYOND = (1e-2, 3e-2, 3e-3)
"""How far beyond its end, relative, a lost state is let go: farther if a coarse chain still holds there, less
far if where it lands does not reach back to the end."""
LIKE_SHAPE, LIKE_ENERGY = 0.2, 0.05
"""Relative difference of angles and of bending energy within which a chain is an equilibrium."""
NEARBY = 0.02
"""Part of its load by which a chain may be off."""
SAME_ENERGY, SAME_CURVATURE = 1e-4, 1e-2
"""Differences that one shape may have `NEXT_TO` where it is lost, in units of the load's work and of the root
mean square of its curvature: they hold at gaps however narrow."""


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
    lost : bool
        Whether the state is lost; if not, it goes on, but is not followed.
    """

    arc: Arc | None
    jump: bool
    given: float
    reason: str = ""
    lost: bool = True


class Loading:
    """The arcs of a strip at one gap under one control, and what comes after them, each found once.

    Parameters
    ----------
    ends : Ends
    H : float
    control : str
        "P" or "shortening".
    """

    def __init__(self, ends, H, control):
        self.ends, self.H, self.control = ends, H, control
        self.arcs = []
        self._passages = {}
        self._landings = {}

    def through(self, solution, at=0):
        """The arc that one point of a solution lies on, None where its state does not hold."""
        for arc in self.arcs:
            if arc.passes(solution, at):
                return arc
        arc = arc_through(solution, self.control, at)
        if arc is not None:
            self.arcs.append(arc)
        return arc

    def unloaded(self):
        """The arc of the straight strip."""
        return self.through(solve("0", P=0.0, H=self.H, ends=self.ends))

    def passage(self, arc, upper):
        """What the strip does at the upper or lower end of an arc.

        Parameters
        ----------
        arc : Arc
        upper : bool
            Whether the prescribed quantity rises.

        Returns
        -------
        Passage
        """
        way = id(arc), bool(upper)
        if way not in self._passages:
            self._passages[way] = self._passage(arc, upper)
        return self._passages[way]

    def other_state(self, arc, upper):
        """Where a chain of other links, nudged the other way, jumps to if not there as well.

        Returns
        -------
        str
            Its name, "?" if it cannot be told, "" where the chains agree or nothing jumps.
        """
        event = self.passage(arc, upper)
        if event.arc is None or not event.jump:
            return ""
        landings = [self._landing(arc, upper, chain)[0] for chain in CHAINS]
        names = [landed.state.name if landed is not None else "?" for landed in landings]
        return next((name for name in names if name != event.arc.state.name), "")

    def _passage(self, arc, upper):
        given = arc.high if upper else arc.low
        onward = self._onward(arc, upper)
        if onward is not None:
            return Passage(onward, False, given)
        if arc.state.straight:
            reason = (
                f"the straight strip buckles, but at H = {self.H:g} into no shape that could be told from it"
            )
            return Passage(None, False, given, reason)
        lost = arc.end(upper)
        if arc.cut_at(upper) and self._holds(lost, given, upper):
            reason = (
                f"{arc.state.name} goes on beyond {self.control} = {given:.9g}, but following it ends there, "
                f"where it turns by {np.degrees(float(lost.max_slope[0])):.0f} degrees"
            )
            return Passage(None, False, given, reason, lost=False)
        return self._fallen(arc, upper)

    def _onward(self, arc, upper):
        """The arc that begins with the same shape where one ends and leads on, None if there is none."""
        given = arc.high if upper else arc.low
        for other in self._beginning(arc, upper):
            if other is not None and other.state != arc.state:
                # All that a control takes from the state to the next is rounded, however small the gap.
                close = 10 * NEXT_TO * max(arc.high, other.high)
                meets = other.low <= given + close and other.high >= given - close
                below = other.low < given or other.state.straight
                if meets and (other.high > given if upper else below):
                    return other
        return None

    def _beginning(self, arc, upper):
        """Arcs of equilibria next to a lost one that have its energy and curvature."""
        state = arc.state
        if state.straight and self.control == "P":
            # At narrow gaps the loads at which a strip buckles and touches a wall are one to rounding.
            for solution, _ in self._found(("B1", "U"), np.array([arc.high * (1 + NEXT_TO)])):
                for at in np.flatnonzero(solution.status == Status.SOLVED):
                    yield self.through(solution, at)
            return
        if state.straight:
            yield self.through(just_buckled(self.ends, self.H))
            return
        lost = arc.end(upper)
        if len(state.word) == 1:
            buckled = self.through(just_buckled(self.ends, self.H))
            if buckled is not None and _same(buckled.end(upper=True), lost)[0]:
                yield buckled
        if state.mode or len(state.word) == 1:
            yield self.unloaded()
        loads = np.array([1 - NEXT_TO, 1 + NEXT_TO]) * lost.P[0]
        for solution, _ in self._found(neighbours(state, self.ends), loads):
            for at in np.flatnonzero(_same(solution, lost)):
                yield self.through(solution, at)

    def _found(self, names, loads):
        """Admissible equilibria of names at loads, and their points among these."""
        scene = Scene(self.ends, np.full(loads.size, self.H))
        for points, _, solution in search(names, scene, LOAD, loads, admissible=True):
            yield solution, points

    def _let_go(self, lost, given, upper, part, links, nudge):
        """Where a chain rests that is let go beyond a lost state, None if nowhere, and the control there."""
        beyond = given * (1 + part if upper else 1 - part)
        theta = lost.shape(2 * links + 1).theta[0, 1::2]
        walled = between_walls(links, self.ends, self.H, **{self.control: beyond})
        return descend(walled, theta, nudge), beyond

    def _holds(self, lost, given, upper):
        """Whether a chain beyond the end of an arc stays in its state."""
        links, nudge = CHAINS[0]
        rest, _ = self._let_go(lost, given, upper, BEYOND[0], links, nudge)
        return rest is not None and _unlike(rest, lost)[0] < LIKE_SHAPE

    def _fallen(self, arc, upper):
        """The passage of a strip whose state is lost."""
        given = arc.high if upper else arc.low
        for chain in CHAINS:
            landed, _ = self._landing(arc, upper, chain)
            if landed is not None:
                return Passage(landed, True, given)
        _, reason = self._landing(arc, upper, CHAINS[0])
        lost_at = f"{arc.state.name} is lost at {self.control} = {given:.9g}"
        return Passage(None, True, given, f"{lost_at}; a chain let go there {reason}")

    def _landing(self, arc, upper, chain):
        """The arc on which a chain lands that is let go beyond a lost state; None and why, if none."""
        way = id(arc), bool(upper), chain
        if way not in self._landings:
            self._landings[way] = self._landed(arc, upper, *chain)
        return self._landings[way]

    def _landed(self, arc, upper, links, nudge):
        given, lost = arc.high if upper else arc.low, arc.end(upper)
        reason = "does not come to rest"
        for part in BEYOND:
            rest, beyond = self._let_go(lost, given, upper, part, links, nudge)
            if rest is None:
                continue
            landed = self._traced_back(self._arc_of(rest, beyond), given)
            if landed is not None and landed is not arc:
                return landed, ""
            touches = f"touches the walls as {rest.word}" if rest.word else "touches no wall"
            reason = (
                f"{touches} at shortening {rest.shortening:.4g} and turns by up to "
                f"{np.degrees(np.abs(rest.theta).max()):.0f} degrees, which is no stable state that is known"
            )
        return None, reason

    def _traced_back(self, arc, given):
        """The arc that passes into this one without a jump and is there at a value; None if there is none."""
        while arc is not None and not arc.reaches(given):
            arc = self._onward(arc, given > arc.high)
        return arc

    def _arc_of(self, rest, beyond):
        """The arc of the stable state that a chain at rest is, None if there is none.

        A line presses at its two ends only, so that a chain may touch a wall twice where the state does once.
        """
        nearest = LIKE_SHAPE, None
        aside = np.array([1 - NEARBY, 1 + NEARBY])
        for names, parts in product(self._names(rest.word), (np.ones(1), aside)):
            for solution, _ in self._found(names, parts * rest.P):
                like = _unlike(rest, solution) < 2 * LIKE_SHAPE
                for at in np.flatnonzero(like & (solution.status == Status.SOLVED)):
                    arc = self.through(solution, at)
                    if arc is None or not arc.reaches(beyond):
                        continue
                    exact = arc.at(np.array([beyond]))
                    away = _unlike(rest, exact)[0]
                    energy = abs(rest.bending_energy / exact.bending_energy[0] - 1)
                    if away < nearest[0] and energy < LIKE_ENERGY:
                        nearest = away, arc
            if nearest[1] is not None:
                break
        return nearest[1]

    def _names(self, touched):
        """Names that a chain which touches the walls like this may have: first those with all its contacts or
        with lines for repeated ones, then those that touch a wall once more or less."""
        if len(touched) > MOST_ENUMERATED:
            return
        words = {_merged(touched, kept) for kept in _choices(touched)}
        words = {parse_state(word, self.ends).word for word in words if word}
        plain = [
            a + word + b + line
            for word in sorted(words)
            for a, b, line in product(("", "a"), ("", "a"), ("", "-"))
        ]
        free = ["0", *(f"B{mode}" for mode in range(1, len(touched) + 3))]
        names = [name for name in (*plain, *(free if not words else ())) if is_canonical(name, self.ends)]
        yield names
        others = [
            name
            for word in sorted(words) or ["B1"]
            for name in neighbours(parse_state(word, self.ends), self.ends)
        ]
        yield [name for name in dict.fromkeys(others) if name not in names]


def _choices(touched):
    """Which of the letters that repeat the one before are kept: every choice."""
    again = [i for i in range(1, len(touched)) if touched[i] == touched[i - 1]]
    return [set(kept) for size in range(len(again) + 1) for kept in combinations(again, size)]


def _merged(touched, kept):
    """A word without its repetitions but those kept."""
    return "".join(
        letter for i, letter in enumerate(touched) if not i or letter != touched[i - 1] or i in kept
    )


def _same(solution, lost):
    """Which equilibria have the shape of a lost one, (n,)."""
    curved = 2 * np.pi * np.sqrt(2 * lost.bending_energy)
    off = np.abs(solution.energy - lost.energy) <= SAME_ENERGY * lost.P * lost.shortening
    turned = np.abs(solution.curvature - lost.curvature) <= SAME_CURVATURE * curved
    return off & turned & (solution.status == Status.SOLVED)


def _unlike(rest, solution):
    """Relative difference of the angles of a chain and of equilibria, their nearest mirror images, (n,)."""
    theta = solution.shape(2 * rest.theta.size + 1).theta[:, 1::2]
    images = [theta, -theta, theta[:, ::-1], -theta[:, ::-1]] if solution.ends.alike else [theta, -theta]
    away = [np.sqrt(np.mean((image - rest.theta) ** 2, axis=1)) for image in images]
    return np.min(away, axis=0) / np.sqrt(np.mean(rest.theta**2))
