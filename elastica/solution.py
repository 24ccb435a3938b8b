"""Solve a named state on arrays of load and gap, and everything a user asks of the result.

This is where the parts meet: names (`states`), roots (`equilibrium`), walls (`admissibility`), verdicts
(`stability`). Eigenvalues and shapes are computed only when asked for.
"""

from dataclasses import dataclass, field

import numpy as np

from elastica.accuracy import SAFETY, rounding_bounds
from elastica.admissibility import clearance
from elastica.codes import Stability, Status
from elastica.ends import Ends, parse_ends
from elastica.equilibrium import TINY_THRUST, find, pendulums_of, unresolved_load
from elastica.euler import euler_modes_below, euler_root
from elastica.newton import ROUNDING
from elastica.scales import FOUR_PI_SQUARED
from elastica.segments import bending_energy, geometry, shortening, steepest
from elastica.stability import MARGIN, index_of_lines, index_of_points, sliding_segments, verdict
from elastica.states import State, parse_state

LARGEST_LOAD = 1e6
TOUCHING = 1e-12
"""Relative slack for what is exactly zero where one state meets another: a reaction, a clearance."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A state on an array of points; every array has the broadcast shape (...) of P and H first.

    All quantities are dimensionless (lengths by L, P by 4π²EI/L², energies by 4π²EI/L, curvatures by
    1/L). What does not exist is NaN, or −1 in the flags.

    Attributes
    ----------
    state, ends : State, Ends
    P, H : ndarray, shape (...)
    status : ndarray of int8
        Codes of `Status`.
    stability : ndarray of int8
        Codes of `Stability`; −1 where the status is not solved.
    index, nullity : ndarray of int16
        Numbers of strictly negative directions and of exact zeros of the second variation; −1 where
        not solved.
    curvature : ndarray
        |θ'| where θ = 0, shared by contacts and clamped ends; 0 for lines and the straight strip.
    energy, bending_energy, shortening, flat_length, max_slope, clearance : ndarray
        Total potential, its bending part, ΔL, length lying flat, max |θ| in radians, H − max |y| over
        interior extrema that are not contacts.
    reaction, contact_position : ndarray, shape (..., contacts)
        μ/4π² and arc length of each contact; of a line the sum of its end forces and its beginning.
    error : ndarray
        Bound of max(|δκ|/√p, |δℓ|, |δV|/|V|).
    lam, lengths : ndarray, shape (..., segments)
        λ (EI/L² = 1, each in its rising convention) and length of the free segments from A to B.
    reasons : dict of int to str
        Why a point failed, by its flat index.
    """

    state: State
    ends: Ends
    P: np.ndarray
    H: np.ndarray
    status: np.ndarray
    stability: np.ndarray
    index: np.ndarray
    nullity: np.ndarray
    curvature: np.ndarray
    energy: np.ndarray
    bending_energy: np.ndarray
    shortening: np.ndarray
    flat_length: np.ndarray
    max_slope: np.ndarray
    clearance: np.ndarray
    reaction: np.ndarray
    contact_position: np.ndarray
    error: np.ndarray
    lam: np.ndarray
    lengths: np.ndarray
    reasons: dict = field(default_factory=dict)

    def eigenvalues(self, count):
        """The `count` lowest eigenvalues of the second variation, shape (..., count).

        Ascending, with weight ∫φ² ds (EI = L = 1), exact zeros as 0.0; of a line state those of its
        free segments. NaN where the state is not solved.
        """
        from elastica.spectrum import eigenvalues

        return eigenvalues(self, count)

    def shape(self, samples):
        """Points of the strip at `samples` equidistant arc lengths.

        Returns
        -------
        Shape
            Fields s (samples,), theta, x, y (..., samples); NaN where there is no equilibrium.
        """
        from elastica.shapes import sample

        return sample(self, samples)


def solve(state, *, P, H, ends="clamped-clamped"):
    """Find a state, its admissibility and its stability at every point of broadcast arrays.

    Parameters
    ----------
    state : str
        Name such as "0", "B1", "U", "Ua", "U-".
    P : array_like
        Load P*L²/(4π²EI), from 0 to 1e6.
    H : array_like
        Half gap H*/L, positive.
    ends : str
        "clamped-clamped" (default), "clamped-pinned", "pinned-clamped" or "pinned-pinned".

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        If the state, the ends or the shapes of P and H make no sense. A bad number inside an array
        makes that point `failed`, with its reason in `reasons`, and nothing else.

    Examples
    --------
    >>> s = solve("U", P=[2.5, 3.95], H=0.1)
    >>> s.status.tolist(), s.stability.tolist()
    ([0, 1], [0, -1])
    """
    ends = parse_ends(ends)
    state = parse_state(state, ends)
    try:
        P, H = np.broadcast_arrays(np.asarray(P, float), np.asarray(H, float))
    except (TypeError, ValueError) as problem:
        raise ValueError(f"P and H must be numbers that broadcast: {problem}") from None
    shape = P.shape
    P, H = P.ravel().copy(), H.ravel().copy()
    reasons = _unusable(P, H, unresolved_load(state, ends) / FOUR_PI_SQUARED)
    usable = np.ones(P.size, bool)
    usable[list(reasons)] = False
    fields_of = _straight if state.straight else _bent
    with np.errstate(all="ignore"):
        fields = fields_of(state, ends, P[usable], H[usable])
    kept = {
        name: _spread(values, usable, name).reshape(shape + values.shape[1:])
        for name, values in fields.items()
    }
    return Solution(state, ends, P.reshape(shape), H.reshape(shape), **kept, reasons=reasons)


FLAGS = {"status": Status.FAILED, "stability": Stability.NOT_SOLVED, "index": -1, "nullity": -1}


