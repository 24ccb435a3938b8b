import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elastica.pendulum.segments import (
    HALF,
    Kind,
    arc,
    bending_energy,
    length,
    load_slopes,
    pendulum,
    rise,
    shortening,
    steepest,
)

KINDS = {
    "S": Kind(0, 1),
    "A": Kind(-1, 1),
    "pinned S": Kind(HALF, 1),
    "pinned A": Kind(-HALF, 1),
    "S with a further period": Kind(-2, 1),
    "A with a further period": Kind(-3, 1),
    "two half periods": Kind(HALF - 2, HALF),
    "S from a spring": Kind(0, 1, 20.0),
    "A from a spring": Kind(-1, 1, 20.0),
    "A from a soft spring": Kind(-1, 1, 1e-9),
    "S from a stiff spring": Kind(0, 1, 1e9),
    "free shape between springs": Kind(-1, 1, 3.0, 50.0),
}


@pytest.mark.parametrize(
    ("name", "first", "second", "turning_points"),
    [
        ("S", 2, 2, 1),
        ("A", 4, 0, 2),
        ("pinned S", 1, 1, 1),
        ("pinned A", 3, 1, 2),
        ("S with a further period", 6, 2, 3),
        ("A with a further period", 8, 0, 4),
        ("two half periods", 4, 0, 3),
    ],
)
def test_a_kind_follows_from_its_ends(name, first, second, turning_points):
    kind = KINDS[name]
    assert (kind.first, kind.second, kind.turning_points) == (first, second, turning_points)


def start(kind, q):
    """Angle and curvature where a segment starts."""
    if np.isfinite(kind.start_spring):
        end = arc(kind, q).spring_ends[0]
        return end.sigma * end.angle, 2 * end.sigma * q.r * np.sqrt(q.m) * end.cos
    if kind.start == int(kind.start):
        return 0.0, q.kappa if int(kind.start) % 2 == 0 else -q.kappa
    upper = int(kind.start - HALF) % 2 == 0
    return q.alpha + (q.swing if upper else -q.swing), 0.0


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_closed_form_agrees_with_integration_of_the_differential_equation(kind, rng):
    for _ in range(6):
        p = rng.uniform(2, 150)
        lam, kappa = rng.uniform(-0.9, 0.9) * p, rng.uniform(0.05, 1.3) * np.sqrt(p)
        q = pendulum(p, kappa, lam)

        def strip(s, z, p=p, lam=lam):
            theta, curvature = z[:2]
            bend = -p * np.sin(theta) + lam * np.cos(theta)
            return [curvature, bend, np.sin(theta), 1 - np.cos(theta), curvature**2 / 2]

        piece = arc(kind, q)
        ends = [*start(kind, q), 0, 0, 0]
        run = solve_ivp(strip, (0, length(piece)), ends, method="DOP853", rtol=1e-12, atol=1e-13)
        theta, curvature, height, shorter, bending = run.y[:, -1]
        springs = 0.5 * sum(end.c * end.angle**2 for end in piece.spring_ends)
        if np.isfinite(kind.end_spring):
            assert curvature == pytest.approx(-kind.end_spring * theta, abs=1e-7)
        elif kind.end == 1:
            assert theta == pytest.approx(0, abs=1e-8)
            assert curvature == pytest.approx(-kappa, abs=1e-7)
        else:
            assert curvature == pytest.approx(0, abs=1e-7)
        assert rise(piece) == pytest.approx(height, abs=1e-9)
        assert shortening(piece) == pytest.approx(shorter, abs=1e-9)
        assert bending_energy(piece) == pytest.approx(bending + springs, rel=1e-8)
        assert steepest(kind, q) >= np.abs(run.y[0]).max() - 1e-9


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_derivatives_agree_with_differences(kind, rng):
    p = rng.uniform(2, 150, 200)
    lam, kappa = rng.uniform(-0.9, 0.9, 200) * p, rng.uniform(0.05, 1.3, 200) * np.sqrt(p)
    slopes = load_slopes(arc(kind, pendulum(p, kappa, lam)))
    h = 1e-5

    def slope(quantity, step):
        up, down = (arc(kind, pendulum(*step(change))) for change in (h, -h))
        return (quantity(up) - quantity(down)) / (2 * h)

    for name, quantity in (("length", length), ("rise", rise), ("shorter", shortening)):
        for variable, step in (
            ("kappa", lambda change: (p, kappa + change, lam)),
            ("lam", lambda change: (p, kappa, lam + change)),
            ("load", lambda change: (p * np.exp(change), kappa * np.exp(change / 2), lam * np.exp(change))),
        ):
            expected = slope(quantity, step)
            own = slopes.geometry if hasattr(slopes.geometry, f"{name}_{variable}") else slopes
            assert getattr(own, f"{name}_{variable}") == pytest.approx(expected, rel=2e-6, abs=1e-8)


def test_small_deflections_keep_their_digits():
    """A shallow line segment: ℓ = 2π/√p, d = λℓ/p, ΔL = ∫θ²/2 with θ = (λ/p)(1 − cos √p s)."""
    p = 40.0
    for lam in 10.0 ** -np.arange(3.0, 9):
        q = pendulum(np.array([p]), np.zeros(1), np.array([lam]))
        ell = 2 * np.pi / np.sqrt(p)
        piece = arc(KINDS["S"], q)
        assert length(piece) == pytest.approx(ell, rel=1e-3 * lam + 1e-15)
        assert rise(piece) == pytest.approx(lam * ell / p, rel=1e-3 * lam + 1e-14)
        assert shortening(piece) == pytest.approx(0.75 * (lam / p) ** 2 * ell, rel=1e-3 * lam + 1e-13)
