"""Is a state a minimum? The energy of a chain at growing distance from it decides.

On the sphere of radius r around the shape of a state, √(∫δθ² ds) = r, the lowest energy E(r) that IPOPT finds
between the walls rises with r around a minimum and falls otherwise. Its slope is even a measurement: to
second order E(r) = E(0) + ½ω r²/4π², ω the lowest eigenvalue of the second variation with moving contacts.
"""

from typing import NamedTuple

import numpy as np
from brute_force.chain import minimise

import elastica
from elastica import Stability, Status

ENDS = ("clamped-clamped", "clamped-pinned", "pinned-clamped", "pinned-pinned", "0.3/2.5", "clamped/0.05")
LINKS = ((200, 400), (800, 1600))
"""Two resolutions must say the same; if they do not, the finer pair is asked, nearer to the state."""
RADII = (np.array([0.025, 0.05, 0.1]), np.array([0.00625, 0.0125, 0.025]))
"""Distances in units of the root mean square of θ (of H for the straight strip)."""
DIRECTIONS, WAVES = 3, 12
RESOLVED = 2.0
"""Lowest eigenvalue of a stable state whose well is wide enough for these chains and distances.

Close to the load at which a clamped strip's point becomes a line, energy falls with the cube of the distance,
and the width of the well goes to zero with the eigenvalue.
"""
UNSTABLE = (Stability.UNSTABLE, Stability.UNSTABLE_THIRD_ORDER)


class Landscape(NamedTuple):
    """What the chains say: `verdict` is 1 for a minimum, −1 for none, 0 for undecided.

    The `slopes` (2, 2) measure ω with two numbers of `links`, each between three radii.
    """

    verdict: int
    slopes: np.ndarray
    links: tuple


def angles(solution, n):
    """Angles of a solved state at the middles of n links.

    Several lines share their flat length freely. All of it is put on the first wall here, because the verdict
    on such a family is that on its least stable member.
    """
    theta = solution.shape(2 * n + 1).theta[1::2]
    flat, contacts = float(solution.flat_length), len(solution.state.word)
    if not solution.state.line or contacts == 1:
        return theta
    first, s = float(solution.lengths[0]), (np.arange(n) + 0.5) / n
    fine = solution.shape(50 * n + 1)
    lies = np.zeros(fine.s.size, bool)
    for begin in solution.contact_position:
        lies |= (fine.s > begin) & (fine.s < begin + flat / contacts)
    bent = np.interp(np.where(s < first, s, s - flat), np.arange((~lies).sum()) / (50 * n), fine.theta[~lies])
    return np.where((s > first) & (s < first + flat), 0.0, bent)


def size(theta, H):
    """Scale of a state's angles: their root mean square, or H where they vanish."""
    return np.sqrt(np.mean(theta**2)) or H


def smooth(rng, n):
    """Random smooth angles with root mean square 1."""
    waves = np.cos(np.pi * np.outer(np.arange(WAVES), (np.arange(n) + 0.5) / n))
    direction = rng.normal(size=WAVES) @ waves
    return direction / np.sqrt(np.mean(direction**2))


def lowest_around(solution, n, radii, rng):
    """Lowest energy of a chain of n links on spheres around a state; NaN where IPOPT found nothing."""
    P, H, ends = float(solution.P), float(solution.H), str(solution.ends)
    centre = angles(solution, n)
    directions = [sign * smooth(rng, n) for _ in range(DIRECTIONS) for sign in (1, -1)]
    lowest = []
    for r in radii:
        found = [
            minimise(centre + r * direction, P, H, ends, centre=centre, distance=(r, r))
            for direction in directions
        ]
        found = [minimum for minimum in found if minimum.success]
        best = min(found, key=lambda minimum: minimum.energy, default=None)
        lowest.append(best.energy if best else np.nan)
        if best:
            directions = [*directions[: 2 * DIRECTIONS], (best.theta - centre) / r]
    return np.array(lowest)


def landscape(solution, rng):
    """Tell whether a solved state is a minimum of the chain's energy, at scales that the chain resolves.

    Returns
    -------
    Landscape
    """
    for links, relative in zip(LINKS, RADII, strict=True):
        radii = relative * size(angles(solution, links[-1]), float(solution.H))
        rises = [np.diff(lowest_around(solution, n, radii, rng)) for n in links]
        slopes = 8 * np.pi**2 * np.array(rises) / np.diff(radii**2)
        verdict = 1 if (slopes > 0).all() else -1 if (slopes < 0).all() else 0
        if verdict:
            break
    return Landscape(verdict, slopes, links)


