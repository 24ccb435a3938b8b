"""Every root of a state: follow its rises in κ and watch the total length cross that of the strip.

Left out: the refinement of a root once it is bracketed (`newton`).
"""

import numpy as np

from elastica.newton import Bracket, Roots, arrow_system, newton, steepest_angle

NODES = 48
NODE_STEPS = 8
EXTREMUM_STEPS = 8


def sweep(segments, p, H, start, number):
    """The `number`-th root by increasing κ, up to the first node where the strip is past 90°.

    Nodes are graded: fine below κ = pH, where a segment leaves its line shape, coarse up to
    κ = √(2p), where a segment without reaction reaches 90°. Where ΣnD changes sign between two nodes
    the extremum is added as a node, so that a pair of roots near a fold is not stepped over.

    Parameters
    ----------
    segments : Mapping of Segment to int
    p, H : ndarray, shape (n,)
    start : Roots
        The segments at κ = 0; where it is not found there is nothing to follow.
    number : int
        1 for the root of smallest κ.

    Returns
    -------
    Roots
    """
    roots = Roots.none(segments, p.size)
    begun = np.flatnonzero(start.found)
    p, H = p[begun], H[begun]
    path = Path(segments, p, H, start.lam[:, begun])
    low, high = path.sign_change(number)
    crossed = np.flatnonzero(low >= 0)
    if crossed.size:
        roots.put(begun[crossed], path.refine(crossed, low[crossed], high[crossed]))
    return roots


class Path:
    """The rises followed through nodes of κ: arrays of shape (nodes, n), λ (nodes, distinct, n)."""

    def __init__(self, segments, p, H, lam):
        self.segments, self.p, self.H = segments, p, H
        grade = 0.25 * p * H
        self.kappa = grade * np.sinh(
            np.linspace(0, 1, NODES)[:, None] * np.arcsinh(1.001 * np.sqrt(2 * p) / grade)
        )
        self.lam = np.full((NODES, *lam.shape), np.nan)
        self.excess, self.pivot = np.full((2, NODES, p.size), np.nan)
        self._follow(lam)
        self._add_extrema()

    def _follow(self, lam):
        alive = np.arange(self.p.size)
        for node, kappa in enumerate(self.kappa):
            excess, pivot, lam, along, goes_on = self._settle(alive, kappa[alive], lam)
            self.excess[node, alive], self.pivot[node, alive] = excess, pivot
            self.lam[node][:, alive] = lam
            if node + 1 == NODES:
                break
            ahead = self.kappa[node + 1, alive] - kappa[alive]
            lam = (lam + along * ahead)[:, goes_on]
            alive = alive[goes_on]

    def _settle(self, points, kappa, lam):
        """Correct λ at fixed κ and evaluate the arrow system there."""
        p, H = self.p[points], self.H[points]
        settled = newton(self.segments, p, H, kappa, lam, fixed_kappa=True, most_steps=NODE_STEPS)
        arrow = arrow_system(self.segments, p, H, kappa, settled.lam)
        found = settled.found & np.isfinite(arrow.pivot)
        excess, pivot = np.where(found, arrow.excess, np.nan), np.where(found, arrow.pivot, np.nan)
        goes_on = found & (steepest_angle(self.segments, p, settled) < np.pi / 2)
        return excess, pivot, settled.lam, arrow.along, goes_on

    def _add_extrema(self):
        """Insert a node between each pair: the extremum of the length, or a copy of the left one."""
        names = ("kappa", "lam", "excess", "pivot")
        left = {name: getattr(self, name)[:-1] for name in names}
        right = {name: getattr(self, name)[1:] for name in names}
        between = {name: values.copy() for name, values in left.items()}
        turns = (left["pivot"] * right["pivot"] < 0) & (left["excess"] * right["excess"] > 0)
        for node in np.flatnonzero(turns.any(axis=1)):
            points = np.flatnonzero(turns[node])
            a, b = (side["kappa"][node, points] for side in (left, right))
            slope_a, slope_b = (side["pivot"][node, points] for side in (left, right))
            lam = left["lam"][node][:, points]
            for _ in range(EXTREMUM_STEPS):
                kappa = a + (b - a) * slope_a / (slope_a - slope_b)
                excess, pivot, lam, _, _ = self._settle(points, kappa, lam)
                before = pivot * slope_a > 0
                a, slope_a = np.where(before, kappa, a), np.where(before, pivot, slope_a)
                b, slope_b = np.where(before, b, kappa), np.where(before, slope_b, pivot)
            settled = np.isfinite(pivot)
            points, kappa, excess, pivot = (values[settled] for values in (points, kappa, excess, pivot))
            between["kappa"][node, points] = kappa
            between["excess"][node, points], between["pivot"][node, points] = excess, pivot
            between["lam"][node][:, points] = lam[:, settled]
        for name in names:
            values = np.empty((2 * NODES - 1, *getattr(self, name).shape[1:]))
            values[0::2], values[1::2] = getattr(self, name), between[name]
            setattr(self, name, values)

    def sign_change(self, number):
        """Nodes on both sides of the `number`-th sign change of Σnℓ − 1; −1 where there is none."""
        sign = np.sign(self.excess)
        changes = sign[:-1] * sign[1:] < 0
        wanted = changes & (np.cumsum(changes, axis=0) == number)
        low = np.where(wanted.any(axis=0), wanted.argmax(axis=0), -1)
        return low, low + 1

    def refine(self, points, low, high):
        """Newton from the secant between two nodes, kept between them."""
        a, b = self.kappa[low, points], self.kappa[high, points]
        excess_a, excess_b = self.excess[low, points], self.excess[high, points]
        lam_a, lam_b = self.lam[low, :, points].T, self.lam[high, :, points].T
        share = excess_a / (excess_a - excess_b)
        return newton(
            self.segments,
            self.p[points],
            self.H[points],
            a + (b - a) * share,
            lam_a + (lam_b - lam_a) * share,
            bracket=Bracket(a, b, np.sign(excess_a)),
        )
