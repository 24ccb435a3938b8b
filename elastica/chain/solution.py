"""Solve a named state of a chain on arrays of load and gap: the chain's side of `elastica.solve`."""

import warnings
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from elastica.chain import spectrum
from elastica.chain.equilibrium import Equilibrium, NoEquilibrium
from elastica.chain.profile import parse_profile
from elastica.chain.properties import contacts_hold, outline, properties
from elastica.chain.published import published_equilibrium
from elastica.chain.resolution import LOST, SUSPECT, lag, links_for
from elastica.chain.splitting import FEWEST_LINKS, Pattern, split, strip_of
from elastica.chain.start import Target, continued, exact_start, exists, mean_stiffness, pattern_of
from elastica.chain.verdict import judge
from elastica.codes import Status
from elastica.ends import parse_ends
from elastica.scales import FOUR_PI_SQUARED
from elastica.shapes import Shape
from elastica.solution import Solution, blank, broadcast, prescribed, unusable
from elastica.solution import solve as solve_exact
from elastica.spectrum import Conventional
from elastica.states import parse_state

CLAMPS = ("consistent", "published")


@dataclass(frozen=True, eq=False)
class ChainSolution(Solution):
    """A state of a chain of links; attributes as those of the exact `Solution`, with these differences.

    `curvature` is that at the first contact (of a strip that is not uniform, contacts may differ). `error` is the
    difference from the exact state where the strip is uniform, otherwise that from a chain of half as many links, in the
    same norm. `lam` and `periods` are as for the exact state.

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
        return self._each(count, spectrum.eigenvalues, count, self._holds_shortening)

    def frequencies(self, count):
        """The `count` lowest natural frequencies, shape (..., count); see `Solution`."""
        return self._each(count, spectrum.frequencies, count, self._holds_shortening)

    def conventional(self, count=1):
        """The verdict with each contact held at its material point; see `Solution`."""
        check_count(count)
        values = np.full((self.status.size, count), np.nan)
        index = np.full(self.status.size, -1, np.int16)
        for point in self._solved():
            values[point], index[point] = spectrum.conventional(self.chains[point], self._published, count)
        stable = np.where(index < 0, -1, index == 0).astype(np.int8)
        shape = self.status.shape
        return Conventional(values.reshape(*shape, count), index.reshape(shape), stable.reshape(shape))

    def shape(self, samples):
        """Points of the polygon at `samples` equidistant arc lengths, angles linear between; see `Solution`."""
        if not isinstance(samples, (int, np.integer)) or samples < 2:
            raise ValueError(f"samples = {samples!r}; ask for at least two points along the strip")
        s = np.linspace(0, 1, samples)
        theta, x, y = np.full((3, self.status.size, samples), np.nan)
        for point, state in self.chains.items():
            line = outline(state)
            theta[point] = np.interp(s, line.s_theta, line.theta)
            x[point], y[point] = np.interp(s, line.s, line.x), np.interp(s, line.s, line.y)
        shape = (*self.status.shape, samples)
        return Shape(s, theta.reshape(shape), x.reshape(shape), y.reshape(shape))

    @property
    def _published(self):
        return self.clamp == "published"

    @property
    def _holds_shortening(self):
        return self.control == "shortening" and not self.state.straight

    def _solved(self):
        return np.flatnonzero(self.status.ravel() == Status.SOLVED)

    def _each(self, count, quantity, *arguments):
        """A quantity (count,) at every solved point, shape (..., count)."""
        check_count(count)
        values = np.full((self.status.size, count), np.nan)
        for point in self._solved():
            values[point] = quantity(self.chains[point], self._published, *arguments)
        return values.reshape(*self.status.shape, count)


def check_count(count):
    """Raise ValueError if `count` is not a positive whole number."""
    if not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count = {count!r}; ask for at least one eigenvalue")


def solve(
    state,
    *,
    P=None,
    H=None,
    ends="clamped-clamped",
    shortening=None,
    links=400,
    clamp="consistent",
    stiffness=None,
):
    """Find a state of a chain of links at every point of broadcast arrays.

    Parameters
    ----------
    state, P, H, ends, shortening
        As for `elastica.solve`; P and energies in units of the EI of which `stiffness` is a multiple.
    links : int
        Number of links, at least 4 for each free segment.
    clamp : str
        "consistent" (second order, any state) or "published" (first order, at most one contact).
    stiffness : float, array_like or callable, optional
        EI along the strip, see `profile.parse_profile`.

    Returns
    -------
    ChainSolution

    Raises
    ------
    ValueError
        If an argument makes no sense; the message says what does.

    Warns
    -----
    UserWarning
        If there are too few links for the load, see `resolution`.
    """
    ends = parse_ends(ends)
    state = parse_state(state, ends)
    check_links(state, links, clamp)
    profile = parse_profile(stiffness, links)
    control, values = prescribed(P, shortening)
    given, H, shape = broadcast(**{control: values, "H": H})
    reasons = unusable(control, given, H)
    model = Model(state, ends, control, links, clamp, profile)
    arrays, chains = blank(state, given.size), {}
    coarse = []
    with np.errstate(all="ignore"):
        exact = model.exact(given, H)
        turns = None if state.straight else exact.shape(2 * links + 1).theta.reshape(given.size, -1)[:, 1::2]
        for point in np.flatnonzero([point not in reasons for point in range(given.size)]):
            if not exists(exact, point):
                arrays["status"][point], why = model.missing(exact, point)
                reasons |= {int(point): why} if why else {}
                continue
            try:
                found = model.at(exact, point, None if turns is None else turns[point])
            except NoEquilibrium as problem:
                reasons[int(point)] = str(problem)
                continue
            if found is None:
                arrays["status"][point] = Status.NO_EQUILIBRIUM
                continue
            chains[int(point)] = found.state
            for name, value in found.values.items():
                arrays[name][point] = value
            if found.lag > SUSPECT:
                coarse.append(found.state)
    arrays[control] = np.where(np.isnan(arrays["energy"]), np.nan, given) if control != "P" else given
    if coarse:
        wanted = max(links_for(chain, SUSPECT) for chain in coarse)
        warnings.warn(
            f"links = {links} are too few for {len(coarse)} of {given.size} points: their equilibria may have no counterpart "
            f"in the strip; use links = {wanted}",
            stacklevel=3,
        )
    arrays = {name: array.reshape(shape + array.shape[1:]) for name, array in arrays.items()}
    return ChainSolution(
        state, ends, control, H=H.reshape(shape), **arrays, reasons=reasons, links=links, clamp=clamp,
        stiffness=profile, chains=chains,
    )  # fmt: skip


def check_links(state, links, clamp):
    """Raise ValueError unless this number of links and this setting can represent a state."""
    if clamp not in CLAMPS:
        raise ValueError(f"clamp = {clamp!r}; use one of {', '.join(CLAMPS)}")
    fewest = FEWEST_LINKS * (len(state.word) + 1)
    if isinstance(links, bool) or not isinstance(links, (int, np.integer)) or links < fewest:
        raise ValueError(
            f"links = {links!r}; state {state.name!r} needs a whole number of at least {fewest} links, "
            f"{FEWEST_LINKS} for each free segment"
        )
    if clamp == "published" and len(state.word) > 1:
        raise ValueError(
            f"clamp = 'published' shifts a single contact and {state.name!r} has {len(state.word)}; use clamp = 'consistent'"
        )


class Found(NamedTuple):
    """A chain in equilibrium, the values of its arrays, and how far its waves lag behind the strip's."""

    state: Equilibrium
    values: dict
    lag: float


