"""Where states meet because a reaction vanishes or a bump just reaches a wall, seen from every state there.

On one side of such a load a state is an equilibrium with contacts that push, on the other it pulls on a
wall or passes one: inadmissible, with the same numbers.
"""

from hard_cases.contact_words import (
    Pattern,
    distinct,
    every_root,
    numbered,
    record,
    slack,
)
from hard_cases.equilibria import point
from hard_cases.free_shapes import free_strip
from hard_cases.records import CC, CP, POWERS, PP, case, sides, thrust
from mpmath import mp, mpf
from references.make_states import layout, locate

WORDS = (
    ("Ua", CC, 0.01, 2.046),
    ("Ua", CC, 0.05, 2.0661),
    ("Ua", CC, 0.1, 2.13),
    ("UD", CC, 0.05, 2.0661),
    ("UD", CC, 0.1, 2.13),
    ("UU", CC, 0.05, 4.0509),
    ("aUa", CC, 0.05, 4.091),
    ("UDa", CC, 0.05, 4.091),
    ("Ua", CC, 0.05, 6.3592),
    ("UUa", CC, 0.05, 6.3592),
    ("UD", CC, 0.05, 6.2136),
    ("Ua", PP, 0.05, 1.0125),
    ("UD", PP, 0.05, 1.0125),
    ("aU", CP, 0.05, 1.53),
    ("Ua", CP, 0.05, 1.53),
    ("UD", CP, 0.05, 1.6668),
)
"""State, ends, H, and about the load of the event."""
FREE = (("B2", CC, 0.05, 2.0661), ("B2", CC, 0.1, 2.13), ("B1", CP, 0.05, 0.5127))


def meetings():
    """Contact words beside the load at which a reaction vanishes or a bump touches."""
    for state, ends, H, about in WORDS:
        yield from meeting(state, ends, H, about)


def meeting(state, ends, H, about):
    """Cases of the root of a word that is nearest to an event at about this load."""
    root = min(every_root(state, ends, about, H), key=lambda one: abs(_least(one, about, H)[1]))
    which, _ = _least(root, about, H)
    at = _followed(root.pattern, root.pattern.rises(H), root.kappa, distinct(root.pattern, root.lams))
    load = _load(lambda P: _slack(root.pattern, *at(P), P, H)[which], about)
    for P, _ in sides(load, POWERS[1:]):
        kappa, lams = at(P)
        same = {
            abs(one.kappa - kappa): number
            for number, one in enumerate(every_root(state, ends, P, H), 1)
            if one.pattern == root.pattern
        }
        name = numbered(state, same[min(same)])
        yield record("meetings", name, ends, P, H, kappa, lams, root.pattern, root.index)


def _followed(pattern, rises, kappa, lams):
    """The state as a function of the load, each time from where it was last."""
    last = [kappa, lams]

    def at(P):
        kappa, lams = point(pattern.kinds, rises, thrust(P), *last)
        last[:] = kappa, distinct(pattern, lams)
        return kappa, lams

    return at


def _load(distance, about):
    """Load at which a distance vanishes."""
    start = mpf(about), mpf(about) * (1 + mpf(10) ** -5)
    load = mp.findroot(lambda P: distance(P), start, tol=mpf(10) ** -60)
    if abs(load / about - 1) > 0.02:
        raise ArithmeticError(f"the event at {load} is not the one at {about}")
    return load


def _slack(pattern, kappa, lams, P, H):
    """Reactions and distances of bumps from the walls in units of the strip's load and gap."""
    p = thrust(P)
    reactions, bumps = slack(pattern, kappa, lams, p, H)
    return [*(reaction / p for reaction in reactions), *(bump / mpf(H) for bump in bumps)]


def _least(root, P, H):
    """Which of them is nearest to zero, and its value."""
    values = _slack(root.pattern, mpf(root.kappa), [mpf(lam) for lam in root.lams], P, H)
    which = min(range(len(values)), key=lambda i: abs(values[i]))
    return which, values[which]


def free_shapes_touch():
    """Higher free shapes beside the load at which they touch the walls."""
    for H in (0.01, 0.05, 0.1):
        k = mp.findroot(lambda k, H=H: k / mp.ellipk(k * k) - 2 * mpf(H), mpf(H) * mp.pi)
        for state, ends, index, factor in (("B3", CC, 2, 4), ("B2", PP, 1, 1)):
            for P, side in sides(factor * (2 * mp.ellipk(k * k) / mp.pi) ** 2, POWERS[1:]):
                verdict = ("solved", "unstable", index) if side < 0 else ("inadmissible",)
                yield case("meetings", state, ends, P, H, *verdict, **free_strip(P, ends, 2)) | {
                    "periods": None
                }
    for state, ends, H, about in FREE:
        yield from free_shape_touches(state, ends, H, about)


def free_shape_touches(state, ends, H, about):
    """Cases of a free shape with λ ≠ 0."""
    ((kind,), _), (kappa, lams) = layout(state, ends), locate(state, ends, about, 5.0)
    pattern = Pattern((kind,), (0,), (0,), (0,))
    at = _followed(pattern, [mpf(0)], mpf(kappa), list(lams))
    load = _load(lambda P: min(_slack(pattern, *at(P), P, H)), about)
    index = 1 if state == "B2" else 0
    for P, _ in sides(load, POWERS[1:]):
        kappa, lams = at(P)
        yield record("meetings", state, ends, P, H, kappa, lams, pattern, index) | {"periods": None}
