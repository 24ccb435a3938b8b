"""Every root of a contact word, by a scan over κ: kinds of segment, number, admissibility, index.

    word       segments without further periods, each rising
    U          S H · S H                          Ua         S H · A H
    UD         S H · S 2H · S H                   UU         S H · A 0 · S H

Below 90° a segment has one λ for each κ, so the total length is a function of κ alone: a dense scan finds
its roots, the sign of its slope there is that of ΣD, and index = #A + #0 + 2 Σj − [ΣD > 0].
"""

import math
from functools import cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from hard_cases.equilibria import point, values
from hard_cases.records import CC, PP, case, thrust
from mpmath import mpf
from references.make_states import Kind, _alpha_of_kappa, _Double, _grid, _roots, measure, steepest

SHORTEST_PERIOD = 5.49
"""√p times the shortest period below 90°."""


class Pattern(NamedTuple):
    """Kinds of the segments from end A to end B, with their start and end in multiples of H."""

    kinds: tuple
    starts: tuple
    tops: tuple
    periods: tuple

    @property
    def multiples(self):
        """Rises in multiples of H."""
        return tuple(top - start for start, top in zip(self.starts, self.tops, strict=True))

    def rises(self, H):
        """Rises of the segments."""
        return [multiple * mpf(H) for multiple in self.multiples]

    @property
    def turns(self):
        """Index but for the sign of ΣD."""
        return sum(kind.letter == "A" for kind in self.kinds) + 2 * sum(self.periods)


class Root(NamedTuple):
    """A root of a word in double precision."""

    kappa: float
    lams: tuple
    pattern: Pattern
    longer: bool
    """Whether ΣD > 0: the strip would get longer with κ."""

    @property
    def index(self):
        """Index under load."""
        return self.pattern.turns - self.longer


@cache
def patterns(state, ends, most):
    """Patterns with up to `most` further periods in all; of mirror images one."""
    word, sides = state.strip("a"), (state[0] == "a", state[-1] == "a")
    outer = [
        (Kind(end, "A" if is_a else "S"), 0, 1) for end, is_a in zip(ends.split("-"), sides, strict=True)
    ]
    inner = [
        (Kind("clamped", "A"), 1, 1) if a == b else (Kind("clamped", "S"), -1, 1) for a, b in pairwise(word)
    ]
    plain = [outer[0], *inner, outer[1]]
    mirror = word[::-1] if word[-1] == "U" else word[::-1].translate(str.maketrans("UD", "DU"))
    symmetric = mirror == word and sides[0] == sides[1] and ends in (CC, PP)
    found = []
    for periods in product(*(range(most + 1) if start != top else (0,) for _, start, top in plain)):
        if sum(periods) <= most and not (symmetric and periods < periods[::-1]):
            kinds, starts, tops = zip(*plain, strict=True)
            kinds = tuple(
                Kind(kind.end, kind.letter, more) for kind, more in zip(kinds, periods, strict=True)
            )
            found.append(Pattern(kinds, starts, tops, periods))
    return found


def force(kind, kappa, p, rise):
    """λ of a segment for an array of κ, below and a little beyond 90°."""
    return p * np.tan(_alpha_of_kappa(kind, kappa, p, rise))


def excess(pattern, kappa, p, H):
    """Σℓ − 1 for an array of κ."""
    pairs = list(zip(pattern.kinds, pattern.multiples, strict=True))
    length = {
        pair: measure(pair[0], kappa, force(pair[0], kappa, p, pair[1] * H), p, _Double)[0]
        for pair in set(pairs)
    }
    return sum(length[pair] for pair in pairs) - 1


def every_root(state, ends, P, H):
    """Every root of a word below 90° at a load, in the order in which they are numbered."""
    p = 4 * math.pi**2 * P
    room = int(math.sqrt(p) / SHORTEST_PERIOD)
    found = []
    with np.errstate(all="ignore"):
        for pattern in patterns(state, ends, room):
            for kappa in _roots(lambda x, one=pattern: excess(one, x, p, H), _grid(pattern.kinds, p, H)):
                around = excess(pattern, kappa * np.array([1 - 1e-7, 1 + 1e-7]), p, H)
                pairs = zip(pattern.kinds, pattern.multiples, strict=True)
                lams = tuple(
                    float(force(kind, np.array([kappa]), p, multiple * H)[0]) for kind, multiple in pairs
                )
                slopes = [
                    steepest(kind, kappa, lam, p, _Double)
                    for kind, lam in zip(pattern.kinds, lams, strict=True)
                ]
                if max(slopes) < math.pi / 2:
                    found.append(Root(kappa, lams, pattern, bool(around[1] > around[0])))
    alternates = all(kind.letter == "S" for kind in patterns(state, ends, 0)[0].kinds)
    return sorted(
        found,
        key=lambda root: (
            not (alternates and not any(root.pattern.periods)),
            round(root.kappa, 9),
            sum(root.pattern.periods),
            tuple(-more for more in root.pattern.periods),
        ),
    )


def numbered(state, number):
    """Name of a root."""
    return state if number == 1 else f"{state}:{number}"


def solve(root, P, H):
    """κ and λ of a root at 50 digits."""
    pattern = root.pattern
    return point(pattern.kinds, pattern.rises(H), thrust(P), root.kappa, distinct(pattern, root.lams))


def distinct(pattern, lams):
    """Of one entry for each segment, one for each distinct segment."""
    pairs = list(zip(pattern.kinds, pattern.multiples, strict=True))
    return [lams[pairs.index(pair)] for pair in dict.fromkeys(pairs)]


def slack(pattern, kappa, lams, p, H):
    """Reactions of the contacts, and how far the bumps between them stay from the walls."""
    reactions = [a + b for a, b in pairwise(lams)]
    bumps = []
    for kind, top, lam in zip(pattern.kinds, pattern.tops, lams, strict=True):
        # Seen back from its end, a segment crosses θ = 0 after S, A, S and a period …
        whole = (kind.letter == "A") + 2 * kind.more
        for crossing in range(whole):
            part = Kind("clamped", "SA"[crossing % 2], crossing // 2)
            bumps.append(mpf(H) - abs(top * mpf(H) - measure(part, kappa, lam, p)[1]))
    return reactions, bumps


def record(topic, state, ends, P, H, kappa, lams, pattern, index):
    """The record of a root, admissible where its contacts push and its bumps stay between the walls."""
    p = thrust(P)
    reactions, bumps = slack(pattern, kappa, lams, p, H)
    good = min([*reactions, *bumps]) >= 0
    verdict = ("unstable" if index else "stable", index) if good else ()
    found = values(pattern.kinds, kappa, lams, p)
    status = "solved" if good else "inadmissible"
    return case(topic, state, ends, float(P), H, status, *verdict, **found) | {"periods": pattern.periods}
