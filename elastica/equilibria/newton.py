"""One Newton iteration for every state: κ and one λ for each distinct segment, at n points at once.

A state with n_j segments of kind j and rise d_j obeys

    d_j(κ, λ_j) = rise_j        for each distinct segment j
    Σ n_j ℓ_j(κ, λ_j) = 1       (point regime; in the line regime κ = 0 and the rest lies flat)

so the Jacobian is an arrow, and eliminating the λ_j leaves one pivot, ΣnD = Σ n_j dℓ_j/dκ at fixed rise:

    [ ∂d_1/∂λ_1                        ∂d_1/∂κ ]
    [              ∂d_2/∂λ_2           ∂d_2/∂κ ]
    [ n_1 ∂ℓ_1/∂λ_1   n_2 ∂ℓ_2/∂λ_2   Σ n ∂ℓ/∂κ ]

No point depends on its neighbours.

Not here: where to start (`alternating`, `sweep`).
"""

from typing import Any, NamedTuple

import numpy as np

from elastica.blocks import blocks
from elastica.convergence import diverged, small, stagnated
from elastica.pendulum.segments import arc, below, geometry, length, pendulum, resultant

MOST_STEPS = 60
ROUNDING = np.finfo(float).eps


def rows_at(rows, where):
    """Some of the columns of an array, which NumPy takes several times faster out of each row."""
    return np.stack([row[where] for row in rows])


class Roots(NamedTuple):
    """Unknowns of a state at n points: `found` (n,), `kappa` (n,), `lam` (distinct segments, n)."""

    found: np.ndarray
    kappa: np.ndarray
    lam: np.ndarray

    @classmethod
    def none(cls, segments, n):
        """No root anywhere."""
        return cls(np.zeros(n, bool), np.full(n, np.nan), np.full((len(segments), n), np.nan))

    @classmethod
    def of_lines(cls, forces):
        """Line states, κ = 0, of segments with these λ (n,): wherever all are numbers."""
        lam = np.stack(forces)
        return cls(np.isfinite(lam).all(axis=0), np.zeros(lam.shape[1]), lam)

    def at(self, where):
        """The roots at some of the points."""
        return Roots(self.found[where], self.kappa[where], rows_at(self.lam, where))

    def put(self, where, other):
        """Take over what `other` found at the points `where` (indices)."""
        self.found[where] = other.found
        self.kappa[where] = other.kappa
        for force, better in zip(self.lam, other.lam, strict=True):
            force[where] = better


def newton(segments, p, scene, kappa, lam, bracket=None, most_steps=MOST_STEPS):
    """Solve the arrow system from a start; each point stops on its own test.

    Parameters
    ----------
    segments : Mapping of Segment to int
        Distinct segments with their number n_j.
    p : ndarray, shape (n,)
    scene : Scene
        Of the n points.
    kappa : ndarray, shape (n,)
    lam : ndarray, shape (distinct segments, n)
    bracket : Bracket, optional
        Two values of κ between which Σnℓ − 1 changes sign; a step that leaves them is replaced by
        one to their middle.
    most_steps : int
        Points that need more are not found.

    Returns
    -------
    Roots
    """

    def move(arrow, live, kappa):
        step, replaced = -arrow.excess / arrow.pivot, np.zeros(live.size, bool)
        rises = arrow.relative(np.zeros(live.size), arrow.across)
        if bracket is not None:
            known = sign_known(arrow.excess, rises)
            step, replaced = bracket.confine(live, kappa, arrow.excess, known, step)
        # A step to the middle is small when the interval is, whatever is in it.
        met = _met(arrow.excess)
        return step, ~replaced | met, met, _exact(arrow.excess) & small(rises)

    return _iterate(segments, p, scene, kappa, lam, move, most_steps)


def newton_at(segments, p, scene, kappa, lam, most_steps=MOST_STEPS):
    """Solve for the rises only, at given κ, from a start for λ.

    Parameters and what is returned are those of `newton`.
    """

    def stay(arrow, live, kappa):
        return np.zeros(live.size), True, True, False

    return _iterate(segments, p, scene, kappa, lam, stay, most_steps)


def _iterate(segments, p, scene, kappa, lam, move, most_steps):
    """Newton for the rises, while `move` gives the steps of κ: one block of points after another.

    Parameters
    ----------
    move : callable
        Of `Arrow`, positions (m,) and κ (m,) of points; gives the steps (m,) and, as bool (m,), whether a
        small step is the last one, whether one that stagnates is, and whether the point is exact already.
    """
    roots = Roots(np.zeros(p.size, bool), kappa.copy(), lam.copy())
    for block in blocks(p.size):
        _iterate_block(segments, p, scene, roots, np.arange(block.start, block.stop), move, most_steps)
    return roots


def _iterate_block(segments, p, scene, roots, live, move, most_steps):
    """The same from `roots` at the points `live`; those that have arrived are put aside."""
    p, scene, (_, kappa, lam) = p[live], scene.at(live), roots.at(live)
    previous = np.full(live.size, np.inf)
    for _ in range(most_steps):
        if not live.size:
            break
        arrow = arrow_system(segments, p, scene, kappa, lam)
        step, trusted, met, exact = move(arrow, live, kappa)
        step_lam = arrow.across + arrow.along * step
        size = arrow.relative(step, step_lam)
        step, step_lam = _stay_inside(p, kappa, lam, step, step_lam)
        kappa, lam = kappa + step, lam + step_lam
        found = small(size) & trusted | stagnated(size, previous) & met | exact
        over = found | diverged(size)
        if over.any():
            there, left = np.flatnonzero(over), np.flatnonzero(~over)
            roots.put(live[there], Roots(found, kappa, lam).at(there))
            live, p, kappa, size = live[left], p[left], kappa[left], size[left]
            lam, scene = rows_at(lam, left), scene.at(left)
        previous = size
    roots.put(live, Roots(np.zeros(live.size, bool), kappa, lam))


