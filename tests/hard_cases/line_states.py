"""Line states: where points become lines, where flat stretches buckle, where the lines end."""

from hard_cases.equilibria import point, values
from hard_cases.one_contact import one_point
from hard_cases.records import CC, PP, case, sides, thrust
from mpmath import mp, mpf
from references.make_states import Kind


def line_force(scaled_gap):
    """α of the segment of a line state from H√P of a clamped one (twice that of a pinned one)."""

    def gap(alpha):
        m = mp.sin(alpha / 2) ** 2
        K, E = mp.ellipk(m), mp.ellipe(m)
        return 2 * K / mp.pi * mp.sqrt(mp.cos(alpha)) * mp.sin(alpha) * (2 * E / K - 1) - scaled_gap

    # A parabola with its top at the fold.
    below = mp.sqrt(1 - scaled_gap / GAP_FOLD)
    start = ALPHA_FOLD * (1 - below)
    alpha = mp.findroot(gap, (start, start * (1 + below / 1000)), tol=mpf(10) ** -76, maxsteps=60)
    if not 0 < alpha < ALPHA_FOLD:
        raise ArithmeticError("not the shallow branch")
    return alpha


def line_length(alpha, P):
    """Length of a clamped segment of a line state; a pinned one is half of it."""
    return 2 * mp.ellipk(mp.sin(alpha / 2) ** 2) / mp.pi * mp.sqrt(mp.cos(alpha) / mpf(P))


def _fold_of_lines():
    def gap(alpha):
        m = mp.sin(alpha / 2) ** 2
        return 2 / mp.pi * mp.sqrt(mp.cos(alpha)) * mp.sin(alpha) * (2 * mp.ellipe(m) - mp.ellipk(m))

    alpha = mp.findroot(lambda a: mp.diff(gap, a), mpf("0.8336"))
    return alpha, gap(alpha)


ALPHA_FOLD, GAP_FOLD = _fold_of_lines()


def line(topic, word, ends, P, H, status, stability=None, index=None):
    """A line state with alternating word: end segments rise by H, inner ones by 2H."""
    p = thrust(P)
    root = mpf(H) * mp.sqrt(mpf(P))
    outer = line_force(root * (1 if ends == CC else 2))
    inner = line_force(2 * root) if len(word) > 1 else None
    end = Kind("clamped" if ends == CC else "pinned", "S")
    kinds = [end, *[Kind("clamped", "S")] * (len(word) - 1), end]
    lams = [p * mp.tan(alpha) for alpha in (outer, *[inner] * (len(word) - 1), outer)]
    found = values(kinds, mpf(0), lams, p)
    flat = 1 - sum(found["lengths"])
    if stability is None and status == "solved":
        stability, index = line_verdict(word, ends, flat * mp.sqrt(p) > 2 * mp.pi)
    found["lengths"] = found["lengths"][:2]
    return case(topic, word + "-", ends, P, H, status, stability, index, flat=flat, **found)


def line_verdict(word, ends, buckled):
    """Stability of a line state and its index."""
    if buckled:
        return "unstable", 1
    if ends == CC:
        return "unstable_third_order", 0
    return ("neutral_family" if len(word) > 1 else "stable"), 0


def onset(ends, H, factor):
    """Load at which flat length is `factor` − 1 times 1/√P: 1 point to line, 2 the flat stretch buckles."""
    share = 1 if ends == CC else 2

    # √P = factor − 1 + 2·(2K/π)√cos α / share, and H√P·share = gap(α).
    def room(root):
        alpha = line_force(root * mpf(H) * share)
        return (factor - 1) + 2 * line_length(alpha, 1) / share - root

    start = mpf(factor - 1) + mpf(2) / share
    return mp.findroot(room, (start * (1 - mpf(H) ** 2), start), tol=mpf(10) ** -70) ** 2


def point_to_line():
    """Point and line beside the load at which κ = 0 and nothing is left to lie flat."""
    for ends in (CC, PP):
        for H in (1e-6, 1e-3, 0.01, 0.05, 0.1, 0.2):
            load = onset(ends, H, 1)
            share = 1 if ends == CC else 2
            lam = 4 * mp.pi**2 * load * mp.tan(line_force(mpf(H) * mp.sqrt(load) * share))
            for P, side in sides(load):
                if side < 0:
                    yield one_point(
                        "point to line",
                        ends,
                        P,
                        H,
                        "solved",
                        "stable",
                        0,
                        start=(lam * (load - mpf(P)) / load, lam),
                    )
                yield line("point to line", "U", ends, P, H, "solved" if side > 0 else "inadmissible")


def pitchfork():
    """The asymmetric state beside the load at which it leaves the symmetric one, κ → 0."""
    S, A = Kind("clamped", "S"), Kind("clamped", "A")
    for H in (1e-3, 0.02, 0.05, 0.1, 0.15):
        load = onset(CC, H, 1)
        lam = 4 * mp.pi**2 * load * mp.tan(line_force(mpf(H) * mp.sqrt(load)))
        for P, side in sides(load):
            if side < 0:
                p = thrust(P)
                symmetric, _ = point([S, S], [mpf(H)] * 2, p, lam * (load - mpf(P)) / load, [lam])
                kappa, lams = point([S, A], [mpf(H)] * 2, p, 2 * symmetric, [lam, lam])
                yield case(
                    "pitchfork", "Ua", CC, P, H, "solved", "unstable", 1, **values([S, A], kappa, lams, p)
                )


def beyond_the_pitchfork():
    """Above that load there is no asymmetric state without further periods."""
    for H in (1e-3, 0.02, 0.05, 0.1, 0.15):
        for P, side in sides(onset(CC, H, 1)):
            if side > 0:
                yield case("pitchfork", "Ua", CC, P, H, "no_equilibrium")


def flat_buckles():
    """The line state beside the load at which its flat stretch buckles, p ℓ_f² = 4π²."""
    for ends in (CC, PP):
        for H in (1e-6, 0.01, 0.05, 0.1):
            for P, _ in sides(onset(ends, H, 2)):
                yield line("flat buckles", "U", ends, P, H, "solved")


def folds_of_lines():
    """Line states beside their fold at α = 47.76°."""
    for ends in (CC, PP):
        for H in (0.06, 0.1, 0.15):
            share = 1 if ends == CC else 2
            for P, side in sides((GAP_FOLD / (mpf(H) * share)) ** 2):
                if side < 0:
                    yield line("fold of lines", "U", ends, P, H, "solved")
                else:
                    yield case("fold of lines", "U-", ends, P, H, "no_equilibrium")
