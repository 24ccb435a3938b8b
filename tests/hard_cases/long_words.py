"""Alternating words with up to 50 contacts, and families with several lines, at loads up to 1e4."""

import math

from hard_cases.equilibria import point, values
from hard_cases.line_states import line
from hard_cases.records import CC, PP, case, thrust
from mpmath import mpf
from references.make_states import Kind, _Double, measure


def words():
    """Alternating words with 10 to 50 contacts, and families of lines at loads up to 1e4."""
    for contacts in (1, 2, 3, 5, 10, 20, 50):
        word = "".join("UD"[i % 2] for i in range(contacts))
        for ends in (CC, PP):
            room = contacts + (1 if ends == CC else 0)
            for P in (1.02 * room**2, (room + 0.9) ** 2, (room + 1.5) ** 2, 1e4):
                for slope in (1e-3, 0.1, 0.2):
                    H = slope / (2 * math.sqrt(P))
                    try:
                        yield (
                            line("several lines", word, ends, P, H, "solved")
                            if room**2 < 0.9 * P
                            else line_near(word, ends, P, H)
                        )
                    except Skip:
                        continue
    for contacts in (2, 10, 20, 30, 40, 50):
        for ends in (CC, PP):
            room = contacts + (1 if ends == CC else 0)
            for part in (0.5, 0.9, 0.98):
                for slope in (1e-3, 0.05, 0.3):
                    try:
                        yield alternating(contacts, ends, (part * room) ** 2, slope)
                    except Skip:
                        continue


class Skip(Exception):
    """A point where there is no such state."""


def line_near(word, ends, P, H):
    """A line state close to its onset, if there is any length to lie flat."""
    record = line("several lines", word, ends, P, H, "solved")
    if record["flat"] < 0:
        raise Skip
    return record


def alternating(contacts, ends, P, slope):
    """A long alternating word: κ by bisection of the total length, λ of each rise inside."""
    H, p = slope / (2 * math.sqrt(P)), thrust(P)
    end, inner = Kind("clamped" if ends == CC else "pinned", "S"), Kind("clamped", "S")

    def force(kind, kappa, rise):
        low, high = -float(p), float(p)
        for _ in range(48):
            middle = (low + high) / 2
            below = measure(kind, kappa, middle, float(p), _Double)[1] < rise
            low, high = (middle, high) if below else (low, middle)
        return low

    def total(kappa):
        lams = force(end, kappa, H), force(inner, kappa, 2 * H)
        ends_, inners = (
            measure(k, kappa, lam, float(p), _Double)[0] for k, lam in zip((end, inner), lams, strict=True)
        )
        return 2 * ends_ + (contacts - 1) * inners, lams

    low, high = 1e-9, math.sqrt(p)
    for _ in range(40):
        kappa = (low + high) / 2
        low, high = (kappa, high) if total(kappa)[0] > 1 else (low, kappa)
    lams = total(low)[1]
    kinds = [end, *[inner] * (contacts - 1), end]
    rises = [mpf(H), *[2 * mpf(H)] * (contacts - 1), mpf(H)]
    try:
        kappa, lams = point(kinds, rises, p, low, lams)
    except ArithmeticError:
        raise Skip from None
    word = "".join("UD"[i % 2] for i in range(contacts))
    found = values([end, inner], kappa, lams[:2], p)
    parts = [
        values([kind], kappa, [lam], p)["energy"] for kind, lam in zip((end, inner), lams[:2], strict=True)
    ]
    found["energy"] = 2 * parts[0] + (contacts - 1) * parts[1]
    pushes = lams[0] + lams[1] >= 0 and lams[1] >= 0
    if not pushes:
        return case("many contacts", word, ends, P, H, "inadmissible", None, None, **found)
    return case("many contacts", word, ends, P, H, "solved", "stable", 0, **found)
