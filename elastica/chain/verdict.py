"""Index, nullity and verdict of a chain, with what its links cannot tell set apart.

An eigenvalue of the chain differs from that of the strip by about q⁴h²/12 for waves of q² = F, F = √(p² +
λ²) (the first term that a second difference leaves out), in the published setting by a part √F h of F;
rounding moves it by some ε N². Within this tolerance of zero a sign means nothing:

* a line state has exact zeros, φ = θ' on each full period between a clamp or a line and a line. As many
eigenvalues within
  the tolerance are these; their sign in the chain is that of an O(h³) error. The verdict on them is that of
  the strip: beside a clamp unstable at third order, between lines a neutral family. A strip that is not
  uniform has none.
* any other eigenvalue in there is `critical`.

A flat stretch buckles off the wall when the pooled flat links, clamped at both ends, have a negative
direction. Free segments of length ℓ are shorter than those of the strip by ℓq²h²/24, as the chain's waves run
ahead, which leaves more to lie flat.
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.bordered import Bordered, count_below
from elastica.chain.published import published_variation
from elastica.chain.second_variation import contact_curvatures, second_variation
from elastica.codes import Stability
from elastica.stability.index import verdict

ROUNDING_PER_LINK = 8 * np.finfo(float).eps
FIRST_ORDER = 1 / 4
"""Part of √F h by which published eigenvalues are off, as seen at asymmetric states."""
UNRESOLVED_CURVATURE = 2.0
"""κ in units of λh below which published links cannot tell a shift of the contact from a turn."""
SECOND_ORDER = 1 / 12
FREE_LENGTH_SAFETY = 4.0
"""Multiple of ℓq²h²/24 for the shortening of free segments, which grows next to the fold of line states."""


class Verdict(NamedTuple):
    """Index, nullity and `Stability` code."""

    index: int  # type: ignore[assignment]  # hides tuple.index
    nullity: int
    stability: Stability


def judge(state, published=False, fixed_shortening=False):
    """The verdict on a chain in equilibrium.

    Parameters
    ----------
    state : Equilibrium
    published : bool
    fixed_shortening : bool

    Returns
    -------
    Verdict
    """
    vary = published_variation if published else second_variation
    form = vary(state, fixed_shortening=fixed_shortening)
    slack = tolerance(state, published)
    index = count_below(form, -slack)
    nullity = count_below(form, slack) - index
    uniform = state.strip.profile.uniform
    zeros, at_clamps = exact_zeros(state) if uniform else (0, 0)
    critical = nullity != zeros
    if state.pattern.line:
        flat = _flat_links(state)
        bounds = _flat_bounds(state, slack)
        sure, possible = (flat.mass.size > 2 and count_below(flat, bound) > 0 for bound in bounds)
        index += sure
        nullity += possible != sure
        critical |= possible != sure
    elif state.pattern.walls and not _resolved(state, published):
        # A contact about to become a line: negative eigenvalues may be artefacts too.
        return Verdict(index, max(nullity, 1), Stability.CRITICAL)
    nullity = max(nullity, zeros + int(critical))
    code = verdict(np.array(index), critical, third_order=at_clamps > 0, family=zeros > at_clamps)
    return Verdict(index, nullity, Stability(int(code)))


def resultant(state):
    """Largest force F = √(p² + λ²) in a segment."""
    return float(np.hypot(state.p, state.lam).max(initial=0.0))


def tolerance(state, published):
    """What an eigenvalue has to differ from zero by for its sign to count."""
    F, h, softest = resultant(state), state.strip.h, state.strip.stiffness.min()
    truncation = (
        FIRST_ORDER * np.sqrt(F / softest) * h * F if published else SECOND_ORDER * F**2 * h**2 / softest
    )
    return truncation + ROUNDING_PER_LINK * state.strip.links**2 * state.strip.stiffness.max()


def exact_zeros(state):
    """Number of exact zeros of a uniform strip in this state, and how many of them stand beside a clamp."""
    if not state.pattern.line:
        return 0, 0
    at_clamps = sum(end.clamped for end in state.strip.ends)
    return at_clamps + len(state.pattern.walls) - 1, at_clamps


def _resolved(state, published):
    """Whether the chain can tell the curvature at its contacts from zero."""
    F, h = resultant(state), state.strip.h
    if published:
        turn = min(abs(state.theta[place]) for place in (state.pieces.last[0], state.pieces.first[1]))
        return turn / h > UNRESOLVED_CURVATURE * np.abs(state.lam).max() * h
    return (
        np.abs(contact_curvatures(state)).min() > SECOND_ORDER * np.abs(state.lam).max() * np.sqrt(F) * h**2
    )


def _flat_bounds(state, slack):
    """Eigenvalues of the flat stretch below which it has surely buckled, and may have: it may be longer."""
    flat = float(np.sum(state.cuts[1::2] - state.cuts[::2]))
    shift = FREE_LENGTH_SAFETY * slack / (2 * resultant(state)) * (1 - flat)
    shorter, here, longer = (
        (2 * np.pi / max(length, state.strip.h)) ** 2 for length in (flat - shift, flat, flat + shift)
    )
    return here - shorter - slack, here - longer + slack


def _flat_links(state):
    """The second variation of all flat stretches, put together into one that is clamped at both ends."""
    strip, cuts = state.strip, state.cuts
    nodes = np.arange(strip.links + 1) * strip.h
    lengths, stiffness = [], []
    for begin, end in zip(cuts[::2], cuts[1::2], strict=True):
        bounds = np.concatenate([[begin], nodes[(nodes > begin) & (nodes < end)], [max(begin, end)]])
        lengths.append(np.diff(bounds))
        middles = 0.5 * (bounds[:-1] + bounds[1:])
        stiffness.append(strip.stiffness[np.minimum((middles * strip.links).astype(int), strip.links - 1)])
    lengths, stiffness = np.concatenate(lengths), np.concatenate(stiffness)
    half = np.maximum(lengths, np.finfo(float).eps) / (2 * stiffness)
    springs = 1 / (half[:-1] + half[1:])
    diagonal = -state.p * lengths
    diagonal[1:] += springs
    diagonal[:-1] += springs
    diagonal[0] += 1 / half[0]
    diagonal[-1] += 1 / half[-1]
    return Bordered(diagonal, -springs, lengths[:, None], np.zeros((1, 1)), 1, lengths)
