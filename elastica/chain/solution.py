"""Solve a named state of a chain on arrays of load and gap: the chain's side of `elastica.solve`.

Not here: a single point (`model`).
"""

import warnings
from dataclasses import dataclass, field

import numpy as np

from elastica.blas import single_threaded
from elastica.chain import spectrum
from elastica.chain.model import Model
from elastica.chain.profile import parse_profile
from elastica.chain.properties import outline
from elastica.chain.resolution import SUSPECT, lag, links_for
from elastica.chain.settings import SETTINGS
from elastica.chain.splitting import FEWEST_LINKS, mesh_of
from elastica.codes import Status
from elastica.control import CONTROLS
from elastica.inputs import check_count
from elastica.shapes import Shape, arc_lengths
from elastica.solution import Solution, blank, unusable
from elastica.spelling import did_you_mean
from elastica.stability.spectrum import Conventional

CLAMPS = tuple(SETTINGS)
LINKS = 400
BASES = (1.0, 0.5, 2.0, 0.25, 4.0)
"""Stiffness of the uniform strips to start from, in units of that of the same mean compliance."""


@dataclass(frozen=True, eq=False, repr=False)
class ChainSolution(Solution):
    """A state of a chain of links; attributes as those of the exact `Solution`, with these differences.

    `curvature` is that at the first contact (of a strip that is not uniform, contacts may differ). `error`
    is the difference from the exact state where the strip is uniform, otherwise that from a chain of half
    as many links, in the same norm. `lam` and `periods` are as for the exact state.

    Attributes
    ----------
    links : int
    clamp : str
        "consistent" or "published".
    stiffness : Profile
    chains : dict of int to Equilibrium
        The chain at each point where there is one, by its flat index.
    """

    links: int = 0
    clamp: str = "consistent"
    stiffness: object = None
    chains: dict = field(default_factory=dict)

    def eigenvalues(self, count):
        """The `count` lowest eigenvalues of Q with weight ∫φ² ds, shape (..., count); see `Solution`."""
        return self._each(count, spectrum.eigenvalues)

    def frequencies(self, count):
        """The `count` lowest natural frequencies, shape (..., count); see `Solution`."""
        return self._each(count, spectrum.frequencies)

    @single_threaded
    def conventional(self, count=1):
        """The verdict with each contact held at its material point; see `Solution`."""
        check_count(count)
        values = np.full((self.status.size, count), np.nan)
        index = np.full(self.status.size, -1, np.int16)
        for point in self._solved():
            values[point], index[point] = spectrum.conventional(self.chains[point], self._setting, count)
        if self.state.line:
            # A line may not move in any case, and its flat stretch buckles off the wall.
            index = self.index.ravel()
        shape = self.status.shape
        return Conventional(values.reshape(*shape, count), index.reshape(shape), index.reshape(shape) == 0)

    def shape(self, samples):
        """Points of the polygon at equidistant arc lengths, angles linear between; see `Solution`."""
        s = arc_lengths(samples)
        theta, x, y = np.full((3, self.status.size, samples), np.nan)
        for point, state in self.chains.items():
            line = outline(state)
            theta[point] = np.interp(s, line.s_theta, line.theta)
            x[point], y[point] = np.interp(s, line.s, line.x), np.interp(s, line.s, line.y)
        shape = (*self.status.shape, samples)
        return Shape(s, theta.reshape(shape), x.reshape(shape), y.reshape(shape))

    @property
    def _setting(self):
        return SETTINGS[self.clamp]

    def _solved(self):
        return np.flatnonzero(self.status.ravel() == Status.SOLVED)

    @single_threaded
    def _each(self, count, quantity):
        """A quantity (count,) at every solved point, shape (..., count)."""
        check_count(count)
        values = np.full((self.status.size, count), np.nan)
        for point in self._solved():
            values[point] = quantity(self.chains[point], self._setting, count, CONTROLS[self.control])
        return values.reshape(*self.status.shape, count)


