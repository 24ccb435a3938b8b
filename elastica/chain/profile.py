"""The bending stiffness EI(s) along a strip, in units of the EI that makes loads dimensionless.

Not here: the stiffness of links (`splitting`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from elastica.inputs import read_numbers


class Profile(NamedTuple):
    """Stiffness at equidistant arc lengths from s = 0 to s = 1, linear between; or a function of s."""

    samples: tuple = (1.0,)
    function: Callable | None = None

    @property
    def uniform(self):
        """Whether the stiffness is one number."""
        return self.function is None and len(set(self.samples)) == 1

    def __call__(self, s):
        """Stiffness at arc lengths `s`."""
        if self.function is not None:
            return np.broadcast_to(read_numbers("stiffness(s)", self.function(s)), np.shape(s))
        return np.interp(s, np.linspace(0, 1, len(self.samples)), self.samples)


def parse_profile(stiffness, links):
    """Read a stiffness profile.

    Parameters
    ----------
    stiffness : None, float, array_like or callable
        None is the uniform strip, EI = 1; a number is uniform too. An array has the values at equidistant
        arc lengths from end A to end B, both included, linear between. A function takes an array of
        arc lengths from 0 to 1.
    links : int
        The chain sees the profile at the middles of its links, so an array may not have more than
        links + 1 values.

    Returns
    -------
    Profile

    Raises
    ------
    ValueError
        If a stiffness is not a positive number or there are too many of them.
    """
    if stiffness is None:
        return Profile()
    s = np.linspace(0, 1, 2 * links + 1)
    if callable(stiffness):
        profile = Profile((), stiffness)
        try:
            values = profile(s)
        except (TypeError, ValueError) as problem:
            raise ValueError(
                f"stiffness: the function must return a number for each of an array of arc lengths: {problem}"
            ) from None
        where = "s = {:.6g}".format
    else:
        values = np.atleast_1d(read_numbers("stiffness", stiffness))
        if values.ndim != 1 or not 1 <= values.size <= links + 1:
            raise ValueError(
                f"stiffness has the shape {values.shape}; give 1 to links + 1 = {links + 1} numbers at "
                f"equidistant arc lengths, or use links = {max(values.size - 1, 4)}"
            )
        profile = Profile(tuple(values.tolist()))
        s = np.linspace(0, 1, values.size)
        where = "s = {:.6g}".format
    bad = np.flatnonzero(~((values > 0) & np.isfinite(values)))
    if bad.size:
        raise ValueError(
            f"stiffness is {values[bad[0]]:g} at {where(s[bad[0]])}; every value must be a positive number"
        )
    return profile