def _spread(values, usable, name):
    """Put the values of the usable points back among the failed ones."""
    spread = np.full((usable.size, *values.shape[1:]), FLAGS.get(name, np.nan), values.dtype)
    spread[usable] = values
    return spread


def _unusable(P, H, unresolved):
    """Reasons why points cannot be solved, by flat index."""
    reasons = {}
    for name, values, good, allowed in (
        ("P", P, (P >= 0) & (P <= LARGEST_LOAD), f"give a load from 0 to {LARGEST_LOAD:g}"),
        ("H", H, (H > 0) & np.isfinite(H), "give a half gap above 0, below 0.5 if it is to matter"),
    ):
        for point in np.flatnonzero(~good):
            reasons.setdefault(int(point), f"{name} = {values[point]:g} is not possible; {allowed}")
    for point in np.flatnonzero(P >= unresolved):
        reasons.setdefault(
            int(point),
            f"P = {P[point]:g}: above {unresolved:.4g} this shape is a loop narrower than numbers "
            "of double precision can tell",
        )
    return reasons


def _straight(state, ends, P, H):
    """Fields of the straight strip: its index is the number of Euler loads below P."""
    n = P.size
    p = FOUR_PI_SQUARED * P
    root = np.sqrt(p)
    index = euler_modes_below(p, ends)
    table = euler_root(np.arange(1, index.max(initial=0) + 2), ends)
    nearest = np.minimum(np.abs(root - table[index]), np.abs(root - table[np.maximum(index - 1, 0)]))
    critical = nearest <= 4 * ROUNDING * root
    zero, none = np.zeros(n), np.zeros((n, 0))
    return {
        "status": np.full(n, Status.SOLVED, np.int8),
        "stability": verdict(index, critical),
        "index": index.astype(np.int16),
        "nullity": critical.astype(np.int16),
        "clearance": H,
        **dict.fromkeys(
            (
                "curvature",
                "energy",
                "bending_energy",
                "shortening",
                "flat_length",
                "max_slope",
                "error",
            ),
            zero,
        ),
        "reaction": none,
        "contact_position": none,
        "lam": none,
        "lengths": none,
    }


def _bent(state, ends, P, H):
    """Fields of every other state."""
    p = FOUR_PI_SQUARED * P
    order = state.segments(ends)
    segments = state.distinct_segments(ends)
    roots = find(state, ends, p, H)
    kinds = [segment.kind for segment in segments]
    pendulums = pendulums_of(state, ends, p, roots.kappa, roots.lam)
    geometries = [geometry(kind, q) for kind, q in zip(kinds, pendulums, strict=True)]

    def total(quantity):
        parts = zip(segments.values(), kinds, pendulums, strict=True)
        return sum(count * quantity(kind, q) for count, kind, q in parts)

    place = [list(segments).index(segment) for segment in order]
    lengths = np.stack([g.length for g in geometries])[place]
    lam = roots.lam[place]
    contacts = len(state.word)
    flat = np.zeros_like(p) + (1 - lengths.sum(axis=0) if state.line else 0.0)
    position = np.cumsum(lengths, axis=0)[:contacts]
    position = position + flat / max(contacts, 1) * np.arange(contacts)[:, None]
    reaction = lam[:-1] + lam[1:] if contacts else np.zeros((0, p.size))
    gap = clearance(segments, pendulums, H)
    slope = np.max([steepest(kind, q) for kind, q in zip(kinds, pendulums, strict=True)], axis=0)
    bending, shorter = total(bending_energy), total(shortening)
    energy = bending - p * shorter

    delta_kappa, delta_length, delta_total, delta_energy = rounding_bounds(
        segments, pendulums, geometries, p, state.line
    )
    terms = bending + p * shorter
    delta_energy = delta_energy + SAFETY * ROUNDING * terms
    relative = delta_energy / np.maximum(np.abs(energy), ROUNDING * terms)
    error = np.max([delta_kappa / np.sqrt(np.maximum(p, TINY_THRUST)), delta_length, relative], axis=0)

    if state.line:
        index, critical = index_of_lines(segments, flat, delta_total, p)
        at_clamps, between_lines = sliding_segments(segments, ends)
        nullity = at_clamps + between_lines + critical
        stability = verdict(index, critical, third_order=at_clamps > 0, family=between_lines > 0)
    else:
        index, critical = index_of_points(segments, geometries, slope >= np.pi / 2)
        critical |= roots.kappa <= MARGIN * delta_kappa
        nullity = critical
        stability = verdict(index, critical)

    pull = roots.kappa * np.sqrt(p) + np.abs(lam).max(axis=0)
    admissible = (
        (reaction >= -TOUCHING * pull).all(axis=0) & (flat >= -MARGIN * delta_total) & (gap >= -TOUCHING * H)
    )
    solved = roots.found & admissible
    status = np.where(
        solved, Status.SOLVED, np.where(roots.found, Status.INADMISSIBLE, Status.NO_EQUILIBRIUM)
    )

    def known(values):
        return np.where(roots.found, values, np.nan)

    return {
        "status": status.astype(np.int8),
        "stability": np.where(solved, stability, Stability.NOT_SOLVED).astype(np.int8),
        "index": np.where(solved, index, -1).astype(np.int16),
        "nullity": np.where(solved, nullity, -1).astype(np.int16),
        "curvature": known(roots.kappa),
        "energy": known(energy / FOUR_PI_SQUARED),
        "bending_energy": known(bending / FOUR_PI_SQUARED),
        "shortening": known(shorter),
        "flat_length": known(flat),
        "max_slope": known(slope),
        "clearance": known(gap),
        "reaction": known(reaction / FOUR_PI_SQUARED).T,
        "contact_position": known(position).T,
        "error": known(error),
        "lam": known(lam).T,
        "lengths": known(lengths).T,
    }
