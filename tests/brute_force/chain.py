"""A discrete strip between two walls, minimised by IPOPT: no closed form, no contact word, no eigenvalue.

The strip is n equal links with angles θ at their middles and torsional springs between them; every node obeys
|y| ≤ H. Quantities are dimensionless: lengths by L, energies by 4π²EI/L, P by 4π²EI/L².
"""

from functools import lru_cache
from typing import NamedTuple

import casadi
import numpy as np

from studies.accuracy.interior_point import OPTIONS

STIFFNESS = {"clamped": np.inf, "pinned": 0.0}


class Minimum(NamedTuple):
    """What IPOPT found: `theta` (n,) at the links' middles, `y` (n + 1,) at the nodes."""

    energy: float
    y: np.ndarray
    theta: np.ndarray
    success: bool


def end_springs(n, ends):
    """Stiffness of the first and last spring of n links, for ends such as "0.3/pinned" or two numbers.

    The end is half a link away from the first angle; its own spring acts in series with that half link. A
    clamp leaves a spring twice as stiff as those between the links.
    """
    if isinstance(ends, str):
        names = ends.split("/" if "/" in ends else "-")
        ends = [STIFFNESS[end] if end in STIFFNESS else float(end) for end in names]
    return [1 / (1 / k + 2 * np.pi**2 / n) if k else 0.0 for k in ends]


def energy(theta, P, springs):
    """Potential of a chain: springs minus load times shortening.

    Parameters
    ----------
    theta : ndarray or casadi.SX, shape (n,)
    P : float or casadi.SX
    springs : pair of float or of casadi.SX
        The stiffnesses that `end_springs` gives.

    Returns
    -------
    float or casadi.SX
    """
    n = theta.shape[0]
    bends = theta[1:] - theta[:-1]
    stored = n / (4 * np.pi**2) * (bends.T @ bends)
    stored += springs[0] * theta[0] ** 2 + springs[1] * theta[n - 1] ** 2
    return stored / 2 - P * shortening(theta)


def shortening(theta):
    """Distance by which the ends of a chain approach each other."""
    n = theta.shape[0]
    return 1 - (casadi.sum1(casadi.cos(theta)) if isinstance(theta, casadi.SX) else np.cos(theta).sum()) / n


def heights(theta):
    """Heights of the nodes, from 0 at end A."""
    return np.concatenate([[0.0], np.cumsum(np.sin(theta))]) / theta.size


def minimise(start, P, H, ends, *, shorter=None, centre=None, distance=None):
    """Minimise the potential between the walls, with y = 0 at end B.

    Parameters
    ----------
    start : array_like, shape (n,)
        Angles to start from.
    P, H : float
        Load and half gap. P is not used where `shorter` is given.
    ends : str or pair of float
        Names such as "clamped-pinned", or two spring stiffnesses from 0 to inf.
    shorter : float, optional
        Prescribe this shortening instead of the load; the energy is then that of bending alone.
    centre, distance : array_like (n,) and pair of float, optional
        Keep √(∫(θ − centre)² ds) between these two numbers: a ball, a shell, or (twice the same) a sphere.

    Returns
    -------
    Minimum
    """
    start = np.asarray(start, float)
    n = start.size
    solver = _solver(n, shorter is not None, centre is not None)
    low, high = np.zeros((2, n))
    if shorter is not None:
        low, high = np.append(low, shorter), np.append(high, shorter)
    if centre is not None:
        low, high = (np.append(bound, r**2) for bound, r in zip((low, high), distance, strict=True))
    walls = np.concatenate([np.full(n, np.inf), np.full(n - 1, H)])
    found = solver(
        x0=np.concatenate([start, np.clip(heights(start)[1:-1], -H, H)]),
        p=np.concatenate(
            [[P if shorter is None else 0.0], end_springs(n, ends), np.zeros(n) if centre is None else centre]
        ),
        lbx=-walls,
        ubx=walls,
        lbg=low,
        ubg=high,
    )
    x = found["x"].full().ravel()
    y = np.concatenate([[0.0], x[n:], [0.0]])
    return Minimum(float(found["f"]) / n, y, x[:n], solver.stats()["success"])


@lru_cache(maxsize=32)
def _solver(n, prescribed, near):
    """IPOPT for one kind of problem; angles and inner heights are unknowns: all matrices are sparse."""
    theta, y, centre = casadi.SX.sym("theta", n), casadi.SX.sym("y", n - 1), casadi.SX.sym("centre", n)
    P, a, b = (casadi.SX.sym(name) for name in "Pab")
    rises = casadi.vertcat(y, 0) - casadi.vertcat(0, y)
    constraints = [n * rises - casadi.sin(theta)]
    if prescribed:
        constraints.append(shortening(theta))
    if near:
        constraints.append(casadi.sumsqr(theta - centre) / n)
    problem = {
        "x": casadi.vertcat(theta, y),
        "p": casadi.vertcat(P, a, b, centre),
        "f": n * energy(theta, P, (a, b)),
        "g": casadi.vertcat(*constraints),
    }
    return casadi.nlpsol("chain", "ipopt", problem, OPTIONS)
