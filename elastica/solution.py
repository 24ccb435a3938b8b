"""What is known of a state on arrays of load and gap, and everything a user asks of it.

Eigenvalues and shapes are computed only when asked for.

Not here: how the state is found (`exact`, `chain`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from elastica import shapes
from elastica.codes import Stability, Status
from elastica.control import CONTROLS, LOAD
from elastica.ends import Ends
from elastica.properties import Quantities, bent, documented, quantities_of, quantity
from elastica.rows import described
from elastica.stability import spectrum, vibration
from elastica.state import Segment, State

LARGEST_LOAD = 1e6
SMALLEST_GAP = 1e-50
"""Energies, of the order of H², leave the range of numbers below some 1e-150."""
SMALLEST_SHORTENING = 1e-11
"""Besides 0: below some 1e-12 a shortening is lost in the rounding of the length, and states with it."""


@documented
@dataclass(frozen=True, eq=False)
class Solution(Quantities):
    """A state on an array of points; every array has the broadcast shape (...) of P and H first.

    All quantities are dimensionless (lengths by L, P by 4π²EI/L², energies by 4π²EI/L, curvatures by
    1/L). What does not exist is NaN, or −1 in the flags.

    Attributes
    ----------
    state, ends : State, Ends
    control : str
        "P" or "shortening": what is prescribed. Stability is that under this control.
    {quantities}
    reasons : dict of int to str
        Why a point failed, by its flat index.
    """

    state: State
    ends: Ends
    control: str
    lam: np.ndarray = quantity(
        doc="λ (EI/L² = 1, each in its rising convention) of the free segments from A to B.", along="segment"
    )
    lengths: np.ndarray = quantity(doc="Length of the free segments from A to B.", along="segment")
    periods: np.ndarray = quantity(
        doc="Extra full periods that each free segment has.", dtype="i1", missing=0, along="segment"
    )
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
        return spectrum.eigenvalues(self, count, CONTROLS[self.control])

    def frequencies(self, count: int) -> np.ndarray:
        """The `count` lowest natural frequencies with contacts free to move, shape (..., count).

        sign(ω²) √|ω²|, ascending, in units of √(EI/ρA)/L²; exact zeros as 0.0, NaN where the state is not
        solved.
        """
        return vibration.frequencies(self, count, CONTROLS[self.control])

    def conventional(self, count: int = 1) -> spectrum.Conventional:
        """The verdict of the conventional energy method, which holds each contact at its material point.

        It is the verdict at constant load, also where the shortening is prescribed.

        Returns
        -------
        Conventional
            `eigenvalues` (..., count) and `index` (...), NaN and −1 where not solved; `stable` (...), bool.
        """
        return spectrum.conventional(self, count)

    def shape(self, samples: int) -> shapes.Shape:
        """Points of the strip at `samples` equidistant arc lengths.

        Returns
        -------
        Shape
            Fields s (samples,), theta, x, y (..., samples); NaN where there is no equilibrium.
        """
        return shapes.sample(self, samples)


def solution_of(state, scene, control, prescribed, found):
    """A solution with one point for each column of `found`.

    Parameters
    ----------
    state : State
    scene : Scene
        Of the columns.
    control : Control
    prescribed : ndarray, shape (m,)
        The prescribed values, to the last digit; None for the values found.
    found : Equilibria
        With m columns, their root numbers regardless of the state's.
    """
    arrays = blank(state, scene) | bent(state, scene, found, control)
    if prescribed is not None:
        arrays[control.name] = prescribed
    return Solution(state, scene.ends, control.name, **arrays)


def unfollowed(state, scene, control, prescribed):
    """A solution at m points where the search for a state ended before it could tell.

    Parameters
    ----------
    state : State
    scene : Scene
    control : Control
    prescribed : ndarray, shape (m,)
    """
    arrays = blank(state, scene)
    arrays["status"][:] = Status.NOT_FOLLOWED
    arrays[control.name] = prescribed
    return Solution(state, scene.ends, control.name, **arrays)


def shaped(solution, shape):
    """A solution of n points in an array of points."""
    arrays = {name: getattr(solution, name) for name in QUANTITIES}
    return replace(
        solution, **{name: array.reshape(shape + array.shape[1:]) for name, array in arrays.items()}
    )


QUANTITIES = quantities_of(Solution)


def blank(state, scene):
    """The array attributes of a solution at points of which nothing is known: they have failed."""
    contacts = len(state.word)
    widths = {"": (), "contact": (contacts,), "segment": (0 if state.straight else contacts + 1,)}
    arrays = {
        name: np.full((scene.size, *widths[each.along]), each.missing, each.dtype)
        for name, each in QUANTITIES.items()
    }
    arrays["status"][:] = Status.FAILED
    return arrays | {"H": scene.H}


def unusable(scene, control, prescribed):
    """Reasons why points cannot be solved, by index."""
    if control == LOAD:
        good = (prescribed >= 0) & (prescribed <= LARGEST_LOAD)
        allowed = f"give a load from 0 to {LARGEST_LOAD:g}"
    else:
        good = (prescribed == 0) | ((prescribed >= SMALLEST_SHORTENING) & (prescribed <= 2))
        allowed = f"give an approach of the ends from 0 to 2, 0 or at least {SMALLEST_SHORTENING:g}"
    wide = (scene.H >= SMALLEST_GAP) & np.isfinite(scene.H)
    gaps = f"give a half gap above 0, from {SMALLEST_GAP:g} on, below 0.5 if it is to matter"
    reasons: dict[int, str] = {}
    for name, values, possible, remedy in (
        (control.name, prescribed, good, allowed),
        ("H", scene.H, wide, gaps),
    ):
        for point in np.flatnonzero(~possible):
            reasons.setdefault(int(point), f"{name} = {values[point]:g} is not possible; {remedy}")
    return reasons
