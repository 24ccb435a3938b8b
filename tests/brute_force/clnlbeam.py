"""The optimisation benchmark clnlbeam: the deepest minimum of a strip between walls at H = 0.05.

Its objective is α + 2V at thrust p = α/2, with V the potential for EI = L = 1 (Maurer & Mittelmann 1991).
"""

import numpy as np
from brute_force.chain import minimise
from brute_force.landscape import energy_error, smooth

import elastica
from elastica import Stability, Status

H = 0.05
FOUR_PI_SQUARED = 4 * np.pi**2


def load(alpha):
    """Dimensionless load of the benchmark's parameter α."""
    return alpha / 2 / FOUR_PI_SQUARED


def objective(alpha, energy):
    """Objective of the benchmark from a dimensionless energy."""
    return alpha + 2 * FOUR_PI_SQUARED * energy


def alternating(most_contacts):
    """Names of the states that can be stable: no contact, or contacts with opposite walls in turn."""
    words = [("UD" * most_contacts)[:contacts] for contacts in range(1, most_contacts + 1)]
    return ["0", "B1", *words, *(word + "-" for word in words)]


def exact_minimum(alpha, ends, most_contacts=8):
    """Stable exact state of lowest energy."""
    candidates = (elastica.solve(name, P=load(alpha), H=H, ends=ends) for name in alternating(most_contacts))
    stable = [s for s in candidates if s.status == Status.SOLVED and s.stability == Stability.STABLE]
    return min(stable, key=lambda s: float(s.energy))


def random_start(rng, n, most_half_waves=9):
    """Angles of a wave that fills the gap, with smooth disorder."""
    waves = np.pi * rng.uniform(1, most_half_waves)
    wave = np.cos(waves * (np.arange(n) + 0.5) / n + rng.uniform(0, 2 * np.pi))
    return waves * H * (wave + rng.uniform(0, 0.7) * smooth(rng, n))


def found_minimum(alpha, ends, rng, n=400, starts=40):
    """Deepest minimum that a chain of n links reaches from random starts.

    Returns
    -------
    Minimum
    hits : int
        Starts that ended within a millionth of it.
    """
    found = [minimise(random_start(rng, n), load(alpha), H, ends) for _ in range(starts)]
    found = [minimum for minimum in found if minimum.success]
    best = min(found, key=lambda minimum: minimum.energy)
    return best, sum(minimum.energy < best.energy + 1e-6 * load(alpha) for minimum in found)


def touched(minimum):
    """Contact word of a minimum of a chain, read off the nodes at the walls."""
    wall = np.where(np.abs(minimum.y) > H * (1 - 1e-5), np.sign(minimum.y), 0)
    return "".join("D U"[int(w) + 1] for w, before in zip(wall[1:], wall, strict=False) if w and w != before)


def minima_agree(alpha, ends, rng, n=400, starts=40):
    """Compare the deepest minimum from random starts with the deepest stable exact state.

    Returns
    -------
    agrees : bool
        Whether they differ by no more than chains of n links must be expected to.
    description : str
    """
    exact = exact_minimum(alpha, ends)
    found, hits = found_minimum(alpha, ends, rng, n, starts)
    difference = 2 * FOUR_PI_SQUARED * (found.energy - float(exact.energy))
    bound = 2 * FOUR_PI_SQUARED * energy_error(exact, n)
    text = (
        f"alpha={alpha:g}, {ends}: {objective(alpha, float(exact.energy)):.6f} {exact.state.name}; found "
        f"{objective(alpha, found.energy):.6f} {touched(found)} in {hits} of {starts} starts; "
        f"difference {difference:.1e}, bound {bound:.1e}"
    )
    return abs(difference) <= bound, text
