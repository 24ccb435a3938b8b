"""Index, nullity and verdict of a chain, with what its links cannot tell set apart.

An eigenvalue of the chain differs from that of the strip by the setting's truncation, for waves of q² = F,
F = √(p² + λ²); rounding moves it by some ε N². Within this tolerance of zero a sign means nothing:

* a line state has exact zeros, φ = θ' on each full period between a clamp or a line and a line. As many
  eigenvalues within the tolerance are these; their sign in the chain is that of an O(h³) error. The verdict
  on them is that of the strip: beside a clamp unstable at third order, between lines a neutral family. A
  strip that is not uniform has none.
* any other eigenvalue in there is `critical`.

A flat stretch buckles off the wall when the pooled flat links, clamped at both ends, have a negative
direction. Free segments of length ℓ are shorter than those of the strip by ℓq²h²/24, as the chain's waves run
ahead, which leaves more to lie flat.

Not here: the second variation (`settings`), its eigenvalues themselves (`spectrum`).
"""

import numpy as np

from elastica.chain.bordered import QuadraticForm, count_below
from elastica.codes import Stability
from elastica.control import LOAD
from elastica.stability.index import Verdict, verdict

ROUNDING_PER_LINK = 8 * np.finfo(float).eps
FREE_LENGTH_SAFETY = 4.0
"""Multiple of ℓq²h²/24 for the shortening of free segments, which grows next to the fold of line states."""


def judge(state, setting, control=LOAD):
    """The verdict on a chain in equilibrium.

    Parameters
    ----------
    state : Equilibrium
    setting : Setting
    control : Control

    Returns
    -------
    Verdict
    """
    form = setting.second_variation(state, control=control)
    slack = tolerance(state, setting)
    index = count_below(form, -slack)
    nullity = count_below(form, slack) - index
    zeros, at_clamps = exact_zeros(state)
    critical = nullity != zeros
    if state.contacts.line:
        flat = _flat_links(state)
        bounds = _flat_bounds(state, slack)
        sure, possible = (flat.mass.size > 2 and count_below(flat, bound) > 0 for bound in bounds)
        index += sure
        nullity += possible != sure
        critical |= possible != sure
    elif state.contacts.walls and not setting.resolves_contacts(state):
        # A contact about to become a line: negative eigenvalues may be artefacts too.
        return Verdict(index, max(nullity, 1), Stability.CRITICAL)
    nullity = max(nullity, zeros + int(critical))
    code = verdict(np.array(index), critical, third_order=at_clamps > 0, family=zeros > at_clamps)
    return Verdict(index, nullity, Stability(int(code)))


def tolerance(state, setting):
    """What an eigenvalue has to differ from zero by for its sign to count."""
    rounding = ROUNDING_PER_LINK * state.mesh.links**2 * state.mesh.stiffness.max()
    return setting.truncation(state) + rounding


def exact_zeros(state):
    """Number of exact zeros of the strip in this state, and how many of them stand beside a clamp."""
    if not state.contacts.line or not state.mesh.profile.uniform:
        return 0, 0
    at_clamps = sum(end.clamped for end in state.scene.ends)
    return at_clamps + len(state.contacts.walls) - 1, at_clamps


def _flat_bounds(state, slack):
    """Eigenvalues of the flat stretch below which it has surely buckled, and may have: it may be longer."""
    flat = float(np.sum(state.cuts[1::2] - state.cuts[::2]))
    shift = FREE_LENGTH_SAFETY * slack / (2 * state.resultant) * (1 - flat)
    shorter, here, longer = (
        (2 * np.pi / max(length, state.mesh.h)) ** 2 for length in (flat - shift, flat, flat + shift)
    )
    return here - shorter - slack, here - longer + slack


def _flat_links(state):
    """The second variation of all flat stretches, put together into one that is clamped at both ends."""
    mesh, cuts = state.mesh, state.cuts
    nodes = np.arange(mesh.links + 1) * mesh.h
    lengths, stiffness = [], []
    for begin, end in zip(cuts[::2], cuts[1::2], strict=True):
        bounds = np.concatenate([[begin], nodes[(nodes > begin) & (nodes < end)], [max(begin, end)]])
        lengths.append(np.diff(bounds))
        middles = 0.5 * (bounds[:-1] + bounds[1:])
        stiffness.append(mesh.stiffness[np.minimum((middles * mesh.links).astype(int), mesh.links - 1)])
    lengths, stiffness = np.concatenate(lengths), np.concatenate(stiffness)
    half = np.maximum(lengths, np.finfo(float).eps) / (2 * stiffness)
    springs = 1 / (half[:-1] + half[1:])
    diagonal = -state.p * lengths
    diagonal[1:] += springs
    diagonal[:-1] += springs
    diagonal[0] += 1 / half[0]
    diagonal[-1] += 1 / half[-1]
    return QuadraticForm(diagonal, -springs, lengths[:, None], np.zeros((1, 1)), 1, lengths)
