"""A peer: a discrete strip between two walls minimised by IPOPT through casadi.

The strip is n equal links with angles at their middles, springs between them, half as soft at the clamps;
every node obeys |y| ≤ H. Angles and heights are unknowns, so that all matrices are sparse.
"""

import time
from functools import cache
from typing import Any

import numpy as np

from elastica.scales import FOUR_PI_SQUARED
from studies.accuracy.cases import Answer

OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-9,
        "max_iter": 500,
        "mu_init": 1e-6,
        "bound_push": 1e-9,
        "bound_frac": 1e-9,
        "bound_relax_factor": 0.0,
        "nlp_scaling_method": "none",
    },
}
BOW = 0.9
"""Part of the gap that the cosine to start from fills."""


def interior_point(case, links):
    """The stable state near a bow, by minimisation; setting up the problem is outside of the time."""
    solver = _solver(links)
    s = (np.arange(links) + 0.5) / links
    theta = np.arcsin(np.minimum(BOW * case.H * np.pi, 0.9) * np.sin(2 * np.pi * s))
    y = np.cumsum(np.sin(theta))[:-1] / links
    walls = np.concatenate([np.full(links, np.inf), np.full(links - 1, case.H)])
    begin = time.perf_counter()
    found = solver(
        x0=np.concatenate([theta, np.clip(y, -case.H, case.H)]),
        p=case.P,
        lbx=-walls,
        ubx=walls,
        lbg=0,
        ubg=0,
    )
    solving = time.perf_counter() - begin
    theta = found["x"].full().ravel()[:links]
    y = np.concatenate([[0.0], found["x"].full().ravel()[links:], [0.0]])
    shorter = 2 * float(np.sum(np.sin(theta / 2) ** 2)) / links
    heights = np.interp(np.linspace(0, 1, 21), np.linspace(0, 1, links + 1), y)
    return Answer(
        {"equilibrium": solving, "shape": solving},
        float(found["f"]) / links,
        shorter,
        None,
        None,
        heights,
    )


@cache
def _solver(links):
    """IPOPT for strips of this many links at any load."""
    import casadi

    theta, y, P = casadi.SX.sym("theta", links), casadi.SX.sym("y", links - 1), casadi.SX.sym("P")
    bends = casadi.vertcat(np.sqrt(2) * theta[0], theta[1:] - theta[:-1], np.sqrt(2) * theta[-1])
    bent = links * casadi.sumsqr(bends) / (2 * FOUR_PI_SQUARED)
    shorter = 1 - casadi.sum1(casadi.cos(theta)) / links
    rises = casadi.vertcat(y, 0) - casadi.vertcat(0, y)
    problem = {
        "x": casadi.vertcat(theta, y),
        "p": P,
        "f": links * (bent - P * shorter),
        "g": links * rises - casadi.sin(theta),
    }
    return casadi.nlpsol("strip", "ipopt", problem, OPTIONS)
