"""Loads at which the one-contact sequence of a strip changes as the thrust grows.

    straight → buckled → touches the wall at a point → lies flat on it → the flat stretch buckles, or
    the line state ends in a fold

Each load is a root of a smooth function of P: a clearance, a flat length, a Euler load of the flat
stretch; never the bisection of a count.
"""

import numpy as np
from scipy.optimize.elementwise import find_root

from elastica.ends import parse_ends
from elastica.equilibria.euler import euler_root
from elastica.pendulum.line import FOLD
from elastica.scales import FOUR_PI_SQUARED
from elastica.solving import solve

WIDEST_ALIKE, WIDEST_UNLIKE = 1.77, 1.139
"""Load over the Euler load at which the first free shape is widest (like ends) or ends in a fold."""
NARROW = 1e-6
"""Half gap below which the wall is touched at the Euler load, to rounding."""
EVENTS = ("buckles", "touches", "point_to_line", "flat_buckles", "line_ends")


def loads(event, H, ends="clamped-clamped"):
    """Load P at which an event of the one-contact sequence happens.

    Parameters
    ----------
    event : str
        "buckles": the straight strip, at its Euler load; "touches": the first free shape, the wall;
        "point_to_line": the point contact becomes a line; "flat_buckles": the flat stretch, off the
        wall; "line_ends": the line state meets a steeper one in a fold.
    H : array_like, shape (...)
    ends : str

    Returns
    -------
    ndarray, shape (...)
        NaN where the event does not happen.

    Raises
    ------
    ValueError
        If the event or the ends are not known.
    """
    if event not in EVENTS:
        raise ValueError(f"event = {event!r} is not known; use one of {', '.join(EVENTS)}")
    ends = parse_ends(ends)
    H = np.asarray(H, float)
    euler = float(euler_root(1, ends)) ** 2 / FOUR_PI_SQUARED
    if event == "buckles":
        return np.full_like(H, euler)
    if event == "touches":
        widest = WIDEST_ALIKE if ends.alike else WIDEST_UNLIKE

        def slack(P, H):
            return solve("B1", P=P, H=H, ends=ends).clearance

        # P/P_1 − 1 ≈ 1.2 H² for like ends and 0.98 H² for unlike ones.
        low = euler * (1 + 0.5 * H**2)
        return np.where(H < NARROW, euler, _root(slack, low, euler * widest, H))
    pins = sum(end.pinned for end in ends)
    flat_buckles = event == "flat_buckles"

    def slack(P, H):
        return np.sqrt(P) * solve("U-", P=P, H=H, ends=ends).flat_length - flat_buckles

    # As H → 0 the free segments have √P ℓ = 1 (clamped) and ½ (pinned), and take less room than later.
    narrow = (2 - pins / 2 + flat_buckles) ** 2
    fold = (FOLD / (2 if pins else 1) / H) ** 2
    if event == "line_ends":
        begins = solve("U-", P=np.minimum(fold * (1 - 1e-5), 1e6), H=H, ends=ends).flat_length > 0
        return np.where(begins, fold, np.nan)
    return _root(slack, 1e-4 * narrow, np.minimum(narrow * (1 + 1e-9), (1 - 1e-5) * fold), H)


def _root(slack, low, high, H):
    """Root of `slack(P, H)` between two loads; NaN where it has the same sign at both."""
    low, high = (np.broadcast_to(edge, H.shape) for edge in (low, high))
    found = find_root(slack, (low, high), args=(H,))
    return np.where(found.success, found.x, np.nan)
