"""Where a condition ceases to hold, in many intervals at once.

Not here: roots of functions that have values, not only a sign (`scipy.optimize.elementwise`).
"""

import numpy as np

SECTIONS = 16
"""Parts into which an interval is divided at a time: calls are dear, points are cheap."""


def narrow(holds, within, beyond, times):
    """Narrow intervals down to the first place at which a condition has ceased to hold.

    Parameters
    ----------
    holds : callable
        Of places (..., m) and the numbers (m,) of the intervals in which they lie; gives bool (m,).
    within, beyond : ndarray, shape (..., n)
        Ends of the intervals: where the condition holds, and where it does not.
    times : int
        How often they are divided, each time by 16.

    Returns
    -------
    within, beyond : ndarray, shape (..., n)
    """
    *outer, n = within.shape
    each = np.arange(n)
    which = np.tile(each, SECTIONS - 1)
    for _ in range(times if n else 0):
        steps = np.linspace(within, beyond, SECTIONS + 1, axis=-2)
        held = holds(steps[..., 1:-1, :].reshape(*outer, which.size), which).reshape(-1, n)
        first = 1 + np.where(held.all(axis=0), SECTIONS - 1, held.argmin(axis=0))
        within, beyond = steps[..., first - 1, each], steps[..., first, each]
    return within, beyond
