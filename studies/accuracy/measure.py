"""The run: all methods on all cases in interleaved rounds, and the dataset of times and errors.

What other processes do to the machine falls on all methods alike, and medians over the rounds are compared.
The dataset is built after each round: an interrupted run keeps what it measured.

Not here: the methods themselves, the files (`folder`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from elastica.spelling import did_you_mean
from studies.accuracy.cases import TASKS, Answer, cases
from studies.accuracy.chain import chain, extrapolated
from studies.accuracy.collocation import collocation
from studies.accuracy.dense import dense
from studies.accuracy.exact import exact, spectral
from studies.accuracy.interior_point import interior_point
from studies.errors import StudyError

DOUBLINGS = [25 * 2**k for k in range(10)]


class Family(NamedTuple):
    """A method: its title with {} for the setting, settings of a full and of a quick run, what it needs."""

    title: str
    run: Callable[..., Answer]
    full: list
    quick: list
    needs: str | None = None
    extrapolates: str | None = None


FAMILIES = {
    "exact": Family("exact, blocks of {:,}", exact, [10_000], [10_000]),
    "exact-call": Family("exact, one call", exact, [1], [1]),
    "spectral": Family(
        "Legendre elements, {} terms", spectral, [4, 6, 8, 10, 12, 16, 20, 24, 32, 48], [4, 8, 12, 24, 48]
    ),
    "chain-published": Family(
        "published chain, {:,} links", lambda s, n: chain(s, n, "published"), DOUBLINGS, DOUBLINGS[::3]
    ),
    "chain-consistent": Family(
        "consistent chain, {:,} links", lambda s, n: chain(s, n, "consistent"), DOUBLINGS, DOUBLINGS[:8]
    ),
    "solve_bvp": Family(
        "solve_bvp, tolerance {:g}", collocation, [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-9], [1e-3, 1e-6, 1e-9]
    ),
    "dense": Family("dense procedure, {:,} links", dense, [25, 50, 100, 200, 400, 800, 1600], [50, 200]),
    "ipopt": Family(
        "IPOPT, {:,} links", interior_point, [25, 50, 100, 200, 400, 800, 1600], [100, 400], needs="casadi"
    ),
}
RICHARDSON = {
    "chain-published": "published chain extrapolated, {:,} links",
    "chain-consistent": "consistent chain extrapolated, {:,} links",
}
ROUNDS, QUICK_ROUNDS = 7, 3


@dataclass(frozen=True)
class Method:
    """One family at one setting; `finer` is the setting that a Richardson extrapolation adds."""

    family: str
    setting: float
    finer: float | None = None

    @property
    def title(self):
        """What a table calls it."""
        if self.finer:
            return RICHARDSON[self.family].format(self.finer)
        return FAMILIES[self.family].title.format(self.setting)

    @property
    def curve(self):
        """Name of the curve it belongs to."""
        return f"{self.family}-extrapolated" if self.finer else self.family

    def answer(self, case, answers):
        """Run it; or combine the two answers of this round that it extrapolates."""
        if self.finer:
            coarse, fine = (answers[Method(self.family, links)] for links in (self.setting, self.finer))
            return extrapolated(coarse, fine, self.family.removeprefix("chain-"))
        return FAMILIES[self.family].run(case, self.setting)


def methods(names=(), quick=False):
    """The methods of a run, and a sentence for each family that is left out.

    Parameters
    ----------
    names : sequence of str
        Families; by default all that can be run here.
    quick : bool

    Returns
    -------
    list of Method, list of str

    Raises
    ------
    StudyError
        If a family is not known, or is asked for and its peer is not installed.
    """
    unknown = [name for name in names if name not in FAMILIES]
    if unknown:
        raise StudyError(
            f"method {unknown[0]!r} is not known{did_you_mean(unknown[0], FAMILIES)}; "
            f"use some of {', '.join(FAMILIES)}"
        )
    chosen, skipped = [], []
    for name, family in FAMILIES.items():
        if names and name not in names:
            continue
        if family.needs and find_spec(family.needs) is None:
            missing = f"{name}: {family.needs} is not installed (pip install {family.needs})"
            if names:
                raise StudyError(missing)
            skipped.append(f"{missing}; skipped")
            continue
        settings = family.quick if quick else family.full
        chosen += [Method(name, setting) for setting in settings]
        if name in RICHARDSON:
            chosen += [Method(name, n, 2 * n) for n in settings if 2 * n in settings]
    return chosen, skipped


def rounds(chosen, count):
    """Measure round after round.

    Parameters
    ----------
    chosen : list of Method
    count : int

    Yields
    ------
    seconds : ndarray, shape (cases, tasks, methods, rounds so far)
        NaN where a method does not do a task.
    error : ndarray, shape (cases, tasks, methods)
    """
    shape = (len(cases()), len(TASKS), len(chosen))
    seconds, error = np.full((*shape, count), np.nan), np.full(shape, np.nan)
    with threadpool_limits(limits=1):
        for number in range(-1, count):
            for i, case in enumerate(cases().values()):
                answers: dict[Method, Answer] = {}
                for k, method in enumerate(chosen):
                    if number < 0 and not _warms_up(method):
                        continue
                    answers[method] = found = method.answer(case, answers)
                    errors = found.errors(case)
                    for j, task in enumerate(TASKS):
                        if task in errors and number >= 0:
                            seconds[i, j, k, number] = found.seconds[task]
                            error[i, j, k] = errors[task]
            if number >= 0:
                yield seconds[..., : number + 1], error


def _warms_up(method):
    """Whether a method runs once before the first round: tables and code that first calls bring in."""
    return not method.finer and method.setting == FAMILIES[method.family].quick[0]


def dataset(chosen, seconds, error, attributes):
    """The measured values with labels.

    Returns
    -------
    xarray.Dataset
    """
    seconds_of = {"units": "s", "long_name": "time per state"}
    about = {"long_name": "relative error against 50-digit references; infinite for a wrong index"}
    return xr.Dataset(
        {
            "seconds": (("scene", "task", "solver", "round"), seconds, seconds_of),
            "error": (("scene", "task", "solver"), error, about),
        },
        {
            "scene": list(cases()),
            "task": list(TASKS),
            "solver": [method.title for method in chosen],
            "curve": ("solver", [method.curve for method in chosen]),
            "setting": ("solver", [float(method.finer or method.setting) for method in chosen]),
        },
        attributes,
    )
