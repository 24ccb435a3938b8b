"""How far a free segment stays from the walls between its ends.

Left out: collisions of the strip with itself (`max_slope` tells where to look).
"""

import numpy as np

from elastica.segments import rise


def clearance(segments, pendulums, H):
    """H − max |y| over the interior extrema that are not contacts; H where there are none.

    Interior extrema are the crossings θ = 0 inside the segments: a segment of kind S has none, A and
    the kinds with further periods have.

    Parameters
    ----------
    segments : sequence of Segment
        Distinct segments of the state.
    pendulums : sequence of Pendulum
        One for each segment, arrays of shape (n,).
    H : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        Negative where a bump passes a wall.
    """
    highest = np.zeros_like(H)
    for segment, q in zip(segments, pendulums, strict=True):
        for part in segment.kind.crossings:
            highest = np.maximum(highest, np.abs(segment.start * H + rise(part, q)))
    return H - highest
