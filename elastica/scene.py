"""What stands around the strip: how its ends are held, and the walls at y = ±H.

Everything that a wider scene changes is asked of `Scene`: how far a segment rises, where a wall is.

Not here: what is prescribed (`control`), the strip itself.
"""

from typing import Any, NamedTuple

import numpy as np

from elastica.ends import Ends


class Scene(NamedTuple):
    """The surroundings of the strip at n points.

    Attributes
    ----------
    ends : Ends or None
        None where only segments are looked at, whose kinds tell how they are held.
    H : ndarray, shape (n,)
        Half gap.
    """

    ends: Ends | Any
    H: np.ndarray

    @property
    def size(self):
        """Number of points."""
        return self.H.size

    def at(self, where):
        """The scene at some of the points."""
        return self._replace(H=self.H[where])

    def scaled(self, factor):
        """The scene with all its lengths times a factor (n,)."""
        return self._replace(H=self.H * factor)

    def towards(self, other, share):
        """The scene at a share (n,) of the way on which the walls move to those of another."""
        return self._replace(H=self.H + share * (other.H - self.H))

    def height(self, level):
        """Height y of a wall, 1 or −1, or of the axis, 0; shape (n,)."""
        return level * self.H

    def rise(self, segment):
        """Height that a segment gains from its start to its end, shape (n,)."""
        return segment.rise * self.H

    def reach(self, segments):
        """Height that all segments gain, which a taut strip needs as its length; shape (n,).

        Parameters
        ----------
        segments : Mapping of Segment to int
            Segments with their number.
        """
        return sum(count * segment.rise for segment, count in segments.items()) * self.H

    def distinct(self):
        """Each scene once, and for each point which of them it is."""
        H, which = np.unique(self.H, return_inverse=True)
        return self._replace(H=H), which
