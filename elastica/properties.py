"""What is known of an equilibrium: each quantity, what it means, and how it follows from κ and λ.

`Quantities` is the one table: the fields of `Solution`, the columns of `FoundStates`, the variables of
datasets and their units follow from it. A new quantity is a field there and a value in `_of_pattern` (and
one in `chain.properties`, if chains are to have it).

Not here: what is computed on demand, with names in `ON_DEMAND` (`shapes`, `stability`); λ, κ and lengths
themselves (`equilibria`).
"""

from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from elastica.blocks import blocks
from elastica.codes import Stability, Status
from elastica.equilibria.admissibility import clearance
from elastica.equilibria.branch import bordered
from elastica.equilibria.euler import euler_modes_below, euler_root
from elastica.equilibria.newton import ROUNDING
from elastica.equilibria.roots import pendulums_of
from elastica.equilibria.rounding import bounds_at_shortening, relative_error, rounding_bounds
from elastica.pendulum.segments import arc, bending_energy, geometry, length, shortening, steepest
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability.index import MARGIN, verdict, verdict_of_lines, verdict_of_points

TOUCHING = 1e-12
"""Relative slack for what is exactly zero where one state meets another: a reaction, a clearance."""


class Quantity(NamedTuple):
    """What the array of one name says of every point.

    Attributes
    ----------
    long_name, comment : str
        Its meaning and its unit in datasets, in plain letters; without a name they do not have it.
    doc : str
        Its meaning in docstrings, where it is more than `long_name`.
    dtype : str
    missing : float
        Value where there is nothing.
    along : str
        Its dimension besides those of the points: "contact", "segment", "mode" or "s"; "" for none.
    units : str
        Of the dimensionless values.
    scale : str
        The one of `Strip.scales` that makes it physical, "" for none.
    """

    long_name: str = ""
    comment: str = ""
    doc: str = ""
    dtype: str = "f8"
    missing: float = np.nan
    along: str = ""
    units: str = "1"
    scale: str = ""


def quantity(long_name: str = "", comment: str = "", doc: str = "", **more: Any) -> Any:
    """A field of a dataclass that is a `Quantity`."""
    return field(kw_only=True, metadata={"quantity": Quantity(long_name, comment, doc, **more)})


def quantities_of(cls):
    """The quantities among the fields of a dataclass, by name.

    Returns
    -------
    dict of str to Quantity
    """
    return {f.name: f.metadata["quantity"] for f in fields(cls) if "quantity" in f.metadata}


def documented(cls):
    """The same dataclass with its quantities listed in its docstring, in place of ``{quantities}``."""
    lines = []
    for name, each in quantities_of(cls).items():
        kind = "ndarray" if each.dtype == "f8" else f"ndarray of {np.dtype(each.dtype).name}"
        shape = f", shape (..., {each.along}s)" if each.along else ""
        lines += [f"{name} : {kind}{shape}", f"    {each.doc or each.long_name.capitalize() + '.'}"]
    # Python without docstrings (-OO) has none to complete.
    cls.__doc__ = cls.__doc__ and cls.__doc__.replace("{quantities}", "\n    ".join(lines))
    return cls


