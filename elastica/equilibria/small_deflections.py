"""Roots of words whose segments are all of kind S, reached from the closed form for small deflections.

Not here: strips that are too steep for it (`widening`).
"""

import numpy as np

from elastica.equilibria.newton import below_right_angles, newton

TINY_THRUST = 1e-6
"""Thrust below which starting values are taken at this thrust: they only have to be near."""
NEARLY_STEEP = 0.55
"""√p times the rise of a quarter of a period up to which these starts mostly converge."""
LARGEST_PHASE = np.pi / 2 - 1e-3


def from_small_deflections(segments, p, scene):
    """Newton from the small-deflection form; what is steeper than 90° may lie on any branch: not found."""
    roots = newton(segments, p, scene, *small_deflection(segments, p, scene))
    roots.found[:] &= below_right_angles(segments, p, roots)
    return roots


def gentle_gap(segments, p):
    """Half gap up to which that mostly succeeds, shape (n,)."""
    return NEARLY_STEEP / (quarter(segments) * np.sqrt(np.maximum(p, TINY_THRUST)))


def quarter(segments):
    """Greatest rise of a quarter of a period among segments, in multiples of H."""
    return max(segment.rise / (segment.kind.first + segment.kind.second) for segment in segments)


def small_deflection(segments, p, scene):
    """κ and λ of the linear strip θ'' + pθ = λ when all segments share one phase φ₀.

    With t = n_K π/2 + n_f φ₀ a segment has √p ℓ = t and p d = κ (n_f + t tan φ₀). A spring end is taken
    between the clamp and the pin, c : √p.
    """
    p = np.maximum(p, TINY_THRUST)
    root_p = np.sqrt(p)
    phases = []
    for kind, *_ in segments:
        firm = sum(c / (c + root_p) - 1 for c, _ in kind.springs)
        # A clamp adds K + f to a pin's.
        phases.append((kind.first + firm, kind.second + sum(s for _, s in kind.springs) + firm))
    counts = list(segments.values())
    first, second = (
        sum(count * phase[i] for count, phase in zip(counts, phases, strict=True)) for i in (0, 1)
    )
    phi = (root_p - first * np.pi / 2) / second
    phi = np.minimum(phi, LARGEST_PHASE)
    tan = np.tan(phi)
    kappas = [
        p * scene.rise(segment) / (second + (first * np.pi / 2 + second * phi) * tan)
        for segment, (first, second) in zip(segments, phases, strict=True)
    ]
    kappa = np.mean(kappas, axis=0)
    return kappa, np.tile(root_p * kappa * tan, (len(segments), 1))
