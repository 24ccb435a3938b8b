"""Whether a chain has enough links for its load, and what a solution of fewer links is worth.

A chain of links h under a constant resultant F is the standard map θ_{i+1} − 2θ_i + θ_{i−1} = −Fh²/EI sin
θ_i. Its small waves obey

    2 sin(ω h/2) = q h,        q = √(F/EI),        ω = q (1 + q²h²/24 + …),

so that over the strip they run ahead by ∫ (ω − q) ds ≈ h²/24 ∫ q³ ds radians; beyond qh = 2 there are none,
only zigzags. States with neighbouring mode numbers are π/2 apart in that phase for each half (symmetric)
wave. A chain whose waves are off by as much as that may have another mode's equilibrium where the strip has
this one's, and parasitic ones (the map is not integrable) between them. Off by a quarter of it is suspect.
"""

import numpy as np

LOST = np.pi / 2
SUSPECT = np.pi / 8


def lag(state):
    """Phase in radians by which waves of a chain run ahead of the strip's, infinite where there are none."""
    wave = np.sqrt(state.resultant / state.mesh.stiffness)
    if (wave * state.mesh.h >= 2).any():
        return np.inf
    h = state.mesh.h
    return float(np.sum(2 * np.arcsin(0.5 * wave * h) - wave * h))


def links_for(state, phase):
    """Number of links at which waves of a chain would be off by no more than `phase`."""
    cubes = np.mean((state.resultant / state.mesh.stiffness) ** 1.5)
    return int(np.ceil(np.sqrt(cubes / (24 * phase)))) + 1