@single_threaded
def solve(state, scene, control, prescribed, links=LINKS, clamp="consistent", stiffness=None):
    """A state of a chain of links at n points.

    Parameters
    ----------
    state : State
        Like ends make a word and its reversal one name ("Ua" and "aU"): to get the other one of a strip
        that is not uniform, reverse the stiffness.
    scene : Scene
    control : Control
    prescribed : ndarray, shape (n,)
        Loads are in units of the EI of which `stiffness` is a multiple, as energies are.
    links : int
        Number of links, at least 4 for each free segment.
    clamp : str
        "consistent" (second order, any state) or "published" (first order, at most one contact).
    stiffness : float, array_like or callable, optional
        EI along the strip, see `profile.parse_profile`.

    Returns
    -------
    ChainSolution, shape (n,)

    Raises
    ------
    ValueError
        If an argument makes no sense; the message says what does.

    Warns
    -----
    UserWarning
        If there are too few links for the load, see `resolution`.
    """
    profile = check_chain(state, links, clamp, stiffness)
    reasons = unusable(scene, control, prescribed)
    model = Model(state, control, SETTINGS[clamp], mesh_of(links, profile))
    arrays, chains = blank(state, scene), {}
    left = np.setdiff1d(np.arange(prescribed.size), list(reasons))
    for base in (1.0,) if profile.uniform else BASES:
        here = scene.at(left)
        with np.errstate(all="ignore"):
            exact = model.exact(here, prescribed[left], base)
            outcomes = [model.outcome(here, exact, at, base) for at in range(left.size)]
        for point, outcome in zip(left.tolist(), outcomes, strict=True):
            if outcome.chain:
                chains[point] = outcome.chain
                reasons.pop(point, None)
            elif outcome.reason:
                reasons.setdefault(point, outcome.reason)
            for name, value in outcome.values.items():
                arrays[name][point] = value
        left = left[arrays["status"][left] == Status.FAILED]
    arrays[control.name] = prescribed
    coarse = [links_for(chain, SUSPECT) for chain in chains.values() if lag(chain) > SUSPECT]
    if coarse:
        warnings.warn(
            f"links = {links} are too few for {len(coarse)} of {prescribed.size} points: their equilibria "
            f"may have no counterpart in the strip; use links = {max(coarse)}",
            stacklevel=4,
        )
    chain = {"links": links, "clamp": clamp, "stiffness": profile, "chains": chains}
    return ChainSolution(state, scene.ends, control.name, **arrays, reasons=reasons, **chain)


def check_chain(state, links, clamp, stiffness):
    """Read a stiffness profile for chains that can represent a state.

    Parameters
    ----------
    state : State
    links, clamp, stiffness
        As for `solve`.

    Returns
    -------
    Profile

    Raises
    ------
    ValueError
        If they cannot; the message says what would.
    """
    if clamp not in CLAMPS:
        question = did_you_mean(clamp, CLAMPS)
        raise ValueError(f"clamp = {clamp!r} is not known{question}; use one of {', '.join(CLAMPS)}")
    fewest = FEWEST_LINKS * (len(state.word) + 1)
    if isinstance(links, bool) or not isinstance(links, (int, np.integer)) or links < fewest:
        raise ValueError(
            f"links = {links!r}; state {state.name!r} needs a whole number of at least {fewest} links, "
            f"{FEWEST_LINKS} for each free segment"
        )
    if len(state.word) > SETTINGS[clamp].MOST_CONTACTS:
        raise ValueError(
            f"clamp = 'published' shifts a single contact and {state.name!r} has {len(state.word)}; "
            "use clamp = 'consistent'"
        )
    profile = parse_profile(stiffness, links)
    if state.line and len(state.word) > 1 and not profile.uniform:
        raise ValueError(
            f"state = {state.name!r}: between two lines a segment of a non-uniform strip cannot slide, "
            "and its place is not searched for; use one line, points, or a uniform stiffness"
        )
    return profile