@dataclass(frozen=True, eq=False, kw_only=True)
class Quantities:
    """What is known of a state at every point, in the order of datasets."""

    status: np.ndarray = quantity(
        "what became of the state",
        "of an inadmissible state the values are kept, the verdict is not given",
        "Codes of `Status`.",
        dtype="i1",
        missing=Status.NOT_COMPUTED,
    )
    stability: np.ndarray = quantity(
        "stability with contacts free to move",
        "by the second variation at the load or shortening prescribed; -1 unless status is solved",
        "Codes of `Stability`, 0 is STABLE; −1 where the status is not solved. `stable` says it with a bool.",
        dtype="i1",
        missing=Stability.NOT_SOLVED,
    )
    index: np.ndarray = quantity(
        "number of negative directions of the second variation",
        "-1 unless status is solved",
        "Number of strictly negative directions of the second variation; −1 where not solved.",
        dtype="i2",
        missing=-1,
    )
    nullity: np.ndarray = quantity(
        "number of zero directions of the second variation",
        "-1 unless status is solved",
        "Number of exact zeros of the second variation; −1 where not solved.",
        dtype="i2",
        missing=-1,
    )
    curvature: np.ndarray = quantity(
        "curvature where the strip is parallel to the walls",
        "L kappa*",
        "|θ'| where θ = 0, shared by contacts and clamped ends; 0 for lines and the straight strip.",
        scale="curvature",
    )
    energy: np.ndarray = quantity("total potential energy", "L/(4 pi^2 EI) V*", scale="energy")
    bending_energy: np.ndarray = quantity(
        "bending energy",
        "L/(4 pi^2 EI) times the dimensional energy",
        "The bending part of the energy, with that of springs at the ends.",
        scale="energy",
    )
    P: np.ndarray = quantity("thrust", "P* L^2/(4 pi^2 EI)", scale="force")
    H: np.ndarray = quantity(doc="Half gap.", scale="distance")
    """Datasets have it for a coordinate."""
    shortening: np.ndarray = quantity(
        "approach of the ends", "Delta L*/L", "Approach ΔL of the ends.", scale="distance"
    )
    flat_length: np.ndarray = quantity("length lying flat on the walls", "divided by L", scale="distance")
    max_slope: np.ndarray = quantity(
        "largest angle between strip and walls",
        "beyond pi/2 the strip overhangs; contact of the strip with itself is not modelled",
        "Largest |θ| in radians.",
        units="radian",
    )
    clearance: np.ndarray = quantity(
        "gap between a wall and the nearest bump that is not a contact",
        "divided by L; H where there is no such bump",
        "H − max |y| over interior extrema that are not contacts.",
        scale="distance",
    )
    reaction: np.ndarray = quantity(
        "force of the wall at a contact",
        "L^2/(4 pi^2 EI) mu*; of a line the sum of its two end forces",
        "μ/4π² of each contact; of a line the sum of its two end forces.",
        along="contact",
        scale="force",
    )
    contact_position: np.ndarray = quantity(
        "arc length of a contact",
        "divided by L; of a line its beginning",
        "Arc length of each contact; of a line its beginning.",
        along="contact",
        scale="distance",
    )
    error: np.ndarray = quantity(
        "bound of the relative rounding error",
        "of max(|d kappa|/(2 pi sqrt(P)), |d length|, |d energy/energy|); of a chain the difference "
        "from the exact state, or from a chain of half as many links",
        "Bound of max(|δκ|/√p, |δℓ|, |δV|/|V|).",
    )


QUANTITIES = quantities_of(Quantities)
ON_DEMAND = {
    "eigenvalue": Quantity(
        "eigenvalue of the second variation",
        "EI = L = 1, weight 1, ascending; of a line state those of its free segments",
        along="mode",
    ),
    "frequency": Quantity(
        "natural frequency",
        "rho A = EI = L = 1, sign(omega^2) sqrt|omega^2|, ascending: negative where motion grows",
        along="mode",
        scale="frequency",
    ),
    "theta": Quantity("angle between strip and walls", along="s", units="radian"),
    "x": Quantity("position along the walls", "divided by L", along="s", scale="distance"),
    "y": Quantity("height above the middle", "divided by L", along="s", scale="distance"),
}
"""What is computed only when asked for: eigenvalues, frequencies and shapes."""


def straight(p, scene):
    """Quantities of the straight strip at thrust p: its index is the number of Euler loads below p.

    All that is not named here is zero, or nothing where there is one for each contact.

    Parameters
    ----------
    p : ndarray, shape (n,)
    scene : Scene

    Returns
    -------
    dict of str to ndarray, shape (n, ...)
    """
    root = np.sqrt(p)
    index = euler_modes_below(p, scene.ends)
    table = euler_root(np.arange(1, index.max(initial=0) + 2), scene.ends)
    nearest = np.minimum(np.abs(root - table[index]), np.abs(root - table[np.maximum(index - 1, 0)]))
    critical = nearest <= 4 * ROUNDING * root
    zero = {
        name: np.zeros((p.size, 0) if each.along else p.size, each.dtype) for name, each in QUANTITIES.items()
    }
    return zero | {
        "status": np.full(p.size, Status.SOLVED, np.int8),
        "stability": verdict(index, critical),
        "index": index.astype(np.int16),
        "nullity": critical.astype(np.int16),
        "P": p / FOUR_PI_SQUARED,
        "H": scene.H,
        "clearance": scene.H,
    }


def bent(state, scene, found, control):
    """Quantities of equilibria of any other state, and λ, lengths and periods of their segments.

    Parameters
    ----------
    state : State
    scene : Scene
        Of each equilibrium.
    found : Equilibria
        With m columns.
    control : Control
        What is prescribed where the verdict is told.

    Returns
    -------
    dict of str to ndarray, shape (m, ...)
        The array attributes of `Solution`.
    """
    values = {}
    for periods, columns in _alike(found.periods):
        segments, own = state.segments(scene.ends, periods), found.at(columns)
        for name, value in _of_pattern(state, segments, scene.at(columns), own, control).items():
            if name not in values:
                values[name] = np.empty((scene.size, *value.shape[1:]), value.dtype)
            values[name][columns] = value
    return values