class Arrow(NamedTuple):
    """The arrow system after elimination of the λ_j at n points.

    `excess` is Σnℓ − 1 once the rises are corrected to first order, `pivot` its derivative ΣnD with
    respect to κ; λ_j changes by `across` + `along` δκ. Like κ, λ_j/`root_F` is a curvature, and `scale`
    is the largest of them.
    """

    excess: np.ndarray
    pivot: np.ndarray
    across: np.ndarray
    along: np.ndarray
    root_F: np.ndarray
    scale: np.ndarray

    def relative(self, step_kappa, step_lam):
        """Size of a step relative to the state, shape (n,)."""
        return np.maximum(np.abs(step_kappa), np.abs(step_lam / self.root_F).max(axis=0)) / self.scale


def arrow_system(segments, p, scene, kappa, lam):
    """Evaluate the arrow system for `segments` at κ (n,) and λ (distinct segments, n)."""
    along, across, root_F = np.empty((3, *lam.shape))
    scale = kappa
    excess: Any = -1.0
    pivot: Any = 0.0
    for j, (segment, count) in enumerate(segments.items()):
        q = pendulum(p, kappa, lam[j])
        g = geometry(arc(segment.kind, q))
        root_F[j] = q.r
        scale = np.maximum(scale, np.abs(lam[j]) / q.r)
        along[j] = -g.rise_kappa / g.rise_lam
        across[j] = (scene.rise(segment) - g.rise) / g.rise_lam
        excess = excess + count * (g.length + g.length_lam * across[j])
        pivot = pivot + count * (g.length_kappa + g.length_lam * along[j])
    return Arrow(excess, pivot, across, along, root_F, scale)


class Bracket(NamedTuple):
    """Interval of κ at n points in which Σnℓ − 1 leaves the sign it has at `low`."""

    low: np.ndarray
    high: np.ndarray
    sign_at_low: np.ndarray

    def confine(self, points, kappa, excess, known, step):
        """Narrow the interval at `points` by what was found at `kappa`, and keep the step inside.

        Parameters
        ----------
        points : ndarray of int, shape (n,)
        kappa, excess, step : ndarray, shape (n,)
        known : ndarray of bool, shape (n,)
            Whether the excess has a sign that counts.

        Returns
        -------
        step : ndarray, shape (n,)
        replaced : ndarray of bool, shape (n,)
            Whether it is one to the middle.
        """
        right = np.sign(excess) == self.sign_at_low[points]
        low = self.low[points] = np.where(known & right, kappa, self.low[points])
        high = self.high[points] = np.where(known & ~right, kappa, self.high[points])
        leaves = ~((kappa + step >= low) & (kappa + step <= high))
        return np.where(leaves, 0.5 * (low + high) - kappa, step), leaves


def regular(segments, p, roots, sign):
    """Whether the determinant of the arrow system, ΣnD·Π d_λ, has the sign it has at small deflections.

    It changes where the branch folds. A single d_λ may vanish in between: D is infinite there, the
    state is not special.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    determinant, pivot = sign, 0.0
    for j, (segment, count) in enumerate(segments.items()):
        g = geometry(arc(segment.kind, pendulum(p, roots.kappa, roots.lam[j])))
        determinant = determinant * np.sign(g.rise_lam)
        pivot = pivot + count * g.D
    return determinant * pivot > 0


def below_right_angles(segments, p, roots):
    """Whether |θ| < 90° on all segments, shape (n,)."""
    return np.all(
        [below(segment.kind, p, roots.kappa, lam) for segment, lam in zip(segments, roots.lam, strict=True)],
        axis=0,
    )


def total_length(segments, p, roots):
    """Σnℓ of the segments, shape (n,)."""
    return sum(
        count * length(arc(segment.kind, pendulum(p, roots.kappa, lam)))
        for (segment, count), lam in zip(segments.items(), roots.lam, strict=True)
    )


def _stay_inside(p, kappa, lam, step_kappa, step_lam):
    """Shorten a step that would leave κ > 0 or pass the pendulum's separatrix κ² = 2(F + p)."""
    shrink = np.ones_like(kappa)
    backwards = kappa + step_kappa < 0
    if backwards.any():
        shrink[backwards] = -0.9 * kappa[backwards] / step_kappa[backwards]
    for _ in range(50):
        F = resultant(p, lam + shrink * step_lam).min(axis=0)
        outside = (kappa + shrink * step_kappa) ** 2 >= 2 * (F + p) * (1 - 1e-15)
        if not outside.any():
            break
        shrink[outside] *= 0.5
    return shrink * step_kappa, shrink * step_lam


def sign_known(excess, rises):
    """Whether rises that are off by the relative size `rises` leave the sign of an excess to second order.

    Near a fold the excess is tiny on both sides of the root.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    return np.abs(excess) > 10 * rises**2


def _met(excess):
    """Length met as well as the worst conditioned points allow; beyond a fold it never is."""
    return np.abs(excess) <= 1e-12


def _exact(excess):
    """Length met to rounding: near a fold or a Euler load κ still moves, but in noise."""
    return np.abs(excess) <= 4 * ROUNDING
