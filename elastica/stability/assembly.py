"""The strip as segments reduced to their ends, which contacts join.

Not here: one segment (`held`), what is made of all of them (`counting`).
"""

import numpy as np

from elastica.stability.counting import Strip
from elastica.stability.held import FREE, HELD, SHARED, End, Piece, reduced

LARGEST = 1e150
"""μ/κ is finite, so that nothing it is multiplied with overflows."""


def strip_of(segments, elements, terms, shift, unit, inertia, control):
    """Segments reduced and joined at n points.

    Parameters
    ----------
    segments : tuple of Segment
    elements : Elements
    terms : int
        Legendre bubbles of each segment.
    shift, unit : ndarray, shape (n,)
        σ of `held.reduced`, and the unit of the advance there.
    inertia : bool
        Weight ∫ |η|² ds in place of ∫ φ² ds.
    control : Control

    Returns
    -------
    Strip
    """
    advances = inertia or control.fixes_shortening
    line = len(segments) > 1 and elements.vertex[1] is None
    edges = [
        End(HELD if vertex is None else FREE, place if advances else "", 0.0 if vertex is None else vertex)
        for vertex, place in zip(
            (elements.vertex[0], elements.vertex[-1]),
            (HELD, HELD if control.fixes_shortening else FREE),
            strict=True,
        )
    ]
    contact = End(HELD if line else SHARED, SHARED if advances else "")
    joints = [edges[0], *(contact for _ in segments[1:]), edges[1]]
    distinct, order = {}, []
    for i, (segment, reverse) in enumerate(zip(segments, elements.reverse, strict=True)):
        ends = joints[i : i + 2]
        start, end = ends[::-1] if reverse else ends
        key = segment, start, end
        if key not in distinct:
            distinct[key] = Piece(segment, elements.pendulums[i], elements.lengths[i], start, end)
        order.append(list(distinct).index(key))
    halves = [reduced(piece, terms, shift, unit, inertia) for piece in distinct.values()]
    contacts, size = len(segments) - 1, contact.unknowns if len(segments) > 1 else 0
    supports, loads = np.zeros((2, contacts, size, size, shift.size))
    for i in range(contacts if size else 0):
        if not line:
            reaction, kappa = elements.vertex[i + 1]
            with np.errstate(divide="ignore"):
                supports[i, 0, 0] = np.minimum(reaction / kappa, LARGEST)
        elif inertia:
            loads[i, -1, -1] = elements.flats[i + 1] * unit**2
            supports[i, -1, -1] = shift * loads[i, -1, -1]
    return Strip(halves, order, supports, loads)