class Model(NamedTuple):
    """What all points of a solution share."""

    state: object
    ends: object
    control: str
    links: int
    clamp: str
    profile: object

    @property
    def published(self):
        """Whether this is the published setting."""
        return self.clamp == "published"

    @property
    def base(self):
        """The uniform strip that the exact state belongs to."""
        if self.profile.uniform:
            return strip_of(self.links, self.profile, self.ends)
        return mean_stiffness(self.links, self.profile, self.ends)

    def exact(self, given, H):
        """The exact state of the uniform strip."""
        if self.control == "P":
            given = given / self.base.stiffness[0]
        soft = self.ends._replace(
            **{
                side: end._replace(k=end.k / self.base.stiffness[0])
                for side, end in self.ends._asdict().items()
            }
        )
        return solve_exact(self.state.name, **{self.control: given}, H=H, ends=soft)

    def missing(self, exact, point):
        """Status and reason of a point where the uniform strip has no such state."""
        status = Status(int(exact.status.ravel()[point]))
        if status == Status.NO_EQUILIBRIUM and not self.profile.uniform:
            stiffness = self.base.stiffness[0]
            return Status.FAILED, f"a uniform strip of EI = {stiffness:.4g} has no such state to start from"
        return status, exact.reasons.get(int(point))

    def at(self, exact, point, turns):
        """The chain at one point; None where it has lost its contact.

        Raises
        ------
        NoEquilibrium
        """
        H = float(exact.H.ravel()[point])
        p = FOUR_PI_SQUARED * float(exact.P.ravel()[point]) * self.base.stiffness[0]
        shortening = float(exact.shortening.ravel()[point]) if self.control == "shortening" else None
        target = Target(H, p if shortening is None else None, shortening)
        chain = self._chain(exact, point, turns, target, p)
        behind = lag(chain)
        if behind > LOST:
            raise NoEquilibrium(
                f"waves of {self.links} links lag {behind:.2g} rad behind those of the strip, so that a solution may be "
                f"another state's or nobody's; use links = {links_for(chain, SUSPECT)}"
            )
        if not contacts_hold(chain, self.published):
            return None
        rising = np.ones(1) if self.state.straight else self._rising(exact)
        periods = exact.periods.reshape(exact.status.size, -1)[point]
        values = properties(chain, rising, self.published, periods)
        if values["status"] == Status.SOLVED:
            fixed = shortening is not None and not self.state.straight
            found = judge(chain, self.published, fixed)
            values |= {name: getattr(found, name) for name in found._fields}
        values["error"] = self._error(values, exact, point, chain, target)
        return Found(chain, values, behind)

    def _rising(self, exact):
        """Signs of λ in each segment's rising convention."""
        walls = pattern_of(self.state, self.ends).walls
        sides = np.array([*walls, walls[-1]] if walls else [1])
        return np.where(self.state.reversed_segments(exact.ends), -sides, sides)

    def _chain(self, exact, point, turns, target, p):
        """The equilibrium of the chain."""
        base = self.base
        if self.state.straight:
            strip = strip_of(self.links, self.profile, self.ends)
            pieces = split(strip, Pattern(()), np.zeros(0))
            zero = np.zeros(self.links)
            chain = Equilibrium(strip, Pattern(()), target.H, p, pieces, zero, np.zeros(1), np.zeros(0))
        else:
            start = exact_start(exact, point, base, turns, self._rising(exact))
            if self.profile.uniform:
                chain = target.solve(base, start.pattern, start)
            else:
                chain = continued(self.links, self.profile, self.ends, start, target)
        if not self.published:
            return chain
        return published_equilibrium(chain, target.shortening)

    def _error(self, values, exact, point, chain, target):
        """Difference from the exact state, or from a chain of half as many links."""
        if self.state.straight:
            return 0.0
        if self.profile.uniform:
            scale = self.base.stiffness[0]
            other = {
                "curvature": float(exact.curvature.ravel()[point]),
                "lengths": exact.lengths.reshape(exact.status.size, -1)[point],
                "energy": float(exact.energy.ravel()[point]) * scale,
            }
        else:
            strip = strip_of(self.links // 2, self.profile, self.ends)
            try:
                half = target.solve(strip, chain.pattern, chain)
            except NoEquilibrium:
                return np.inf
            other = properties(half, np.ones(half.lam.size), False, np.zeros(half.lam.size))
        return max(
            abs(values["curvature"] - other["curvature"]) / np.sqrt(max(chain.p, 1e-6)),
            float(np.abs(values["lengths"] - other["lengths"]).max()),
            abs(values["energy"] / other["energy"] - 1) if other["energy"] else 0.0,
        )
