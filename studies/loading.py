"""Quasi-static loading: a strip that is pushed and released slowly, as one dataset along its steps.

Not here: the mechanics of a lost state (`elastica.paths.quasistatic`).
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from elastica.codes import Stability
from elastica.control import CONTROLS
from elastica.ends import parse_ends
from elastica.inputs import read_number, read_numbers
from elastica.paths.quasistatic import UNKNOWN, Loading
from elastica.scene import Scene
from elastica.solution import LARGEST_LOAD, SMALLEST_GAP
from studies.errors import StudyError
from studies.schema import VARIABLES

if TYPE_CHECKING:
    import xarray

LARGEST = {"P": LARGEST_LOAD, "shortening": 1.0}
VALUES = ("P", "shortening", "energy", "bending_energy", "curvature")


def loading_path(
    ends: str = "clamped-clamped",
    H: float | None = None,
    *,
    P: ArrayLike | None = None,
    shortening: ArrayLike | None = None,
) -> "xarray.Dataset":
    """Follow the stable state of a strip while load or shortening is changed slowly.

    The strip is straight and unloaded at first and is brought to the first value from there. It stays in
    its state until that is lost; if another stable state begins there with the same shape it passes into
    it, otherwise it jumps to where a chain of rigid links goes by steepest descent.

    Parameters
    ----------
    ends : str
    H : float
        Half gap, between 0 and 0.5.
    P, shortening : array_like, shape (steps,)
        Either the loads or the shortenings, dimensionless, in the order in which they are applied.

    Returns
    -------
    xarray.Dataset
        Along `step`: `P`, `shortening`, `state` (without the number of a root), `stability`, `energy`,
        `bending_energy`, `curvature`; `jump` (whether the strip jumped since the step before) with
        `event_control`, the load or shortening at which it did, or at which it passed smoothly into
        another state (the last of several, jumps before others; NaN where neither happened), and
        `other_state`, a state that it may have jumped to as well because chains disagree. At zero
        shortening the load is that at which the strip buckles. Where the strip cannot be followed, `state`
        is "?" from there on and the attribute `stopped` says why. Where a state goes on beyond the point at
        which following it ends, mostly steeper than 90°, it is "UD?", say, until that point is passed back.

    Raises
    ------
    StudyError
        If the ends, the gap or a value makes no sense, or not exactly one of P and shortening is given.

    Examples
    --------
    >>> path = loading_path("pinned-pinned", H=0.1, P=[0.2, 0.5, 2.0, 0.5])
    >>> path["state"].values.tolist(), path["jump"].values.any().item()
    (['0', 'U', 'U-', 'U'], False)
    """
    import xarray

    control, prescribed = _controls(P, shortening)
    ends, H = _strip(ends, H)
    loading = Loading(Scene(ends, np.array([H])), CONTROLS[control])
    stretches, events, stopped = loading.follow(prescribed)
    values = {name: np.full(prescribed.size, np.nan) for name in VALUES}
    stability = np.full(prescribed.size, Stability.NOT_SOLVED, np.int8)
    state = np.full(prescribed.size, UNKNOWN, "<U64")
    for stretch in dict.fromkeys(stretches):
        rows = np.array([step for step, other in enumerate(stretches) if other is stretch])
        solution = stretch.at(prescribed[rows])
        for name in VALUES:
            values[name][rows] = getattr(solution, name)
        stability[rows] = solution.stability
        state[rows] = stretch.state.name
    if stopped:
        state[len(stretches) :] = _unfollowed(stopped, prescribed[len(stretches) :])
    values[control] = prescribed
    columns = {name: (values[name], VARIABLES[name].attributes) for name in VALUES}
    columns["state"] = (
        state,
        {
            "long_name": "name of the state",
            "comment": "without the number of a root; ? where it is not known, after a name: not followed",
        },
    )
    columns["stability"] = stability, VARIABLES["stability"].attributes
    columns |= _event_columns(events, prescribed.size, VARIABLES[control])
    dataset = xarray.Dataset(
        {name: ("step", column, attributes) for name, (column, attributes) in columns.items()},
        {"step": ("step", np.arange(prescribed.size), {"long_name": "number of the step"})},
        {
            "Conventions": "CF-1.11",
            "title": f"Quasi-static loading of a {ends} strip between walls",
            "ends": str(ends),
            "H": H,
            "control": control,
        },
    )
    if stopped:
        dataset.attrs["stopped"] = stopped.reason
    # Text as every writer of xarray takes it.
    return dataset.assign({name: dataset[name].astype(object) for name in ("state", "other_state")})


def _unfollowed(stopped, prescribed):
    """States of the steps at which the strip is no longer followed, (steps,)."""
    beyond = (prescribed > stopped.value) == (prescribed[0] > stopped.value)
    return np.where(np.logical_and.accumulate(beyond), stopped.untold, UNKNOWN)


def _event_columns(events, steps, control):
    """Columns that say what happened on the way to each step but the first."""
    jump, at, other = np.zeros(steps, bool), np.full(steps, np.nan), np.full(steps, "", "<U64")
    for step, event, doubt in events:
        if step and (event.jump or not jump[step]):
            jump[step], at[step], other[step] = event.jump, event.value, doubt
    return {
        "jump": (jump, {"long_name": "whether the strip jumped since the step before"}),
        "event_control": (
            at,
            {"long_name": f"{control.long_name} at which the state changed", "units": "1"},
        ),
        "other_state": (other, {"long_name": "another state that the strip may have jumped to"}),
    }


def _controls(P, shortening):
    """Name and values of what is prescribed."""
    if (P is None) == (shortening is None):
        raise StudyError("give either P or shortening: one is prescribed, the other follows")
    control, values = ("P", P) if shortening is None else ("shortening", shortening)
    prescribed = _understood(read_numbers, control, values)
    if prescribed.ndim != 1 or not prescribed.size:
        raise StudyError(f"{control} has the shape {prescribed.shape}; give a list of numbers, one a step")
    bad = np.flatnonzero(~((prescribed >= 0) & (prescribed <= LARGEST[control])))
    if bad.size:
        raise StudyError(
            f"{control} = {prescribed[bad[0]]:g} at step {bad[0]} is not possible; give numbers from 0 to "
            f"{LARGEST[control]:g}"
        )
    return control, prescribed


def _strip(ends, H):
    """End conditions and half gap."""
    ends = _understood(parse_ends, ends)
    gap = _understood(read_number, "H", H)
    if not SMALLEST_GAP <= gap < 0.5:
        raise StudyError(f"H = {gap!r} is not possible; give one half gap between 0 and 0.5")
    return ends, gap


def _understood(read, *given):
    """What a reader of `elastica` makes of it; its refusal is one of the study."""
    try:
        return read(*given)
    except ValueError as problem:
        raise StudyError(str(problem)) from None
