"""Solve a named state on arrays of load and gap, and everything a user asks of the result.

Eigenvalues and shapes are computed only when asked for.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from elastica.codes import Stability, Status
from elastica.control import read_control
from elastica.ends import Ends, parse_ends
from elastica.equilibria.buckled import unresolved_load
from elastica.equilibria.euler import euler_root
from elastica.equilibria.roots import find, of_root
from elastica.equilibria.shortening_control import Targets
from elastica.inputs import broadcast
from elastica.properties import bent, straight
from elastica.rows import described
from elastica.scales import FOUR_PI_SQUARED
from elastica.scene import Scene
from elastica.spelling import did_you_mean
from elastica.state import Segment, State, parse_state

if TYPE_CHECKING:
    from elastica.shapes import Shape
    from elastica.stability.spectrum import Conventional

LARGEST_LOAD = 1e6
SMALLEST_GAP = 1e-50
"""Energies, of the order of H², leave the range of numbers below some 1e-150."""
SMALLEST_SHORTENING = 1e-11
"""Besides 0: below some 1e-12 a shortening is lost in the rounding of the length, and states with it."""
METHODS = ("exact", "chain")


@dataclass(frozen=True, eq=False)
class Solution:
    """A state on an array of points; every array has the broadcast shape (...) of P and H first.

    All quantities are dimensionless (lengths by L, P by 4π²EI/L², energies by 4π²EI/L, curvatures by
    1/L). What does not exist is NaN, or −1 in the flags.

    Attributes
    ----------
    state, ends : State, Ends
    control : str
        "P" or "shortening": what is prescribed. Stability is that under this control.
    P, H : ndarray, shape (...)
    status : ndarray of int8
        Codes of `Status`.
    stability : ndarray of int8
        Codes of `Stability`, 0 is STABLE; −1 where the status is not solved. `stable` says it with a bool.
    index, nullity : ndarray of int16
        Numbers of strictly negative directions and of exact zeros of the second variation; −1 where
        not solved.
    curvature : ndarray
        |θ'| where θ = 0, shared by contacts and clamped ends; 0 for lines and the straight strip.
    energy, bending_energy, shortening, flat_length, max_slope, clearance : ndarray
        Total potential, its bending part, ΔL, length lying flat, max |θ| in radians, H − max |y| over
        interior extrema that are not contacts.
    reaction, contact_position : ndarray, shape (..., contacts)
        μ/4π² and arc length of each contact; of a line the sum of its end forces and its beginning.
    error : ndarray
        Bound of max(|δκ|/√p, |δℓ|, |δV|/|V|).
    lam, lengths : ndarray, shape (..., segments)
        λ (EI/L² = 1, each in its rising convention) and length of the free segments from A to B.
    periods : ndarray of int8, shape (..., segments)
        Extra full periods that each free segment has.
    reasons : dict of int to str
        Why a point failed, by its flat index.
    """

    state: State
    ends: Ends
    control: str
    P: np.ndarray
    H: np.ndarray
    status: np.ndarray
    stability: np.ndarray
    index: np.ndarray
    nullity: np.ndarray
    curvature: np.ndarray
    energy: np.ndarray
    bending_energy: np.ndarray
    shortening: np.ndarray
    flat_length: np.ndarray
    max_slope: np.ndarray
    clearance: np.ndarray
    reaction: np.ndarray
    contact_position: np.ndarray
    error: np.ndarray
    lam: np.ndarray
    lengths: np.ndarray
    periods: np.ndarray
    reasons: dict[int, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """What is known at the first points, with names of codes."""
        return described(self)

    @property
    def stable(self) -> np.ndarray:
        """Where the state is solved and stable: bool, shape (...)."""
        return self.stability == Stability.STABLE

    def patterns(self, points: np.ndarray) -> Iterator[tuple[np.ndarray, tuple[Segment, ...]]]:
        """Divide points, given by their flat indices, by the segments that the state has there.

        Yields
        ------
        points : ndarray of int
        segments : tuple of Segment
            From end A to end B.
        """
        if not points.size:
            return
        periods = self.periods.reshape(self.status.size, -1)[points]
        patterns, member = np.unique(periods, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            yield points[member.ravel() == number], self.state.segments(self.ends, pattern)

    def eigenvalues(self, count: int) -> np.ndarray:
        """The `count` lowest eigenvalues of the second variation, shape (..., count).

        Ascending, with weight ∫φ² ds (EI = L = 1), exact zeros as 0.0; of a line state those of its
        free segments; at prescribed shortening on the φ that keep it. NaN where the state is not solved.
        """
        from elastica.stability.spectrum import eigenvalues

        return eigenvalues(self, count, self.control == "shortening")

    def frequencies(self, count: int) -> np.ndarray:
        """The `count` lowest natural frequencies with contacts free to move, shape (..., count).

        sign(ω²) √|ω²|, ascending, in units of √(EI/ρA)/L²; exact zeros as 0.0, NaN where the state is not
        solved.
        """
        from elastica.stability.vibration import frequencies

        return frequencies(self, count, self.control == "shortening")

    def conventional(self, count: int = 1) -> "Conventional":
        """The verdict of the conventional energy method, which holds each contact at its material point.

        It is the verdict at constant load, also where the shortening is prescribed.

        Returns
        -------
        Conventional
            `eigenvalues` (..., count) and `index` (...), NaN and −1 where not solved; `stable` (...), bool.
        """
        from elastica.stability.spectrum import conventional

        return conventional(self, count)

    def shape(self, samples: int) -> "Shape":
        """Points of the strip at `samples` equidistant arc lengths.

        Returns
        -------
        Shape
            Fields s (samples,), theta, x, y (..., samples); NaN where there is no equilibrium.
        """
        from elastica.shapes import sample

        return sample(self, samples)


def solve(
    state: str,
    *,
    P: ArrayLike | None = None,
    H: ArrayLike | None = None,
    ends: str | Ends = "clamped-clamped",
    shortening: ArrayLike | None = None,
    method: str = "exact",
    links: int | None = None,
    clamp: str | None = None,
    stiffness: Any = None,
) -> Solution:
    """Find a state, its admissibility and its stability at every point of broadcast arrays.

    Either the load or the shortening is prescribed. Arrays broadcast as in NumPy, DataArrays of xarray by
    the names of their dimensions; the answer then consists of DataArrays with the same coordinates.
    Quantities of pint must be dimensionless. What has a unit, a mask or labels of pandas is refused.

    Parameters
    ----------
    state : str
        Name such as "0", "B1", "U", "Ua", "U-", "UD:2".
    P : array_like, optional
        Load P*L²/(4π²EI), from 0 to 1e6.
    H : array_like
        Half gap H*/L, from 1e-50 on: the walls are at y = H and y = −H. Each element is a point of its
        own, so that ``H=[0.1, 0.05]`` asks about two gaps, not about two walls at different distances.
    ends : str
        "clamped-clamped" (default) or any other pair of "clamped", "pinned" and spring constants k ≥ 0,
        such as "clamped-pinned", "0.3/2.5" or "clamped/2.5"; springs but 0 from 1e-12 to 1e12.
    shortening : array_like, optional
        Approach of the ends ΔL*/L, 0 or from 1e-11 to 2. `P` is then part of the answer, and stability is
        that at fixed shortening. Free shapes without a force across (both ends pinned, or clamped and an
        odd mode) are known up to 1.994; all others are `not_followed` beyond the greatest shortening of
        their branches, which end at 90 degrees, alternating words and free shapes later.
    method : str
        "exact" (default), or "chain" for rigid links and springs.
    links : int, optional
        Of the chain: 400 by default.
    clamp : str, optional
        Of the chain: "consistent" (default) or "published".
    stiffness : float, array_like or callable, optional
        Of the chain: the profile of EI along the strip; see `elastica.chain.solution.solve`.

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        If the state, the ends or the shapes of the arrays make no sense, an array holds no real numbers, or
        not exactly one of P and shortening is given. A bad number inside an array makes that point
        `failed`, with its reason in `reasons`, and nothing else.

    Examples
    --------
    >>> s = solve("U", P=[2.5, 2.6], H=0.1)
    >>> s.status.tolist(), s.stability.tolist()
    ([0, 0], [0, 0])
    >>> s = solve("Ua", shortening=0.02, H=0.05)
    >>> print(s.P.round(4), s.index, solve("Ua", P=s.P, H=0.05).index)
    2.1772 0 1
    """
    chain = {"links": links, "clamp": clamp, "stiffness": stiffness}
    chain = {name: value for name, value in chain.items() if value is not None}
    if method == "chain":
        from elastica.chain.solution import solve as solve_chain

        return solve_chain(state, P=P, H=H, ends=ends, shortening=shortening, **chain)
    if method != "exact":
        question = did_you_mean(method, METHODS)
        raise ValueError(f"method = {method!r} is not known{question}; use {' or '.join(METHODS)}")
    if chain:
        raise ValueError(f"{', '.join(sorted(chain))}: of a chain only; add method='chain'")
    ends = parse_ends(ends)
    state = parse_state(state, ends)
    chosen, values = read_control(P, shortening)
    control = chosen.name
    given, H, shape, labels = broadcast(**{control: values, "H": H})
    unresolved = unresolved_load(state, ends) / FOUR_PI_SQUARED if control == "P" else np.inf
    reasons = unusable(control, given, H, unresolved)
    usable = np.ones(given.size, bool)
    usable[list(reasons)] = False
    at = np.flatnonzero(usable)
    with np.errstate(all="ignore"):
        lost, at, values = _values(state, Scene(ends, H), control, given, at)
    arrays = blank(state, given.size)
    arrays["status"][usable] = Status.NO_EQUILIBRIUM
    arrays["status"][lost] = Status.NOT_FOLLOWED
    for name, value in values.items():
        arrays[name][at] = value
    arrays[control] = given
    arrays = {name: array.reshape(shape + array.shape[1:]) for name, array in arrays.items()}
    solution = Solution(state, ends, control, H=H.reshape(shape), **arrays, reasons=reasons)
    return solution if labels is None else label(solution, labels)


def label(solution, labels):
    """A solution as DataArrays, with the dimensions and coordinates of `labels`."""
    from elastica.labelled import LabelledSolution

    return LabelledSolution.of(solution, labels)


def solution_of(state, ends, control, given, H, found):
    """A solution with one point for each column of `found`.

    Parameters
    ----------
    state : State
    ends : Ends
    control : str
    given, H : ndarray, shape (m,)
        The prescribed values, to the last digit, and gaps of the columns; None for the values found.
    found : Equilibria
        With m columns, their root numbers regardless of the state's.
    """
    arrays = blank(state, H.size) | bent(state, Scene(ends, H), found, control == "shortening")
    if given is not None:
        arrays[control] = given
    return Solution(state, ends, control, H=H, **arrays)


def unfollowed(state, ends, control, given, H):
    """A solution at m points where the search for a state ended before it could tell.

    Parameters
    ----------
    state : State
    ends : Ends
    control : str
    given, H : ndarray, shape (m,)
        The prescribed values, and gaps.
    """
    arrays = blank(state, H.size)
    arrays["status"][:] = Status.NOT_FOLLOWED
    arrays[control] = given
    return Solution(state, ends, control, H=H, **arrays)


def _values(state, scene, control, given, at):
    """Properties of a state at the flat indices `at`.

    Returns
    -------
    lost, at : ndarray of int
        Where it may be beyond the end of the search; where it is an equilibrium.
    values : dict of str to ndarray
        There.
    """
    if control == "P":
        p = FOUR_PI_SQUARED * given[at]
        if state.straight:
            return at[:0], at, straight(p, scene.at(at))
        found, lost = find(state, p, scene.at(at))
    elif state.straight:
        # The straight strip has no shortening, and any load up to the one at which it buckles.
        at = at[given[at] == 0]
        first = float(euler_root(1, scene.ends)) ** 2
        return at[:0], at, straight(np.full(at.size, first), scene.at(at))
    else:
        found, beyond = Targets(given[at], scene.at(at), len(state.word)).every(state)
        found, lost = of_root(state, found, beyond)
    lost, at = at[lost], at[found.point]
    return lost, at, bent(state, scene.at(at), found, control == "shortening")


MISSING = {
    "status": Status.FAILED,
    "stability": Stability.NOT_SOLVED,
    "index": -1,
    "nullity": -1,
    "periods": 0,
}
TYPES = {"status": np.int8, "stability": np.int8, "index": np.int16, "nullity": np.int16, "periods": np.int8}
PER_CONTACT = ("reaction", "contact_position")
PER_SEGMENT = ("lam", "lengths", "periods")


def blank(state, n):
    """The array attributes of a solution at n points of which nothing is known."""
    contacts = len(state.word)
    widths = dict.fromkeys(PER_CONTACT, (contacts,))
    widths |= dict.fromkeys(PER_SEGMENT, (0 if state.straight else contacts + 1,))
    names = [f.name for f in fields(Solution) if f.name not in ("state", "ends", "control", "H", "reasons")]
    return {
        name: np.full((n, *widths.get(name, ())), MISSING.get(name, np.nan), TYPES.get(name, float))
        for name in names
    }


def unusable(control, given, H, unresolved=np.inf):
    """Reasons why points cannot be solved, by flat index."""
    if control == "P":
        good, allowed = (given >= 0) & (given <= LARGEST_LOAD), f"give a load from 0 to {LARGEST_LOAD:g}"
    else:
        good = (given == 0) | ((given >= SMALLEST_SHORTENING) & (given <= 2))
        allowed = f"give an approach of the ends from 0 to 2, 0 or at least {SMALLEST_SHORTENING:g}"
    reasons = {}
    for name, values, possible, remedy in (
        (control, given, good, allowed),
        (
            "H",
            H,
            (H >= SMALLEST_GAP) & np.isfinite(H),
            f"give a half gap above 0, from {SMALLEST_GAP:g} on, below 0.5 if it is to matter",
        ),
    ):
        for point in np.flatnonzero(~possible):
            reasons.setdefault(int(point), f"{name} = {values[point]:g} is not possible; {remedy}")
    for point in np.flatnonzero(given >= unresolved):
        reasons.setdefault(
            int(point),
            f"P = {given[point]:g}: above {unresolved:.4g} this shape is a loop narrower than numbers "
            "of double precision can tell",
        )
    return reasons
