"""One state of a chain at one point: from the exact state to the values that a solution carries.

Not here: Newton's method (`equilibrium`), points and arrays (`solution`).
"""

from typing import NamedTuple

import numpy as np

from elastica.chain import consistent
from elastica.chain.equilibrium import Equilibrium, NoEquilibrium, equilibrium
from elastica.chain.properties import contacts_hold, properties
from elastica.chain.resolution import LOST, SUSPECT, lag, links_for
from elastica.chain.settings import Setting
from elastica.chain.splitting import Mesh, mesh_of, split
from elastica.chain.start import continued, exact_start, follows, lam_signs
from elastica.chain.verdict import judge
from elastica.codes import Status
from elastica.control import LOAD, Control
from elastica.ends import End, Ends
from elastica.exact import solve as solve_exact
from elastica.state import State


class Outcome(NamedTuple):
    """What became of a point: the values of its arrays, the chain if there is one, why there is none."""

    values: dict
    chain: Equilibrium | None = None
    reason: str | None = None


class Model(NamedTuple):
    """What all points of a solution share."""

    state: State
    control: Control
    setting: Setting
    mesh: Mesh

    def base(self, factor):
        """The mesh of the uniform strip that the exact state belongs to.

        Its stiffness is that of the same mean compliance times `factor`.
        """
        if self.mesh.profile.uniform:
            return self.mesh
        mean = factor / np.mean(1 / self.mesh.stiffness)
        return self.mesh._replace(stiffness=np.full(self.mesh.links, mean))

    def exact(self, scene, prescribed, factor):
        """The exact state of that strip at n points."""
        stiffness = float(self.base(factor).stiffness[0])
        prescribed = prescribed / stiffness if self.control == LOAD else prescribed
        softer = Ends(*(End(end.k / stiffness) for end in scene.ends))
        return solve_exact(self.state, scene._replace(ends=softer), self.control, prescribed)

    def outcome(self, scene, exact, point, factor):
        """What becomes of one of these points."""
        status = Status(int(exact.status[point]))
        if status not in (Status.SOLVED, Status.INADMISSIBLE) or exact.flat_length[point] < 0:
            if self.mesh.profile.uniform:
                # A chain cannot lie on itself: a line of negative length is no equilibrium of it.
                lost = status if status in (Status.FAILED, Status.NOT_FOLLOWED) else Status.NO_EQUILIBRIUM
                return Outcome({"status": lost}, None, exact.reasons.get(point))
            return Outcome({}, None, "no uniform strip of a similar stiffness has such a state to start from")
        try:
            return self._solved(scene.at(point), exact, point, factor)
        except NoEquilibrium as problem:
            return Outcome({}, None, str(problem))

    def _solved(self, scene, exact, point, factor):
        """The chain at a point, and in its scene, where the uniform strip has the state.

        Raises
        ------
        NoEquilibrium
        """
        shortening = float(exact.shortening[point]) if self.control.fixes_shortening else None
        start = exact_start(exact, point, self.base(factor), scene)
        if self.state.straight:
            # It is straight whatever its stiffness.
            start = start._replace(mesh=self.mesh, pieces=split(self.mesh, scene.ends))
        ahead = lag(start)
        if ahead > LOST:
            raise NoEquilibrium(
                f"waves of {self.mesh.links} links run {ahead:.2g} rad ahead of those of the strip, so that "
                f"an equilibrium may be another state's or nobody's; use links = {links_for(start, SUSPECT)}"
            )
        cut = self._chain(start, shortening)
        chain = self.setting.settled(cut, shortening)
        if not contacts_hold(chain, self.setting):
            return Outcome({"status": Status.NO_EQUILIBRIUM})
        values = properties(chain, lam_signs(exact), self.setting, exact.periods[point])
        if values["status"] == Status.SOLVED:
            values |= judge(chain, self.setting, self.control)._asdict()
        values["error"] = self._error(values, exact, point, cut, shortening)
        return Outcome(values, chain)

    def _chain(self, start, shortening):
        """The chain with cut links that is near a start."""
        if self.state.straight:
            return start
        if not self.mesh.profile.uniform:
            return continued(start, self.mesh, shortening)
        chain = equilibrium(start.mesh, start.contacts, start, shortening)
        if not follows(start, chain):
            raise NoEquilibrium(
                "what is nearest to the strip's state in this chain is far from it; use more links"
            )
        return chain

    def _error(self, values, exact, point, chain, shortening):
        """Difference from the exact state, or from a chain of half as many links."""
        if self.state.straight:
            return 0.0
        if self.mesh.profile.uniform:
            other = {
                "curvature": float(exact.curvature[point]),
                "lengths": exact.lengths[point],
                "energy": float(exact.energy[point]) * float(chain.mesh.stiffness[0]),
            }
        else:
            mesh = mesh_of(self.mesh.links // 2, self.mesh.profile)
            try:
                half = equilibrium(mesh, chain.contacts, chain, shortening)
            except NoEquilibrium:
                return np.inf
            other = properties(half, lam_signs(exact), consistent, exact.periods[point])
        return max(
            abs(values["curvature"] - other["curvature"]) / np.sqrt(max(chain.p, 1e-6)),
            float(np.abs(values["lengths"] - other["lengths"]).max()),
            abs(values["energy"] / other["energy"] - 1) if other["energy"] else 0.0,
        )
