"""The strip as segments reduced to their ends, which contacts join.

Not here: one segment (`held`), what is made of all of them (`counting`).
"""

import numpy as np

from elastica.stability.contacts import Edge
from elastica.stability.counting import Strip
from elastica.stability.elements import BATCH_VALUES, SHIFT, batches
from elastica.stability.held import FREE, HELD, SHARED, End, Piece, reduced

SPARE = 4
"""Bubbles that symmetric segments do not need for the accuracy of the others."""
LARGEST = 1e150
"""μ/κ is finite, so that nothing it is multiplied with overflows."""


def strips(solution, count, inertia, control, contacts_move=True, terms=None):
    """The solved points of a solution as strips with the same segments.

    Parameters
    ----------
    solution, count, contacts_move, terms
        As for `elements.batches`.
    inertia, control
        As for `strip_of`.

    Yields
    ------
    points : ndarray of int, shape (n,)
        Flat indices.
    strip : Strip
    shift : ndarray, shape (n,)
        σ.
    zeros : int
        Number of eigenvalues that are known to vanish.
    """
    waiting: list = []
    segments: tuple = ()
    zeros = 0
    for points, elements, number in batches(solution, count, contacts_move, terms):
        # Matrices are of the points with as many terms; eigenvalues are sought of many at once.
        if waiting and (
            elements.segments != segments or sum(part[0].size for part in waiting) >= BATCH_VALUES // count
        ):
            yield (*_joined(waiting), zeros)
            waiting = []
        shift = SHIFT * elements.growth if inertia else elements.largest_thrust
        unit = np.sqrt(solution.shortening.ravel()[points])
        spare = SPARE if terms is None else 0
        strip = strip_of(elements, solution.ends, number, spare, shift, unit, inertia, control)
        waiting.append((points, strip, shift))
        segments, zeros = elements.segments, elements.sliding if solution.state.line else 0
    if waiting:
        yield (*_joined(waiting), zeros)


def _joined(waiting):
    points, parts, shifts = zip(*waiting, strict=True)
    return np.concatenate(points), Strip.joined(parts), np.concatenate(shifts)


def strip_of(elements, ends, terms, spare, shift, unit, inertia, control):
    """Segments reduced and joined at n points.

    Parameters
    ----------
    elements : Elements
    ends : Ends
    terms, spare : int
        Legendre bubbles of each segment, and how many of them symmetric ones do without.
    shift, unit : ndarray, shape (n,)
        σ of `held.reduced`, and the unit of the advance there.
    inertia : bool
        Weight ∫ |η|² ds in place of ∫ φ² ds.
    control : Control

    Returns
    -------
    Strip
    """
    # Where nothing weighs the advance, and B may move, it follows by itself.
    advances = inertia or control.fixes_shortening
    free = not control.fixes_shortening
    contacts = elements.vertex[1:-1]
    line = bool(contacts) and contacts[0] is None
    at_contact = End(HELD if line else SHARED, SHARED if advances else "")
    far = [SHARED, SHARED] if contacts else [HELD, FREE if free else HELD]
    edges = [_edge(end, advance if advances else "") for end, advance in zip(ends, far, strict=True)]
    joints = [edges[0], *(at_contact for _ in contacts), edges[1]]
    distinct, order = {}, []
    for i, (segment, reverse) in enumerate(zip(elements.segments, elements.reverse, strict=True)):
        start, end = joints[i : i + 2][:: -1 if reverse else 1]
        key = segment, start, end
        if key not in distinct:
            distinct[key] = Piece(segment, elements.pendulums[i], elements.lengths[i], start, end)
        order.append(list(distinct).index(key))
    halves = [
        reduced(piece, max(terms - spare, spare) if piece.parity else terms, shift, unit, inertia)
        for piece in distinct.values()
    ]
    size = at_contact.unknowns if contacts else 0
    supports, loads = np.zeros((2, len(contacts), size, size, shift.size))
    if not line and size:
        for support, (reaction, kappa) in zip(supports, contacts, strict=True):
            with np.errstate(divide="ignore"):
                support[0, 0] = np.minimum(reaction / kappa, LARGEST)
    elif inertia and size:
        for support, load, flat in zip(supports, loads, elements.flats[1:], strict=True):
            load[0, 0] = flat * unit**2
            support[0, 0] = shift * load[0, 0]
    return Strip(halves, order, supports, loads, (Edge(advances, False), Edge(advances, free)))


def _edge(end, advance):
    """What is asked of a segment where it ends at an end of the strip."""
    return End(HELD, advance) if end.clamped else End(FREE, advance, end.stiffness)
