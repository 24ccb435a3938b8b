"""Loads at which the one-contact sequence of a strip changes as the thrust grows, between clamps and pins.

    straight → buckled → touches the wall at a point → lies flat on it → the flat stretch buckles, or
    the line state ends in a fold

A clamped strip touches the wall where k/K(k) = H, at P = (2K/π)², a pinned one at a quarter of that load. A
segment from a clamp to a line is a full period of the pendulum, with k = sin α/2 and α the angle of its
force: ℓ = (2K/π)√(cos α/P), H = ℓ sin α (2E/K − 1); one from a pin is half of one of twice the size.

Not here: the package. These are references for it.
"""

from functools import partial

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

EPS = 4 * np.finfo(float).eps
EVENTS = ("buckles", "touches", "point_to_line", "flat_buckles", "line_ends")
FOLD = 0.528160307318
"""H√P at which line segments from a clamp end in a fold, α = 0.83359; from a pin half of it."""
FOLD_ANGLE = 0.83359122
WIDEST, FOLD_OF_FREE = 0.83745, 0.66952
"""Modulus k at which k/K(k) is largest, and at which the free shape between a clamp and a pin folds."""
TANGENT = 4.493409457909064
"""tan r = r."""
EULER = {2.0: 1.0, 1.5: (TANGENT / (2 * np.pi)) ** 2, 1.0: 0.25}
"""Euler load of two clamps, a clamp and a pin, two pins."""


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
        Each "clamped" or "pinned".

    Returns
    -------
    ndarray, shape (...)
        NaN where the event does not happen.
    """
    sizes = [{"clamped": 1.0, "pinned": 0.5}[end] for end in ends.split("-")]
    load = {"buckles": _buckles, "touches": _touches, "line_ends": _line_ends}.get(event)
    if load is None:
        flat = {"point_to_line": 0.0, "flat_buckles": 1.0}[event]
        load = partial(_line, flat=flat)
    return np.vectorize(lambda gap: load(float(gap), sizes), otypes=[float])(H)


def _buckles(H, sizes):
    return EULER[sum(sizes)]


def _touches(H, sizes):
    """Where the first free shape has the height H."""
    if sizes[0] == sizes[1]:
        return _root(
            lambda k: k / ellipk(k * k) - H,
            (0.0, WIDEST),
            lambda k: EULER[sum(sizes)] * (2 * ellipk(k * k) / np.pi) ** 2,
        )
    return _root(
        lambda k: _between_clamp_and_pin(k)[0] - H,
        (1e-9, FOLD_OF_FREE),
        lambda k: _between_clamp_and_pin(k)[1],
    )


def _between_clamp_and_pin(k):
    """Height and load of the first free shape.

    It starts at the clamp, at the phase −β of its pendulum, sin α/2 = k sin β, is steepest at π/2 and ends
    at the pin at 3π/2. β follows from its two ends being equally high.
    """
    m = k * k
    K, E = ellipk(m), ellipe(m)

    def height(beta, turns):
        """Height times √F where φ has gone from −β to 3π/2 (`turns` = 3), or to π + β (2: level again)."""
        alpha = 2 * np.arcsin(k * np.sin(beta))
        through = 1 if turns == 3 else 2
        along = 2 * (turns * E + through * ellipeinc(beta, m)) - (turns * K + through * ellipkinc(beta, m))
        return np.sin(alpha) * along + through * 2 * k * np.cos(alpha) * np.cos(beta)

    beta = brentq(lambda beta: height(beta, 3), -np.pi / 2, 0.0, xtol=1e-300, rtol=EPS)
    root_F = 3 * K + ellipkinc(beta, m)
    alpha = 2 * np.arcsin(k * np.sin(beta))
    return height(beta, 2) / root_F, root_F**2 * np.cos(alpha) / (4 * np.pi**2)


def _line(H, sizes, flat):
    """Where √P times the flat length is `flat`: 0 where the line begins, 1 where its flat stretch buckles."""

    def slack(root_P):
        return root_P - flat - sum(size * _line_segment(H * root_P / size) for size in sizes)

    return _root(slack, (1e-3, _fold(H, sizes)), np.square)


def _line_ends(H, sizes):
    fold = _fold(H, sizes)
    return fold**2 if np.isfinite(_line(H, sizes, 0.0)) else np.nan


def _fold(H, sizes):
    """√P at which the first of the line segments ends."""
    return FOLD * min(sizes) / H


def _line_segment(rise):
    """Length times √P of a segment from a clamp to a line, from its rise times √P."""

    def of(alpha):
        m = np.sin(alpha / 2) ** 2
        length = 2 * ellipk(m) / np.pi * np.sqrt(np.cos(alpha))
        return length, length * np.sin(alpha) * (2 * ellipe(m) / ellipk(m) - 1)

    if rise >= of(FOLD_ANGLE)[1]:
        return of(FOLD_ANGLE)[0]
    return of(brentq(lambda alpha: of(alpha)[1] - rise, 0.0, FOLD_ANGLE, xtol=1e-300, rtol=EPS))[0]


def _root(slack, between, load):
    """Load where a slack is zero between two values; NaN where it has the same sign at both."""
    if slack(between[0]) * slack(between[1]) > 0:
        return np.nan
    return load(brentq(slack, *between, xtol=1e-300, rtol=EPS))
