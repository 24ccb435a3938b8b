"""A peer: the published procedure as it is usually programmed, with full matrices for everything.

Newton's method for the angles and multipliers of the published chain, then all eigenvalues of the Hessian on
the null space of its constraints. It starts from the exact state, which is in its favour.
"""

import time

import numpy as np
from scipy.linalg import eigh

from elastica.chain.published import free_links, second_variation, wall_links
from elastica.chain.spectrum import floor
from elastica.scales import FOUR_PI_SQUARED
from studies.accuracy.cases import Answer
from studies.accuracy.chain import energies, start

CONVERGED = 1e-9
MOST_STEPS = 40


def dense(case, links):
    """One state with its index and lowest eigenvalue."""
    first = start(case, links)
    frozen = wall_links(first.mesh, first.contacts, first.cuts)
    pieces = free_links(first.mesh, first.scene.ends, frozen)
    theta = np.interp(pieces.middles, first.pieces.middles, first.theta)
    state = first._replace(pieces=pieces, theta=theta)
    begin = time.perf_counter()
    state = _newton(state)
    solving = time.perf_counter() - begin
    if frozen:
        state = state._replace(cuts=np.array(frozen, float) * first.mesh.h)
    begin = time.perf_counter()
    values = _eigenvalues(second_variation(state), floor(state))
    spectrum = time.perf_counter() - begin
    bent, shorter = energies(state)
    return Answer(
        {"equilibrium": solving, "index": solving + spectrum, "eigenvalue": solving + spectrum},
        (bent - state.p * shorter) / FOUR_PI_SQUARED,
        shorter,
        int((values < 0).sum()),
        values[0],
    )


def _newton(state):
    chain, rises = state.pieces.chain, state.contacts.rises(state.scene)
    theta, lam, p = state.theta, state.lam, state.p
    for _ in range(MOST_STEPS):
        heights = chain.rises(theta) - rises
        border = chain.rise_slopes(theta)
        matrix = np.block(
            [[_full(*chain.hessian(theta, p, lam)), border], [border.T, np.zeros((rises.size,) * 2)]]
        )
        step = np.linalg.solve(matrix, -np.concatenate([chain.gradient(theta, p, lam), heights]))
        theta, lam = theta + step[: theta.size], lam + step[theta.size :]
        if np.abs(step[: theta.size]).max() <= CONVERGED * np.abs(theta).max():
            break
    return state._replace(theta=theta, lam=lam)


def _eigenvalues(form, lowest):
    """All eigenvalues above `lowest`, ascending, on the null space of the constraints.

    The contact's shift has no mass, so the pencil is solved shifted and inverted.
    """
    n, q = form.diagonal.size, form.constraints
    K = np.block(
        [[_full(form.diagonal, form.off), form.border[:, q:]], [form.border[:, q:].T, form.corner[q:, q:]]]
    )
    mass = np.zeros(K.shape[0])
    mass[:n] = form.mass
    constraints = np.vstack([form.border[:, :q], form.corner[q:, :q]])
    Z = np.linalg.qr(constraints, mode="complete")[0][:, q:]
    M = Z.T @ (mass[:, None] * Z)
    inverses = eigh(M, Z.T @ K @ Z - lowest * M, eigvals_only=True)[::-1]
    return lowest + 1 / inverses[inverses > np.finfo(float).eps * inverses[0]]


def _full(diagonal, off):
    return np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
