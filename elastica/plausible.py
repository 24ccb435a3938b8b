"""What looks wrong with a strip or with what it is pushed by: mostly millimetres or GPa in place of SI units.

Not here: what cannot be at all, which is refused (`strip`). Paper, steel tape, rubber, drill pipe and silicon
beams of a hundred nanometres raise no doubt.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

LARGEST = {"length": 1e4, "width": 5.0, "thickness": 0.25}
SMALLEST = 1e-10
"""In metres: no strip is thinner than an atom."""
SOFTEST, STIFFEST = 1e3, 2e12
"""In pascals: a gel softer than any that carries its own weight; diamond has 1.1e12."""
LIGHTEST, HEAVIEST = 10.0, 25e3
"""In kg/m³: foam, and osmium with 22,600."""
PLUMPEST, SLENDEREST = 0.1, 1e-7
"""Thickness divided by length."""
NARROWEST, WIDEST = 1e-7, 0.5
"""Half gap H divided by length; a strip never comes farther from its axis than half its length."""
BUCKLES = 0.25
"""Load P of a strip pinned at both ends; no other buckles at less."""
MOST_STRAIN = 0.02


def of_strip(strip: Any) -> Iterator[str]:
    """Sentences about the dimensions and the material of a strip."""
    for name, most in LARGEST.items():
        size = getattr(strip, name)
        if not SMALLEST <= size <= most:
            yield f"{name} = {size:g} m is no size of a thin strip; check that it is in metres"
    slender = strip.thickness / strip.length
    sizes = f"thickness = {strip.thickness:g} m is {slender:.2g} of length = {strip.length:g} m"
    if slender > PLUMPEST:
        yield f"{sizes}: thicker than a tenth, it is no thin strip and shear counts; check both"
    if slender < SLENDEREST:
        yield f"{sizes}: so slender a strip would not carry itself; check both"
    if strip.width < strip.thickness:
        yield (
            f"width = {strip.width:g} m is below thickness = {strip.thickness:g} m: it would buckle "
            "sideways; check whether they are exchanged"
        )
    if not SOFTEST <= strip.E <= STIFFEST:
        yield f"E = {strip.E:g} Pa is the modulus of no material; check that it is in pascals (steel: 2e11)"
    if strip.density is not None and not LIGHTEST <= strip.density <= HEAVIEST:
        yield (
            f"density = {strip.density:g} kg/m**3 is that of no solid; check that it is in kg/m**3 "
            "(steel: 7850)"
        )


def of_loading(strip: Any, P: Any = None, H: Any = None, shortening: Any = None) -> Iterator[str]:
    """Sentences about dimensionless values that come from physical ones; of several, if all look wrong."""
    slender = strip.thickness / strip.length
    if P is not None:
        least, most = _range(P)
        strain = np.pi**2 / 3 * least * slender**2
        if 0 < most < 0.1 * BUCKLES:
            yield (
                f"force = {most * strip.scales['force']:.3g} N is P = {most:.2g}, and no strip buckles below "
                f"P = {BUCKLES:g}: nothing will happen; check the units of the force and of the strip"
            )
        elif strain > MOST_STRAIN:
            yield (
                f"force = {least * strip.scales['force']:.3g} N is P = {least:.2g} and shortens the strip by "
                f"{100 * strain:.2g} % before it bends, which is left out here; check the units of the "
                "force and of the strip"
            )
    if H is not None:
        least, most = _range(H)
        if least >= WIDEST:
            yield (
                f"gap = {2 * least * strip.length + strip.thickness:.3g} m is wider than length = "
                f"{strip.length:g} m, so that no wall is ever touched; check that it is in metres"
            )
        elif most < NARROWEST:
            yield (
                f"gap = {2 * most * strip.length + strip.thickness:.9g} m leaves "
                f"{2 * most * strip.length:.2g} m to the strip, less than walls are flat; "
                "check gap and thickness"
            )
    if shortening is not None:
        least, most = _range(shortening)
        if least >= 1:
            yield (
                f"shortening = {least * strip.length:.3g} m is more than length = {strip.length:g} m; "
                "check that it is in metres"
            )
        elif 0 < most < BUCKLES * slender**2:
            yield (
                f"shortening = {most * strip.length:.3g} m is less than what compresses the strip before it "
                "buckles, which is left out here; check that it is in metres"
            )


def _range(values):
    """Least and greatest of the numbers, zeros without."""
    values = np.asarray(values)
    values = values[np.isfinite(values) & (values != 0)]
    return (values.min(), values.max()) if values.size else (0.0, 0.0)
