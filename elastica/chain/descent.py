"""Where a strip goes that is let go: steepest descent of the potential of a chain between the walls.

Every link resists its turning like a body in oil, so that the angles follow the gradient,

    l_i dθ_i/dt = −∂W/∂θ_i,     W = V + ½ S Σ max(0, |y_i| − H)² + ½ S_n y_n² + ½ S_L (ΔL − ΔL_given)²,

y_i the heights of the joints, y_n that of end B, the last term at prescribed shortening only. Walls and
constraints yield by force/S. Their forces f = S (y ∓ H) act on a link as

    λ_i = Σ f_k  over the joints k from its right end to end B,       p = S_L (ΔL_given − ΔL),

so gradient and Hessian are those of `links`, with a λ for each link. The flow is stiff: the implicit formulas
of SciPy's BDF follow it, and Newton's method ends it. No name, no branch and no closed form enter.

Not here: cuts where the strip touches; which state it is that has come to rest (`elastica.paths`).
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from elastica.blas import single_threaded
from elastica.chain.bordered import solve_bordered
from elastica.chain.links import Chain
from elastica.chain.profile import Profile
from elastica.chain.splitting import mesh_of, split
from elastica.scales import FOUR_PI_SQUARED

WALLS = 1e6
"""S and S_n."""
SHORTENED = 3e5
"""S_L times the shortening: a thrust p takes p/3e5 of it away."""
WINDOWS = 0.01 * 4.0 ** np.arange(9)
"""Times after which it is tried whether the chain is about to come to rest (EI = L = 1)."""
CLOSE = 0.05
"""Part of its angles by which it may still be away from there."""
MOST_STEPS, LARGEST_TURN, CONVERGED, PAST = 30, 0.5, 1e-8, 0.1
"""Newton's method: steps, largest turn in units of the largest angle, the last one, and the part of the first
slope along a step that may be left at its end."""
TOUCHING = 1e-3
"""Part of H within which a joint touches the wall."""


class Rest(NamedTuple):
    """A chain that has come to rest.

    Attributes
    ----------
    theta : ndarray, shape (links,)
        Angles of the links.
    P, bending_energy, shortening : float
        Dimensionless, as in `Solution`.
    word : str
        Walls touched, from end A to end B; neighbouring joints touch as one.
    """

    theta: np.ndarray
    P: float
    bending_energy: float
    shortening: float
    word: str


class Walled(NamedTuple):
    """A chain between walls that yield a little; `p` or `shortening` is prescribed, the other None.

    Every link of `chain` is a segment of its own.
    """

    chain: Chain
    H: float
    p: float | None
    shortening: float | None

    def forces(self, theta):
        """Thrust p and the λ of every link, shape (n,)."""
        y = self.heights(theta)
        pushed = y - np.clip(y, -self.H, self.H)
        pushed[-1] = y[-1]
        lam = WALLS * np.cumsum(pushed[::-1])[::-1]
        if self.shortening is None:
            return self.p, lam
        return SHORTENED * (1 - self.chain.shortening(theta) / self.shortening), lam

    def heights(self, theta):
        """Heights of the joints after each link, shape (n,)."""
        return np.cumsum(self.chain.lengths * np.sin(theta))

    def descent(self, theta):
        """−∂W/∂θ, shape (n,)."""
        return -self.chain.gradient(theta, *self.forces(theta))

    def curvature(self, theta):
        """Second derivatives of W: those of `links` and stiff springs across.

        Returns
        -------
        diagonal, off : ndarray, shape (n,), (n − 1,)
        slopes : ndarray, shape (springs, n)
            How the springs are stretched.
        stiffness : ndarray, shape (springs,)
        """
        lengths, n = self.chain.lengths, theta.size
        touched = np.flatnonzero(np.abs(self.heights(theta)[:-1]) > self.H)
        slopes = np.tril(np.broadcast_to(lengths * np.cos(theta), (n, n)))[[*touched, -1]]
        stiffness = np.full(touched.size + 1, WALLS)
        if self.shortening is not None:
            slopes = np.vstack([slopes, self.chain.shortening_slopes(theta)])
            stiffness = np.append(stiffness, SHORTENED / self.shortening)
        return *self.chain.hessian(theta, *self.forces(theta)), slopes, stiffness

    def hessian(self, theta):
        """The same as one matrix, shape (n, n)."""
        diagonal, off, slopes, stiffness = self.curvature(theta)
        return (
            slopes.T @ (stiffness[:, None] * slopes) + np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
        )

    def newton_step(self, theta, downhill):
        """Solve with the Hessian; the forces of the stiff springs are further unknowns."""
        diagonal, off, slopes, stiffness = self.curvature(theta)
        nothing = np.zeros(stiffness.size)
        return solve_bordered(diagonal, off, slopes.T, slopes, -np.diag(1 / stiffness), downhill, nothing)[0]

    def softest(self, theta):
        """Lowest eigenvalue of the Hessian (weight Σ l φ²) and its direction, of root mean square 1."""
        values, directions = np.linalg.eigh(self.hessian(theta) / self.chain.lengths)
        return values[0], directions[:, 0] * np.sqrt(theta.size) * np.sign(directions[0, 0] or 1.0)

    def word(self, theta):
        """Walls touched by the inner joints, from end A to end B."""
        y = self.heights(theta)[:-1]
        wall = np.where(np.abs(y) > (1 - TOUCHING) * self.H, np.sign(y), 0).astype(int)
        begins = (wall != 0) & (wall != np.append(0, wall[:-1]))
        return "".join("U" if side > 0 else "D" for side in wall[begins])


def between_walls(links, ends, H, P=None, shortening=None):
    """A uniform chain of equal links between walls, with either the load or the shortening prescribed."""
    chain = split(mesh_of(links, Profile()), ends).chain
    chain = chain._replace(segment=np.arange(links))
    return Walled(chain, H, None if P is None else FOUR_PI_SQUARED * P, shortening)


@single_threaded
def descend(walled, theta, nudge):
    """Let a chain go.

    Parameters
    ----------
    walled : Walled
    theta : ndarray, shape (links,)
        Where it starts, but for a nudge in the direction in which W falls most or rises least.
    nudge : float
        Root mean square of that, in units of the angles.

    Returns
    -------
    Rest or None
        None if it does not come to rest at a minimum.
    """
    lengths, size = walled.chain.lengths, np.sqrt(np.mean(theta**2))
    theta = theta + nudge * size * walled.softest(theta)[1]
    for lasting in WINDOWS:
        theta = solve_ivp(
            lambda t, theta: walled.descent(theta) / lengths,
            (0.0, lasting),
            theta,
            method="BDF",
            jac=lambda t, theta: -walled.hessian(theta) / lengths[:, None],
            rtol=1e-3,
            atol=1e-4 * size,
        ).y[:, -1]
        rest = _minimum_nearby(walled, theta)
        if rest is not None and np.sqrt(np.mean((rest - theta) ** 2)) < CLOSE * size:
            bending, shorter = walled.chain.bending_energy(rest), walled.chain.shortening(rest)
            p, _ = walled.forces(rest)
            return Rest(rest, p / FOUR_PI_SQUARED, bending / FOUR_PI_SQUARED, shorter, walled.word(rest))
    return None


def _minimum_nearby(walled, theta):
    """The minimum that Newton's method finds, None if it finds none.

    Joints that touch and leave the wall in turn would make it jump to and fro: a step that goes past the
    lowest point on its way is shortened by the secant rule.
    """
    size = np.abs(theta).max()
    for _ in range(MOST_STEPS):
        downhill = walled.descent(theta)
        step = walled.newton_step(theta, downhill)
        if np.abs(step).max() > LARGEST_TURN * size:
            return None
        if np.abs(step).max() < CONVERGED * size:
            return theta if walled.softest(theta)[0] > 0 else None
        before, after = downhill @ step, walled.descent(theta + step) @ step
        theta = theta + step * (before / (before - after) if abs(after) > PAST * abs(before) else 1.0)
    return None
