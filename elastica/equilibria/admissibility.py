"""How far a free segment stays from the walls between its ends.

Not here: collisions of the strip with itself (`max_slope` tells where to look).
"""

import numpy as np

from elastica.pendulum.segments import arc, rise


def clearance(arcs, segments, scene):
    """H − max |y| over the interior extrema that are not contacts; H where there are none.

    Interior extrema are the crossings θ = 0 inside the segments: a segment of kind S has none, A and
    the kinds with extra periods have.

    Parameters
    ----------
    arcs : sequence of Arc
        One for each distinct segment of the state, arrays of shape (n,).
    segments : sequence of Segment
    scene : Scene
        Of the n points.

    Returns
    -------
    ndarray, shape (n,)
        Negative where a bump passes a wall.
    """
    highest = np.zeros_like(scene.H)
    for segment, piece in zip(segments, arcs, strict=True):
        for part in piece.kind.crossings:
            highest = np.maximum(highest, np.abs(scene.height(segment.start) + rise(arc(part, piece.q))))
    return scene.H - highest
