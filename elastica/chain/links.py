"""A chain of rigid links and torsional springs: potential, gradient and Hessian for any lengths and springs.

        g_0         k_0         k_1         k_2                 k_i: spring between links i and i + 1
      A @ ====l_0==== o ====l_1==== o ====l_2==== o  …  @ B     g_i: hold of link i to the direction θ = 0
             θ_0           θ_1           θ_2                    l_i, θ_i: length, angle from the x-axis
        |<------- segment 0: rises by d_0 ------->|<- segment 1 …

    V = ½ Σ k_i (θ_{i+1} − θ_i)² + ½ Σ g_i θ_i² − p Σ l_i (1 − cos θ_i)
    Σ l_i sin θ_i = d_j     over each segment j

in units with EI = L = 1. The springs k join neighbours, the holds g tie a link to the direction θ = 0: end
springs, clamps, the wall where a line begins. With multipliers λ_j the Lagrangian is V + Σ λ_j (Σ l sin θ −
d_j), so that λ is that of the continuum, θ'' = −p sin θ + λ cos θ, and

    gradient   k_{i−1} (θ_i − θ_{i−1}) − k_i (θ_{i+1} − θ_i) + g_i θ_i − l_i (p sin θ_i − λ cos θ_i)
    Hessian    tridiagonal: k_{i−1} + k_i + g_i − l_i (p cos θ_i + λ sin θ_i) on the diagonal, −k_i beside it.

A zero spring separates what does not talk: the segments on both sides of a line. A link may have length zero.

Not here: where the links and springs come from (`splitting`, `published`).
"""

from typing import NamedTuple

import numpy as np


class Chain(NamedTuple):
    """The free links of a strip from end A to end B.

    Attributes
    ----------
    lengths : ndarray, shape (n,)
    springs : ndarray, shape (n − 1,)
        k between neighbours.
    holds : ndarray, shape (n,)
        g between a link and the direction θ = 0.
    segment : ndarray of int, shape (n,)
        Number 0, 1, … of the segment that each link belongs to.
    """

    lengths: np.ndarray
    springs: np.ndarray
    holds: np.ndarray
    segment: np.ndarray

    @property
    def segments(self):
        """Number of segments."""
        return int(self.segment[-1]) + 1

    def moments(self, theta):
        """Moments k (θ_{i+1} − θ_i) of the springs, shape (n − 1,)."""
        return self.springs * np.diff(theta)

    def bending_energy(self, theta):
        """Energy of springs and holds."""
        return 0.5 * (self.moments(theta) @ np.diff(theta) + self.holds @ theta**2)

    def shortening(self, theta):
        """Σ l (1 − cos θ), without cancellation."""
        return 2 * (self.lengths @ np.sin(0.5 * theta) ** 2)

    def rises(self, theta):
        """Height gained by each segment, shape (segments,)."""
        return np.bincount(self.segment, self.lengths * np.sin(theta), self.segments)

    def load(self, theta, p, lam):
        """Couple p sin θ − λ cos θ per length, shape (n,)."""
        return p * np.sin(theta) - lam[self.segment] * np.cos(theta)

    def thrust(self, theta, p, lam):
        """Force p cos θ + λ sin θ that compresses each link, shape (n,)."""
        return p * np.cos(theta) + lam[self.segment] * np.sin(theta)

    def gradient(self, theta, p, lam):
        """Derivative of the Lagrangian with respect to θ, shape (n,).

        Parameters
        ----------
        theta : ndarray, shape (n,)
        p : float
        lam : ndarray, shape (segments,)
        """
        gradient = self.holds * theta - self.lengths * self.load(theta, p, lam)
        moments = self.moments(theta)
        gradient[1:] += moments
        gradient[:-1] -= moments
        return gradient

    def hessian(self, theta, p, lam):
        """Second derivative of the Lagrangian: its diagonal (n,) and what stands beside it (n − 1,)."""
        diagonal = self.holds - self.lengths * self.thrust(theta, p, lam)
        diagonal[1:] += self.springs
        diagonal[:-1] += self.springs
        return diagonal, -self.springs

    def rise_slopes(self, theta):
        """Derivative of the rises with respect to θ, shape (n, segments)."""
        slopes = np.zeros((theta.size, self.segments))
        slopes[np.arange(theta.size), self.segment] = self.lengths * np.cos(theta)
        return slopes

    def shortening_slopes(self, theta):
        """Derivative of the shortening with respect to θ, shape (n,)."""
        return self.lengths * np.sin(theta)

    def constraint_slopes(self, theta, control):
        """Derivatives of what variations keep, a column each: the rises, the shortening if it is fixed.

        A straight chain keeps its shortening to first order by itself.
        """
        slopes = self.rise_slopes(theta)
        if control.fixes_shortening and theta.any():
            slopes = np.column_stack([slopes, self.shortening_slopes(theta)])
        return slopes
