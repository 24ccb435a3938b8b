"""When a Newton iteration has arrived, told by the relative size of its last step and of the one before.

Not here: whether it arrived where it should.
"""

import numpy as np


def small(size):
    """Quadratic convergence: the step after one of 1e-9 is below rounding."""
    return size < 1e-9


def stagnated(size, previous, noise=1e-5):
    """Steps that are rounding noise of an ill-conditioned point: below `noise`, and no longer shrinking."""
    return (size < noise) & (size > 0.5 * previous)


def diverged(size):
    """Steps that are no numbers any more."""
    return ~np.isfinite(size)
