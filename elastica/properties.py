"""What is known of equilibria once κ and λ are: lengths, energies, admissibility, index and verdict.

This is where the parts meet: segments, walls (`admissibility`), verdicts (`stability`), rounding
(`accuracy`).
"""

import numpy as np

from elastica.codes import Status
from elastica.equilibria.admissibility import clearance
from elastica.equilibria.branch import bordered
from elastica.equilibria.buckled import periodic
from elastica.equilibria.euler import euler_modes_below, euler_root
from elastica.equilibria.newton import ROUNDING
from elastica.equilibria.roots import pendulums_of
from elastica.equilibria.rounding import SAFETY, bounds_at_shortening, rounding_bounds
from elastica.equilibria.small_deflections import TINY_THRUST
from elastica.pendulum.segments import arc, bending_energy, geometry, shortening, steepest
from elastica.scales import FOUR_PI_SQUARED
from elastica.stability.index import (
    FOLD_TOLERANCE,
    MARGIN,
    ends_meet,
    index_of_lines,
    index_of_points,
    response_of_lines,
    sliding_segments,
    verdict,
)

TOUCHING = 1e-12
"""Relative slack for what is exactly zero where one state meets another: a reaction, a clearance."""


def straight(p, scene):
    """Properties of the straight strip: its index is the number of Euler loads below p."""
    n = p.size
    root = np.sqrt(p)
    index = euler_modes_below(p, scene.ends)
    table = euler_root(np.arange(1, index.max(initial=0) + 2), scene.ends)
    nearest = np.minimum(np.abs(root - table[index]), np.abs(root - table[np.maximum(index - 1, 0)]))
    critical = nearest <= 4 * ROUNDING * root
    zero, none = np.zeros(n), np.zeros((n, 0))
    return {
        "P": p / FOUR_PI_SQUARED,
        "status": np.full(n, Status.SOLVED, np.int8),
        "stability": verdict(index, critical),
        "index": index.astype(np.int16),
        "nullity": critical.astype(np.int16),
        "clearance": scene.H,
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
        "periods": none.astype(np.int8),
    }


def bent(state, scene, found, control):
    """Properties of equilibria of any other state.

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
    if (found.periods == found.periods[:, :1]).all():
        patterns, member = found.periods[:, :1], np.zeros(scene.size, int)
    else:
        patterns, member = np.unique(found.periods, axis=1, return_inverse=True)
    values = {}
    for number, periods in enumerate(patterns.T):
        columns = np.flatnonzero(member.ravel() == number)
        segments = state.segments(scene.ends, periods)
        own = found.at(columns)
        for name, value in _of_pattern(state, segments, scene.at(columns), own, control).items():
            if name not in values:
                values[name] = np.empty((scene.size, *value.shape[1:]), value.dtype)
            values[name][columns] = value
    return values


def _of_pattern(state, order, scene, found, control):
    """Properties of equilibria that share their segments, `order` from end A to end B."""
    p, kappa, lam = found.p, found.kappa, found.lam
    place = {segment: i for i, segment in enumerate(order)}
    # Sorted, so that words with the same segments in another order give identical numbers.
    segments = {segment: order.count(segment) for segment in sorted(place)}
    pendulums = pendulums_of(list(segments), p, kappa, [lam[place[segment]] for segment in segments])
    arcs = [arc(segment.kind, q) for segment, q in zip(segments, pendulums, strict=True)]
    geometries = [geometry(piece) for piece in arcs]

    def total(quantity):
        return sum(count * quantity(piece) for count, piece in zip(segments.values(), arcs, strict=True))

    length = dict(zip(segments, (g.length for g in geometries), strict=True))
    lengths = np.stack([length[segment] for segment in order])
    contacts = len(state.word)
    room = sum(count * length[segment] for segment, count in segments.items())
    flat = np.zeros_like(p) + (1 - room if state.line else 0.0)
    position = np.cumsum(lengths, axis=0)[:contacts]
    position = position + flat / max(contacts, 1) * np.arange(contacts)[:, None]
    reaction = lam[:-1] + lam[1:] if contacts else np.zeros((0, p.size))
    gap = clearance(arcs, segments, scene)
    slope = np.max([steepest(piece.kind, piece.q) for piece in arcs], axis=0)
    bending, shorter = total(bending_energy), total(shortening)
    energy = bending - p * shorter

    delta_kappa, delta_length, delta_total, delta_energy = rounding_bounds(
        segments, arcs, geometries, p, state.line
    )
    terms = bending + p * shorter
    delta_energy = delta_energy + SAFETY * ROUNDING * terms
    curved = delta_kappa / np.sqrt(np.maximum(p, TINY_THRUST))
    if control.fixes_shortening:
        distinct = np.stack([lam[place[segment]] for segment in segments])
        along = bounds_at_shortening(segments, arcs, p, scene, distinct, delta_total, state.line)
        curved, delta_length = np.maximum(curved, along[0]), delta_length + along[1]
        delta_energy = delta_energy + p * shorter * along[2]
    relative = delta_energy / np.maximum(np.abs(energy), ROUNDING * terms)
    error = np.max([curved, delta_length, relative], axis=0)

    if state.line:
        index, critical = index_of_lines(segments, flat, delta_total, p)
        if control.fixes_shortening:
            index = index - ((index > 0) & (response_of_lines(segments, arcs) < 0))
        at_clamps, between_lines = sliding_segments(segments, scene.ends)
        nullity = at_clamps + between_lines + critical
        stability = verdict(index, critical, third_order=at_clamps > 0, family=between_lines > 0)
    else:
        index, critical = index_of_points(segments, geometries, slope >= np.pi / 2)
        if control.fixes_shortening:
            linear = bordered(segments, p, scene, kappa / np.sqrt(p), distinct, arcs)
            index = index - (linear.shortening_k * linear.load_k < 0)
            critical = np.abs(linear.shortening_k) <= FOLD_TOLERANCE * (
                np.abs(linear.shorter_k) + np.abs(linear.shortening_k - linear.shorter_k)
            )
        if state.mode and periodic(order[0].kind):
            meet, passed = ends_meet(arcs[0], geometries[0])
            index, critical = index - (meet & passed), critical | meet
        critical |= kappa <= MARGIN * delta_kappa
        nullity = critical
        stability = verdict(index, critical)

    pull = kappa * np.sqrt(p) + np.abs(lam).max(axis=0)
    admissible = (
        (reaction >= -TOUCHING * pull).all(axis=0)
        & (flat >= -MARGIN * delta_total)
        & (gap >= -TOUCHING * scene.H)
    )
    return {
        "P": p / FOUR_PI_SQUARED,
        "status": np.where(admissible, Status.SOLVED, Status.INADMISSIBLE).astype(np.int8),
        "stability": np.where(admissible, stability, -1).astype(np.int8),
        "index": np.where(admissible, index, -1).astype(np.int16),
        "nullity": np.where(admissible, nullity, -1).astype(np.int16),
        "curvature": kappa,
        "energy": energy / FOUR_PI_SQUARED,
        "bending_energy": bending / FOUR_PI_SQUARED,
        "shortening": shorter,
        "flat_length": flat,
        "max_slope": slope,
        "clearance": gap,
        "reaction": reaction.T / FOUR_PI_SQUARED,
        "contact_position": position.T,
        "error": error,
        "lam": lam.T,
        "lengths": lengths.T,
        "periods": found.periods.T.astype(np.int8),
    }