def _alike(periods):
    """Blocks of equilibria that share their segments.

    Yields
    ------
    periods : ndarray of int, shape (segments,)
    columns : slice or ndarray of int
    """
    if (periods == periods[:, :1]).all():
        yield from ((periods[:, 0], block) for block in blocks(periods.shape[1]))
        return
    patterns, member = np.unique(periods, axis=1, return_inverse=True)
    for number, pattern in enumerate(patterns.T):
        alike = np.flatnonzero(member.ravel() == number)
        yield from ((pattern, alike[block]) for block in blocks(alike.size))


class Parts(NamedTuple):
    """Equilibria that share their segments, by what each distinct segment is there.

    Attributes
    ----------
    segments : dict of Segment to int
        Each once, with its number; sorted, so that words with the same segments in another order give
        identical numbers.
    arcs, geometries : list of Arc, of Geometry
        One for each of them.
    lam : ndarray, shape (distinct segments, n)
    """

    segments: dict
    arcs: list
    geometries: list
    lam: np.ndarray

    @classmethod
    def of(cls, order, found):
        """Take apart equilibria with the segments `order` from end A to end B."""
        place = {segment: i for i, segment in enumerate(order)}
        segments = {segment: order.count(segment) for segment in sorted(place)}
        lam = found.lam[[place[segment] for segment in segments]]
        pendulums = pendulums_of(list(segments), found.p, found.kappa, lam)
        arcs = [arc(segment.kind, q) for segment, q in zip(segments, pendulums, strict=True)]
        return cls(segments, arcs, [geometry(piece) for piece in arcs], lam)

    def total(self, quantity):
        """Sum of a quantity of arcs over all segments, shape (n,)."""
        pieces = zip(self.segments.values(), self.arcs, strict=True)
        return sum(count * quantity(piece) for count, piece in pieces)

    def lengths(self, order):
        """Lengths of the segments from end A to end B, shape (segments, n)."""
        own = dict(zip(self.segments, self.geometries, strict=True))
        return np.stack([own[segment].length for segment in order])


def contact_positions(lengths, flat):
    """Arc lengths at which the contacts begin, shape (contacts, n): several lines share what lies flat."""
    begins = lengths[:-1].copy()
    for before, begin in pairwise(begins):
        begin += before
    for number, begin in enumerate(begins):
        begin += flat * (number / len(begins))
    return begins


def _of_pattern(state, order, scene, found, control):
    """The same of equilibria that share their segments, `order` from end A to end B."""
    parts = Parts.of(order, found)
    p, lam = found.p, found.lam
    bending, shorter = parts.total(bending_energy), parts.total(shortening)
    flat = 1 - parts.total(length) if state.line else np.zeros_like(p)
    lengths = parts.lengths(order)
    reaction = lam[:-1] + lam[1:]
    gap = clearance(parts.arcs, parts.segments, scene)
    slope = np.max([steepest(piece.kind, piece.q) for piece in parts.arcs], axis=0)
    bounds = rounding_bounds(parts.segments, parts.arcs, parts.geometries, p, state.line)
    linear = along = None
    if control.fixes_shortening:
        linear = bordered(parts.segments, p, scene, found.kappa / np.sqrt(p), parts.lam, parts.arcs)
        along = bounds_at_shortening(parts.segments, parts.arcs, p, linear, bounds.total, state.line)
    if state.line:
        told = verdict_of_lines(parts.segments, flat, bounds.total, p, scene.ends, linear)
    else:
        vanishing = found.kappa <= MARGIN * bounds.kappa
        told = verdict_of_points(
            parts.segments, parts.arcs, parts.geometries, slope >= np.pi / 2, vanishing, linear
        )
    pull = found.kappa * np.sqrt(p) + np.abs(lam).max(axis=0)
    admissible = (
        (reaction >= -TOUCHING * pull).all(axis=0)
        & (flat >= -MARGIN * bounds.total)
        & (gap >= -TOUCHING * scene.H)
    )
    return {
        "status": np.where(admissible, Status.SOLVED, Status.INADMISSIBLE).astype(np.int8),
        "stability": np.where(admissible, told.stability, -1).astype(np.int8),
        "index": np.where(admissible, told.index, -1).astype(np.int16),
        "nullity": np.where(admissible, told.nullity, -1).astype(np.int16),
        "curvature": found.kappa,
        "energy": (bending - p * shorter) / FOUR_PI_SQUARED,
        "bending_energy": bending / FOUR_PI_SQUARED,
        "P": p / FOUR_PI_SQUARED,
        "H": scene.H,
        "shortening": shorter,
        "flat_length": flat,
        "max_slope": slope,
        "clearance": gap,
        "reaction": reaction.T / FOUR_PI_SQUARED,
        "contact_position": contact_positions(lengths, flat).T,
        "error": relative_error(bounds, along, p, bending, shorter),
        "lam": lam.T,
        "lengths": lengths.T,
        "periods": found.periods.T.astype(np.int8),
    }
