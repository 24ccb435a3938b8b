"""One state of a chain at one point: from the exact state to the values that a solution carries."""

from typing import NamedTuple

import numpy as np

from elastica.chain.equilibrium import Equilibrium, NoEquilibrium
from elastica.chain.properties import contacts_hold, properties
from elastica.chain.published import published_equilibrium
from elastica.chain.resolution import LOST, SUSPECT, lag, links_for
from elastica.chain.splitting import Pattern, split, strip_of
from elastica.chain.start import Target, continued, exact_start, follows, pattern_of
from elastica.chain.verdict import judge
from elastica.codes import Status
from elastica.ends import End, Ends
from elastica.scales import FOUR_PI_SQUARED
from elastica.solution import solve as solve_exact


class Outcome(NamedTuple):
    """What became of a point: the values of its arrays, the chain if there is one, why there is none."""

    values: dict
    chain: Equilibrium | None = None
    reason: str | None = None


class Model(NamedTuple):
    """What all points of a solution share."""

    state: object
    ends: object
    control: str
    links: int
    clamp: str
    profile: object

    @property
    def published(self):
        """Whether this is the published setting."""
        return self.clamp == "published"

    def base(self, factor=1.0):
        """The uniform strip that the exact state belongs to."""
        strip = strip_of(self.links, self.profile, self.ends)
        if self.profile.uniform:
            return strip
        mean = factor / np.mean(1 / strip.stiffness)
        return strip._replace(stiffness=np.full(self.links, mean))

    def exact(self, given, H, factor):
        """The exact state of the uniform strip."""
        stiffness = float(self.base(factor).stiffness[0])
        given = given / stiffness if self.control == "P" else given
        softer = Ends(*(End(end.k / stiffness) for end in self.ends))
        return solve_exact(self.state.name, **{self.control: given}, H=H, ends=softer)

    def outcome(self, exact, point, factor):
        """What becomes of one point of an exact solution."""
        status = Status(int(exact.status[point]))
        if status not in (Status.SOLVED, Status.INADMISSIBLE) or exact.flat_length[point] < 0:
            if self.profile.uniform:
                # A chain cannot lie on itself: a line of negative length is no equilibrium of it.
                lost = status if status in (Status.FAILED, Status.NOT_FOLLOWED) else Status.NO_EQUILIBRIUM
                return Outcome({"status": lost}, None, exact.reasons.get(point))
            return Outcome({}, None, "no uniform strip of a similar stiffness has such a state to start from")
        try:
            return self._solved(exact, point, factor)
        except NoEquilibrium as problem:
            return Outcome({}, None, str(problem))

    def _solved(self, exact, point, factor):
        """The chain at a point where the uniform strip has the state.

        Raises
        ------
        NoEquilibrium
        """
        base = self.base(factor)
        p = FOUR_PI_SQUARED * float(exact.P[point]) * float(base.stiffness[0])
        controlled = self.control == "shortening"
        shortening = float(exact.shortening[point]) if controlled else None
        target = Target(float(exact.H[point]), None if controlled else p, shortening)
        start = self._start(exact, point, base, p)
        ahead = lag(start)
        if ahead > LOST:
            raise NoEquilibrium(
                f"waves of {self.links} links run {ahead:.2g} rad ahead of those of the strip, so that an "
                f"equilibrium may be another state's or nobody's; use links = {links_for(start, SUSPECT)}"
            )
        chain = self._chain(start, target)
        if not contacts_hold(chain, self.published):
            return Outcome({"status": Status.NO_EQUILIBRIUM})
        rising = np.ones(1) if self.state.straight else self._rising(exact)
        values = properties(chain, rising, self.published, exact.periods[point])
        if values["status"] == Status.SOLVED:
            found = judge(chain, self.published, controlled and not self.state.straight)
            values |= found._asdict()
        values["error"] = self._error(values, exact, point, chain, target)
        return Outcome(values, chain)

    def _rising(self, exact):
        """Signs of λ in each segment's rising convention."""
        walls = pattern_of(self.state, self.ends).walls
        sides = np.array([*walls, walls[-1]] if walls else [1])
        return np.where(self.state.reversed_segments(exact.ends), -sides, sides)

    def _start(self, exact, point, base, p):
        """The exact state of the uniform strip; the straight strip itself."""
        if not self.state.straight:
            return exact_start(exact, point, base, self._rising(exact))
        strip = strip_of(self.links, self.profile, self.ends)
        pieces = split(strip, Pattern(()), np.zeros(0))
        flat = np.zeros(self.links)
        return Equilibrium(
            strip, Pattern(()), float(exact.H[point]), p, pieces, flat, np.zeros(1), np.zeros(0)
        )

    def _chain(self, start, target):
        """The equilibrium of the chain."""
        if self.state.straight:
            chain = start
        elif self.profile.uniform:
            chain = target.solve(start.strip, start.pattern, start)
            if not follows(start, chain):
                raise NoEquilibrium(
                    "what is nearest to the strip's state in this chain is far from it; use more links"
                )
        else:
            chain = continued(self.links, self.profile, self.ends, start, target)
        return published_equilibrium(chain, target.shortening) if self.published else chain

    def _error(self, values, exact, point, chain, target):
        """Difference from the exact state, or from a chain of half as many links."""
        if self.state.straight:
            return 0.0
        if self.profile.uniform:
            other = {
                "curvature": float(exact.curvature[point]),
                "lengths": exact.lengths[point],
                "energy": float(exact.energy[point]) * float(chain.strip.stiffness[0]),
            }
        else:
            strip = strip_of(self.links // 2, self.profile, self.ends)
            try:
                half = target.solve(strip, chain.pattern, chain)
            except NoEquilibrium:
                return np.inf
            other = properties(half, np.ones(half.lam.size), False, np.zeros(half.lam.size))
        return max(
            abs(values["curvature"] - other["curvature"]) / np.sqrt(max(chain.p, 1e-6)),
            float(np.abs(values["lengths"] - other["lengths"]).max()),
            abs(values["energy"] / other["energy"] - 1) if other["energy"] else 0.0,
        )
