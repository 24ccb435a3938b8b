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
from elastica.paths.curve import curve_through
from elastica.paths.stretch import Stretch, just_buckled, stretch_of
from elastica.paths.transitions import NEXT_TO, distance, neighbours, next_to
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

UNKNOWN = "?"
"""In the place of a state's name where it is not known, after it where the state is not followed."""


class Passage(NamedTuple):
    """What comes after the end of a stretch.

    Attributes
    ----------
    stretch : Stretch or None
        Where the strip is then; None if it cannot be told.
    jump : bool
        Whether it had to jump there.
    value : float
        The prescribed quantity at which it happens.
    reason : str
        Why it cannot be told.
    untold : str
        Name of the state if `stretch` is None: it goes on, as "UD?", but is not followed, or is lost, "?".
    """

    stretch: Stretch | None
    jump: bool
    value: float
    reason: str = ""
    untold: str = UNKNOWN


class Loading:
    """The stretches of a strip in one scene under one control, and what comes after them, each found once.

    Parameters
    ----------
    scene : Scene
        Of one point.
    control : Control
    """

    def __init__(self, scene, control):
        self.scene, self.control = scene, control
        self.stretches = []
        self._passages = {}
        self._landings = {}

    def through(self, solution, at=0):
        """The stretch that one point of a solution lies on, None where its state does not hold."""
        return self.around(curve_through(solution, self.control, at))

    def around(self, curve):
        """The stretch around the only known point of a curve, None where its state does not hold."""
        for stretch in self.stretches:
            if stretch.curve.passes(curve):
                return stretch
        stretch = stretch_of(curve)
        if stretch is not None:
            self.stretches.append(stretch)
        return stretch

    def unloaded(self):
        """The stretch of the straight strip."""
        return self.through(solve("0", P=0.0, H=self.scene.H, ends=self.scene.ends))

    def passage(self, stretch, upper):
        """What the strip does at the upper or lower end of a stretch.

        Parameters
        ----------
        stretch : Stretch
        upper : bool
            Whether the prescribed quantity rises.

        Returns
        -------
        Passage
        """
        way = id(stretch), bool(upper)
        if way not in self._passages:
            self._passages[way] = self._passage(stretch, upper)
        return self._passages[way]

    def follow(self, values):
        """The way of a strip, straight and unloaded at first, through values of the prescribed quantity.

        Parameters
        ----------
        values : sequence of float

        Returns
        -------
        stretches : list of Stretch
            On which it is at each value, as far as it is followed.
        events : list of (int, Passage, str)
            What happened on the way to each value, and to which other state the strip may have jumped.
        stopped : Passage or None
            Why it is not followed further, if it is not.
        """
        stretch = self.unloaded()
        stretches: list[Stretch] = []
        events: list[tuple[int, Passage, str]] = []
        for step, value in enumerate(values):
            while not stretch.reaches(value):
                end = stretch, value > stretch.high
                event = self.passage(*end)
                if event.stretch is None:
                    return stretches, events, event
                events.append((step, event, self.other_state(*end)))
                stretch = event.stretch
            stretches.append(stretch)
        return stretches, events, None

    def other_state(self, stretch, upper):
        """Where a chain of other links, nudged the other way, jumps to if not there as well.

        Returns
        -------
        str
            Its name, "?" if it cannot be told, "" where the chains agree or nothing jumps.
        """
        event = self.passage(stretch, upper)
        if event.stretch is None or not event.jump:
            return ""
        landings = [self._landing(stretch, upper, chain)[0] for chain in CHAINS]
        names = [landed.state.name if landed is not None else UNKNOWN for landed in landings]
        return next((name for name in names if name != event.stretch.state.name), "")

    def _passage(self, stretch, upper):
        value = stretch.high if upper else stretch.low
        onward = self._onward(stretch, upper)
        if onward is not None:
            return Passage(onward, False, value)
        if stretch.state.straight:
            (gap,) = self.scene.H
            reason = (
                f"the straight strip buckles, but at H = {gap:g} into no shape that could be told from it"
            )
            return Passage(None, False, value, reason)
        lost = stretch.end(upper)
        if stretch.cut_at(upper) and self._holds(lost, value, upper):
            (angle,) = np.degrees(lost.max_slope)
            reason = (
                f"{stretch.state.name} goes on beyond {self.control.name} = {value:.9g}, but following it "
                f"ends there, where it turns by {angle:.0f} degrees"
            )
            return Passage(None, False, value, reason, stretch.state.name + UNKNOWN)
        return self._fallen(stretch, upper)

    def _onward(self, stretch, upper):
        """The stretch that begins with the same shape where one ends and leads on, None if there is none."""
        value = stretch.high if upper else stretch.low
        for other in self._beginning(stretch, upper):
            if other is not None and other.state != stretch.state:
                # All that a control takes from the state to the next is rounded, however small the gap.
                close = 10 * NEXT_TO * max(stretch.high, other.high)
                meets = other.low <= value + close and other.high >= value - close
                below = other.low < value or other.state.straight
                if meets and (other.high > value if upper else below):
                    return other
        return None

    def _beginning(self, stretch, upper):
        """Stretches of equilibria next to a lost one that have its energy and curvature."""
        state = stretch.state
        if state.straight and not self.control.fixes_shortening:
            # At narrow gaps the loads at which a strip buckles and touches a wall are one to rounding.
            for solution, _ in self._found(("B1", "U"), np.array([stretch.high * (1 + NEXT_TO)])):
                for at in np.flatnonzero(solution.status == Status.SOLVED):
                    yield self.through(solution, at)
            return
        if state.straight:
            yield self.through(just_buckled(self.scene))
            return
        lost = stretch.end(upper)
        if len(state.word) == 1:
            buckled = self.through(just_buckled(self.scene))
            if buckled is not None and _same(buckled.end(upper=True), lost)[0]:
                yield buckled
        if state.mode or len(state.word) == 1:
            yield self.unloaded()
        loads = np.concatenate(next_to(lost.P, self.scene.H))
        for solution, _ in self._found(neighbours(state, self.scene.ends), loads):
            for at in np.flatnonzero(_same(solution, lost)):
                yield self.through(solution, at)

    def _found(self, names, loads):
        """Admissible equilibria of names at loads, and their points among these."""
        scene = self.scene.at(np.zeros(loads.size, int))
        for points, _, solution in search(names, scene, LOAD, loads, admissible=True):
            yield solution, points

    def _let_go(self, lost, value, upper, part, links, nudge):
        """Where a chain rests that is let go beyond a lost state, None if nowhere, and the control there."""
        beyond = value * (1 + part if upper else 1 - part)
        theta = lost.shape(2 * links + 1).theta[0, 1::2]
        walled = between_walls(links, self.scene.ends, float(self.scene.H[0]), **{self.control.name: beyond})
        return descend(walled, theta, nudge), beyond

    def _holds(self, lost, value, upper):
        """Whether a chain beyond the end of a stretch stays in its state."""
        links, nudge = CHAINS[0]
        rest, _ = self._let_go(lost, value, upper, BEYOND[0], links, nudge)
        return rest is not None and _unlike(rest, lost)[0] < LIKE_SHAPE

    def _fallen(self, stretch, upper):
        """The passage of a strip whose state is lost."""
        value = stretch.high if upper else stretch.low
        for chain in CHAINS:
            landed, _ = self._landing(stretch, upper, chain)
            if landed is not None:
                return Passage(landed, True, value)
        _, reason = self._landing(stretch, upper, CHAINS[0])
        lost_at = f"{stretch.state.name} is lost at {self.control.name} = {value:.9g}"
        return Passage(None, True, value, f"{lost_at}; a chain let go there {reason}")

    def _landing(self, stretch, upper, chain):
        """The stretch on which a chain lands that is let go beyond a lost state; None and why, if none."""
        way = id(stretch), bool(upper), chain
        if way not in self._landings:
            self._landings[way] = self._landed(stretch, upper, *chain)
        return self._landings[way]

    def _landed(self, stretch, upper, links, nudge):
        value, lost = stretch.high if upper else stretch.low, stretch.end(upper)
        reason = "does not come to rest"
        for part in BEYOND:
            rest, beyond = self._let_go(lost, value, upper, part, links, nudge)
            if rest is None:
                continue
            landed = self._traced_back(self._stretch_of(rest, beyond), value)
            if landed is not None and landed is not stretch:
                return landed, ""
            touches = f"touches the walls as {rest.word}" if rest.word else "touches no wall"
            reason = (
                f"{touches} at shortening {rest.shortening:.4g} and turns by up to "
                f"{np.degrees(np.abs(rest.theta).max()):.0f} degrees, which is no stable state that is known"
            )
        return None, reason

    def _traced_back(self, stretch, value):
        """The stretch that passes into this one without a jump and is there at a value, None if none is."""
        while stretch is not None and not stretch.reaches(value):
            stretch = self._onward(stretch, value > stretch.high)
        return stretch

    def _stretch_of(self, rest, beyond):
        """The stretch of the stable state that a chain at rest is, None if there is none.

        A line presses at its two ends only, so that a chain may touch a wall twice where the state does once.
        """
        nearest = LIKE_SHAPE, None
        aside = np.array([1 - NEARBY, 1 + NEARBY])
        for names, parts in product(self._names(rest.word), (np.ones(1), aside)):
            for solution, _ in self._found(names, parts * rest.P):
                like = _unlike(rest, solution) < 2 * LIKE_SHAPE
                for at in np.flatnonzero(like & (solution.status == Status.SOLVED)):
                    stretch = self.through(solution, at)
                    if stretch is None or not stretch.reaches(beyond):
                        continue
                    exact = stretch.at(np.array([beyond]))
                    away = _unlike(rest, exact)[0]
                    energy = abs(rest.bending_energy / exact.bending_energy[0] - 1)
                    if away < nearest[0] and energy < LIKE_ENERGY:
                        nearest = away, stretch
            if nearest[1] is not None:
                break
        return nearest[1]

    def _names(self, touched):
        """Names that a chain which touches the walls like this may have: first those with all its contacts or
        with lines for repeated ones, then those that touch a wall once more or less."""
        if len(touched) > MOST_ENUMERATED:
            return
        words = {_merged(touched, kept) for kept in _choices(touched)}
        words = {parse_state(word, self.scene.ends).word for word in words if word}
        plain = [
            a + word + b + line
            for word in sorted(words)
            for a, b, line in product(("", "a"), ("", "a"), ("", "-"))
        ]
        free = ["0", *(f"B{mode}" for mode in range(1, len(touched) + 3))]
        names = [
            name for name in (*plain, *(free if not words else ())) if is_canonical(name, self.scene.ends)
        ]
        yield names
        others = [
            name
            for word in sorted(words) or ["B1"]
            for name in neighbours(parse_state(word, self.scene.ends), self.scene.ends)
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
    apart = distance(solution, lost.energy, lost.curvature, lost.P * lost.shortening)
    return np.isfinite(apart) & (solution.status == Status.SOLVED)


def _unlike(rest, solution):
    """Relative difference of the angles of a chain and of equilibria, their nearest mirror images, (n,)."""
    theta = solution.shape(2 * rest.theta.size + 1).theta[:, 1::2]
    images = [theta, -theta, theta[:, ::-1], -theta[:, ::-1]] if solution.ends.alike else [theta, -theta]
    away = [np.sqrt(np.mean((image - rest.theta) ** 2, axis=1)) for image in images]
    return np.min(away, axis=0) / np.sqrt(np.mean(rest.theta**2))
