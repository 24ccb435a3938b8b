"""Natural frequencies of a chain: its second variation weighed with the inertia of its links.

    Q(φ) = ω² Σ mass × velocity²,      η = Σ l φ (−sin θ, cos θ) from end A on,      ρA = EI = L = 1

A link of length l moves with η at its middle and turns by φ: l |η_m|² + l³φ²/12. Flat stretches move along
with what lies to their left. With that mass MᵀM (M is a running sum, O(N) to apply) and G the inverse of
the second variation on its constraints, the eigenvalues of M G Mᵀ are 1/ω²; the negative ones are as many
as the index.

It assumes what the energy method does: contacts roll and stay. The signs agree with it (Sylvester), the
values are what an experiment measures. For a constrained elastica: J.-S. Chen and W.-C. Ro, "Vibration
method in stability analysis of planar constrained elastica", in Advances in Computational Stability
Analysis, ed. S. B. Coskun, InTech, 2012, doi:10.5772/45806.

Not here: the second variation (`settings`), exact zeros (`spectrum`).
"""

import numpy as np

from elastica.chain.bordered import count_below, extreme_eigenvalues, inverse


def squared_frequencies(state, form, count):
    """The lowest ω², ascending.

    Parameters
    ----------
    state : Equilibrium
    form : QuadraticForm
        Its second variation.
    count : int

    Returns
    -------
    ndarray, shape (count,)
        NaN for those that the chain does not have.
    """
    theta, chain, middles = state.theta, state.pieces.chain, state.pieces.middles
    lengths = chain.lengths
    begins = middles - 0.5 * lengths
    # What lies flat before a piece, and after the last, goes along with the corner it begins at.
    flat = np.append(begins, 1.0) - np.append(0.0, middles + 0.5 * lengths)
    flat = np.where(np.abs(flat) > 1e-12, np.maximum(flat, 0.0), 0.0)
    root, root_flat, turn = np.sqrt(lengths), np.sqrt(flat), np.sqrt(lengths**3 / 12)
    directions = (-lengths * np.sin(theta), lengths * np.cos(theta))
    n = theta.size

    def velocities(phi):
        parts = [turn * phi]
        for direction in directions:
            step = direction * phi
            corner = np.concatenate([[0.0], np.cumsum(step)])
            parts += [root * (corner[:-1] + 0.5 * step), root_flat * corner]
        return np.concatenate(parts)

    def forces(momenta):
        own, *parts = np.split(momenta, np.cumsum([n, n, n + 1, n]))
        force = turn * own
        for direction, middle, corner in zip(directions, parts[::2], parts[1::2], strict=True):
            weight = root * middle
            beyond = np.cumsum((weight + root_flat[1:] * corner[1:])[::-1])[::-1] - 0.5 * weight
            force += direction * beyond
        return force

    apply = inverse(form)

    def compliance(phi):
        return velocities(apply(forces(phi)))

    negative = count_below(form)
    room = int((form.mass > 0).sum()) - form.constraints
    below = min(negative, room)
    inverses = extreme_eigenvalues(compliance, 5 * n + 2, below, min(count, room - below))
    values = np.full(count, np.nan)
    found = np.sort(1 / inverses)[:count]
    values[: found.size] = found
    return values