def random_state(rng, verdicts, most_contacts=3, points=8):
    """Draw ends, a name, loads and gaps until a verdict asked for turns up; no slope may pass 90°."""
    while True:
        ends = str(rng.choice(ENDS))
        names = elastica.states(ends, most_contacts)
        name = str(rng.choice(names))
        P, H = rng.uniform(0.1, 12, points), rng.uniform(0.02, 0.15, points)
        drawn = elastica.solve(name, P=P, H=H, ends=ends)
        solved = (drawn.status == Status.SOLVED) & (drawn.max_slope < np.pi / 2)
        fits = np.flatnonzero(solved & np.isin(drawn.stability, verdicts))
        if fits.size:
            solution = elastica.solve(name, P=P[fits[0]], H=H[fits[0]], ends=ends)
            if solution.stability != Stability.STABLE or solution.eigenvalues(1)[0] > RESOLVED:
                return solution


def describe(solution):
    """State, place and verdict in one line."""
    verdict = Stability(int(solution.stability)).name.lower()
    place = f"P={float(solution.P)!r}, H={float(solution.H)!r}, ends={str(solution.ends)!r}"
    return f"{solution.state.name!r}, {place}: {verdict}, index {int(solution.index)}"


def verdict_agrees(rng, stable):
    """Compare the verdict on a random state with the landscape around it.

    Parameters
    ----------
    rng : numpy.random.Generator
    stable : bool
        Whether to draw a stable or an unstable state.

    Returns
    -------
    agrees : bool
    description : str
    """
    solution = random_state(rng, (Stability.STABLE,) if stable else UNSTABLE)
    seen = landscape(solution, rng)
    measured = np.array2string(seen.slopes.ravel(), precision=4)
    expected = float(solution.eigenvalues(1)[0])
    text = f"{describe(solution)}, eigenvalue {expected:.4g}; chains of {seen.links} links measure {measured}"
    return seen.verdict == (1 if stable else -1), text


def energy_error(solution, n):
    """Bound, found by trial, of the error of a chain's energy: p/4n² times the energy of bending."""
    return np.pi**2 * float(solution.P) * float(solution.bending_energy) / n**2 + 1e-12


def disturbed_at_shortening(rng, stable, n=400, nudge=0.02, nearby=0.05, attempts=3):
    """Disturb a random state at its own shortening and let the chain find a minimum.

    From a stable state it must come back to the same bending energy, from an unstable one leave for a
    lower one.

    Parameters
    ----------
    rng : numpy.random.Generator
    stable : bool
        Whether to draw a state that is stable at prescribed shortening or one that is not.

    Returns
    -------
    agrees : bool
    description : str
    """
    while True:
        ends = str(rng.choice(ENDS[:4]))
        name = str(rng.choice([*elastica.states(ends, 1)[1:], "UD", "UU", "UDa"]))
        H = rng.uniform(0.03, 0.1)
        prescribed = rng.uniform(0.3, 8, 8) * H**2
        drawn = elastica.solve(name, shortening=prescribed, H=H, ends=ends)
        good = (drawn.status == Status.SOLVED) & (drawn.max_slope < np.pi / 2) & (drawn.P < 20)
        good &= drawn.stability == (Stability.STABLE if stable else Stability.UNSTABLE)
        if good.any():
            break
    solution = elastica.solve(name, shortening=prescribed[good][0], H=H, ends=ends)
    exact = angles(solution, n)
    scale, shorter = size(exact, H), float(solution.shortening)
    bending, bound = float(solution.bending_energy), 4 * energy_error(solution, n)
    text = f"{describe(solution)} at shortening {shorter!r}:"
    back, left = [], []
    for _ in range(attempts):
        found = minimise(exact + nudge * scale * smooth(rng, n), None, H, ends, shorter=shorter)
        away = np.sqrt(np.mean((found.theta - exact) ** 2)) / scale
        error = found.energy - bending
        back.append(found.success and abs(error) <= bound and away < nearby)
        left.append(found.success and error < -bound and away > nearby)
        text += f" energy off by {error:.2e} (bound {bound:.1e}), angles by {away:.1e};"
    return (all(back) if stable else any(left)), text


def returns(rng, n=400, nudge=0.02, nearby=0.05):
    """Disturb a random stable state and let the chain find its minimum, free of any sphere.

    The disturbance is `nudge` of the state's own angles, and it must come back to within `nearby` of them.

    Returns
    -------
    back : bool
    description : str
    """
    solution = random_state(rng, (Stability.STABLE,))
    P, H, ends = float(solution.P), float(solution.H), str(solution.ends)
    exact = angles(solution, n)
    scale = size(exact, H)
    found = minimise(exact + nudge * scale * smooth(rng, n), P, H, ends)
    away = np.sqrt(np.mean((found.theta - exact) ** 2)) / scale
    error = found.energy - float(solution.energy)
    bound = energy_error(solution, n)
    text = f"{describe(solution)}; energy off by {error:.2e} (bound {bound:.1e}), angles by {away:.1e}"
    return found.success and abs(error) <= bound and away < nearby, text
