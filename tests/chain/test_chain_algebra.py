"""Energy, gradient and Hessian of random chains, and the O(N) algebra, against slow and simple ways."""

import casadi
import numpy as np
import pytest
from scipy.linalg import block_diag, eigh, null_space

from elastica.chain.bordered import (
    QuadraticForm,
    count_below,
    extreme_eigenvalues,
    inverse,
    lowest,
    negative_pivots,
    solve_bordered,
)
from elastica.chain.links import Chain


def random_chain(rng, n=None, segments=None):
    n = n or int(rng.integers(4, 40))
    segments = segments or int(rng.integers(1, 4))
    segment = np.sort(np.concatenate([np.arange(segments), rng.integers(0, segments, n - segments)]))
    springs = rng.uniform(0.5, 20, n - 1) * (rng.random(n - 1) > 0.1)
    lengths = rng.uniform(0.01, 0.2, n)
    chain = Chain(lengths, springs, rng.uniform(0, 5, n) * (rng.random(n) > 0.7), segment)
    return chain, rng.normal(size=n), rng.uniform(0, 50), rng.normal(0, 20, segments)


def lagrangian(chain, p, lam):
    """Derived by casadi from the formula of the potential, written out once more."""
    theta = casadi.SX.sym("theta", chain.lengths.size)
    bends = theta[1:] - theta[:-1]
    V = 0.5 * casadi.dot(chain.springs, bends**2) + 0.5 * casadi.dot(chain.holds, theta**2)
    V -= p * casadi.dot(chain.lengths, 1 - casadi.cos(theta))
    L = V + casadi.dot(lam[chain.segment] * chain.lengths, casadi.sin(theta))
    hessian, gradient = casadi.hessian(L, theta)
    return casadi.Function("L", [theta], [V, gradient, hessian])


def random_form(rng, n=None, definite=False):
    n = n or int(rng.integers(6, 60))
    q, free = int(rng.integers(0, 4)), int(rng.integers(0, 2))
    off = -rng.uniform(0.1, 3, n - 1)
    diagonal = rng.normal(1, 3, n) + (15 if definite else 0)
    border = rng.normal(size=(n, q + free))
    corner = np.zeros((q + free, q + free))
    if free:
        corner[-1] = corner[:, -1] = rng.normal(size=q + free)
    return QuadraticForm(diagonal, off, border, corner, q, rng.uniform(0.1, 1, n))


def dense(form):
    """The form on the null space of its constraints: stiffness and mass; massless variables come last."""
    n, q = form.diagonal.size, form.constraints
    T = np.diag(form.diagonal) + np.diag(form.off, 1) + np.diag(form.off, -1)
    K = np.block([[T, form.border[:, q:]], [form.border[:, q:].T, form.corner[q:, q:]]])
    constraints = np.vstack([form.border[:, :q], form.corner[q:, :q]])
    Z = null_space(constraints.T) if q else np.eye(K.shape[0])
    M = block_diag(np.diag(form.mass), np.zeros((K.shape[0] - n,) * 2))
    return Z.T @ K @ Z, Z.T @ M @ Z


def test_derivatives_of_random_chains_are_those_of_the_potential(rng, full):
    for _ in range(300 if full else 30):
        chain, theta, p, lam = random_chain(rng)
        V, gradient, hessian = (np.array(m) for m in lagrangian(chain, p, lam)(theta))
        diagonal, off = chain.hessian(theta, p, lam)
        assert chain.bending_energy(theta) - p * chain.shortening(theta) == pytest.approx(V.item(), rel=1e-12)
        assert chain.gradient(theta, p, lam) == pytest.approx(gradient.ravel(), rel=1e-12, abs=1e-10)
        T = np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
        assert pytest.approx(hessian, rel=1e-12, abs=1e-10) == T
        step = 1e-30j * np.eye(theta.size)
        rises = [np.bincount(chain.segment, (chain.lengths * np.sin(theta + d)).imag) for d in step]
        assert chain.rise_slopes(theta) == pytest.approx(np.array(rises) / 1e-30, rel=1e-12, abs=1e-12)


def test_inertia_of_random_forms_is_that_of_the_dense_matrix(rng, full):
    for _ in range(2000 if full else 200):
        form = random_form(rng)
        K, _ = dense(form)
        values = np.linalg.eigvalsh(K)
        if np.abs(values).min() > 1e-6:
            assert count_below(form) == (values < 0).sum()


def test_a_sturm_count_survives_decoupled_and_long_chains(rng):
    diagonal, off = rng.normal(size=100_000), rng.normal(size=99_999)
    off[::7] = 0.0
    blocks = np.split(np.arange(100_000), np.flatnonzero(off == 0)[:200] + 1)[:200]
    count = sum(
        (
            np.linalg.eigvalsh(np.diag(diagonal[b]) + np.diag(off[b[:-1]], 1) + np.diag(off[b[:-1]], -1)) < 0
        ).sum()
        for b in blocks
    )
    last = blocks[-1][-1] + 1
    assert negative_pivots(diagonal[:last], off[: last - 1]) == count


def test_bordered_systems_are_solved(rng):
    for _ in range(50):
        n, q = int(rng.integers(5, 50)), int(rng.integers(0, 5))
        diagonal, off = rng.normal(size=n), rng.normal(size=n - 1)
        columns, rows, corner = rng.normal(size=(n, q)), rng.normal(size=(q, n)), rng.normal(size=(q, q))
        T = np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
        f, g = rng.normal(size=n), rng.normal(size=q)
        x, y = solve_bordered(diagonal, off, columns, rows, corner, f, g)
        assert T @ x + columns @ y == pytest.approx(f, abs=1e-7)
        assert rows @ x + corner @ y == pytest.approx(g, abs=1e-7)


@pytest.mark.parametrize("n", [20, 150])
def test_lowest_eigenvalues_are_those_of_the_dense_pencil(rng, full, n):
    for _ in range(100 if full else 20):
        form = random_form(rng, n)
        K, M = dense(form)
        if form.constraints < form.corner.shape[0]:
            # A variable without mass makes the dense pencil singular: compare counts instead.
            shifts = rng.normal(0, 5, 5)
            assert [count_below(form, s) for s in shifts] == [
                (np.linalg.eigvalsh(K - s * M) < 0).sum() for s in shifts
            ]
            continue
        values = eigh(K, M, eigvals_only=True)
        for floor in (values[0] - 3, values[2] + 1e-3):
            assert lowest(form, floor, 5) == pytest.approx(values[:5], rel=1e-8, abs=1e-8)


def test_a_chain_has_no_more_eigenvalues_than_it_has_freedoms(rng):
    form = random_form(rng, 6)._replace(border=np.ones((6, 1)), corner=np.zeros((1, 1)), constraints=1)
    assert np.isnan(lowest(form, -100.0, 9)).sum() == 4


def test_the_inverse_obeys_the_constraints(rng):
    form = random_form(rng, 30)._replace(
        border=rng.normal(size=(30, 2)), corner=np.zeros((2, 2)), constraints=2
    )
    x = inverse(form)(rng.normal(size=30))
    assert form.border.T @ x == pytest.approx(0, abs=1e-9)


def test_lanczos_finds_both_ends_of_a_spectrum(rng):
    A = rng.normal(size=(200, 200))
    A = A + A.T
    values = np.linalg.eigvalsh(A)
    found = np.sort(extreme_eigenvalues(A.__matmul__, 200, 2, 3))
    assert found == pytest.approx(np.concatenate([values[:2], values[-3:]]), rel=1e-9)
