"""Equilibria of a state at a prescribed shortening: the load is an unknown.

Point states are found along their branches (`tracing`), which are functions of κ/√p whatever is controlled;
line states along the load at κ = 0. Extra full periods are searched up to three in all.
"""

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.equilibria.buckled import buckled_at_shortening
from elastica.equilibria.line import line_roots, line_shapes
from elastica.equilibria.periods import groups
from elastica.equilibria.roots import no_equilibria, numbered, of_root, spread
from elastica.equilibria.tracing import Loads, at_shortening

MOST_PERIODS = 3
LONGEST_PERIOD = 7.6
"""√p times the longest period below 90°, a little more than 4K(½)."""


class PrescribedShortening:
    """Prescribed shortenings at n points, and what the searches for different words share.

    Parameters
    ----------
    shortening : ndarray, shape (n,)
        At least 0.
    scene : Scene
        Of the n points.
    contacts : int
        Of the longest word that will be asked for.
    """

    def __init__(self, shortening, scene, contacts):
        self.shortening = shortening
        self.scene, self.gap = scene.distinct()
        self.loads = Loads(self.scene, LONGEST_PERIOD * (contacts + 1 + MOST_PERIODS))

    def root(self, state):
        """The root that a state's name has; see `roots.of_root`."""
        return of_root(state, *self.every(state))

    def every(self, state):
        """Every root of a state, by increasing κ.

        Parameters
        ----------
        state : State
            Not the straight strip; its own root number is not looked at.

        Returns
        -------
        found : Equilibria
            `point` counts the points given.
        beyond : ndarray of bool, shape (n,)
            Where there may be more beyond what is traced: at shortenings greater than any there.
        """
        ends = self.scene.ends
        if not self.gap.size:
            return no_equilibria(len(state.word) + 1), np.zeros(0, bool)
        if state.mode:
            return self._free(state)
        found, most = [no_equilibria(len(state.word) + 1)], np.zeros(self.scene.size)
        for periods in range(MOST_PERIODS + 1):
            for group in groups(state, ends, periods):
                if state.line:
                    which, p, roots = self._line(group.segments, most)
                else:
                    which, p, roots = self._point(group.segments, most)
                found.append(spread(state.segments(ends), group, which, roots, p))
        return numbered(found), self.shortening > most[self.gap]

    def _point(self, segments, most):
        """Point regime: a point of the branches for each crossing.

        Also raises `most` to the greatest shortening that is traced at each gap.
        """
        branch = self.loads.trace(segments)
        np.maximum.at(most, branch.gap, branch.shorter)
        which, points = at_shortening(segments, branch, self.scene, self.shortening, self.gap)
        return which, points.p, points.roots

    def _line(self, segments, most):
        """Line regime, where the strip is long enough for its segments: a load for each crossing.

        Also raises `most`, as `_point` does.
        """
        gaps = self.scene.size
        begin, end, _ = self.loads.line_range(segments)
        # Nodes outside the range lie at its ends; between them there is nothing.
        nodes = np.clip(self.loads.table.p.reshape(-1, gaps), begin, end)
        nodes = np.concatenate([begin[None], nodes, end[None]])
        each = self.scene.at(np.tile(np.arange(gaps), len(nodes)))
        shorter = line_shapes(segments, nodes.ravel(), each)[0].reshape(nodes.shape)
        np.fmax(most, np.fmax.reduce(shorter, axis=0), out=most)
        missing = shorter[:, self.gap] - self.shortening
        node, which = np.nonzero(missing[:-1] * missing[1:] < 0)
        low, high = (nodes[side, self.gap[which]] for side in (node, node + 1))
        scene, target = self.scene.at(self.gap[which]), self.shortening[which]

        def excess(p, at):
            return line_shapes(segments, p, scene.at(at))[0] - target[at]

        p = find_root(excess, (low, high), args=(np.arange(which.size),)).x
        roots = line_roots(segments, p, scene)
        good = roots.found
        return which[good], p[good], roots.at(good)

    def _free(self, state):
        """Free buckling, which does not depend on the gap."""
        which, p, roots, beyond = buckled_at_shortening(state, self.shortening, self.scene.at(self.gap))
        (group,) = groups(state, self.scene.ends, 0)
        return spread(state.segments(self.scene.ends), group, which, roots, p, number=1), beyond
