"""What a picture needs of a dataset: planes of one state at a time, no finer than the picture.

Left out: what lies between the grid points (`regions`).
"""

import json
from typing import NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.states import is_canonical, parse_state
from studies.errors import StudyError
from studies.plot.regions import FINE, fill
from studies.plot.style import listed
from studies.schema import control_of

BAND_BYTES = 32_000_000
MOST_SETS = 62
"""States that fit into the bits of a label."""


def restored(dataset):
    """The dataset with the dimensions that a selection of one label took away.

    Raises
    ------
    StudyError
        If the label is gone as well, or an axis is empty.
    """
    axes = "ends", "H", control_of(dataset.coords), "state"
    for axis in axes:
        if axis not in dataset.coords:
            raise StudyError(f"the dataset has no labels of {axis!r}; select without drop=True")
        if axis != "state" and not dataset[axis].size:
            raise StudyError(f"the dataset has no value of {axis}; select one at least")
    missing = [axis for axis in axes if axis not in dataset.dims]
    return dataset.expand_dims(missing).transpose(*axes, ...) if missing else dataset


def nearest_label(dataset, axis, value):
    """Position of the label nearest to a value; the middle one if none is given.

    Raises
    ------
    StudyError
        If the value lies beyond the labels by more than half a step.
    """
    labels = dataset[axis].values
    if value is None:
        return len(labels) // 2
    step = np.diff(labels).max(initial=0) / 2 + 1e-9
    if not labels[0] - step <= value <= labels[-1] + step:
        raise StudyError(
            f"{axis} = {value:g} is not in the dataset; give one from {labels[0]:g} to {labels[-1]:g}"
        )
    return int(np.abs(labels - value).argmin())


class Grid(NamedTuple):
    """Labels of one end condition that a picture uses: the dataset there, and positions along both axes."""

    panel: object
    control: str
    rows: np.ndarray
    columns: np.ndarray

    @classmethod
    def of(cls, panel, control):
        """Every label of a small grid, of a large one about as many as a picture has points."""
        sizes = panel.sizes["H"], panel.sizes[control]
        return cls(panel, control, *(_evenly(size, 2 * fine) for size, fine in zip(sizes, FINE, strict=True)))

    @property
    def ends(self):
        """The end condition."""
        return str(self.panel["ends"].values)

    @property
    def axes(self):
        """Values of H and of the control."""
        return self.panel["H"].values[self.rows], self.panel[self.control].values[self.columns]

    @property
    def states(self):
        """Names of the states."""
        return [str(name) for name in self.panel["state"].values]

    def read(self, name, state=None):
        """A variable, of one state if it has any, of shape (H, control).

        What is read at a time is a band of rows: strides within a compressed file would take longer.
        """
        variable = self.panel[name] if state is None else self.panel[name].isel(state=state)
        variable = variable.transpose("H", self.control)
        rows = max(1, BAND_BYTES // (variable.dtype.itemsize * variable.sizes[self.control]))
        bands = []
        for first in range(0, variable.sizes["H"], rows):
            wanted = self.rows[(self.rows >= first) & (self.rows < first + rows)] - first
            if wanted.size:
                bands.append(variable[first : first + rows].values[np.ix_(wanted, self.columns)])
        return np.concatenate(bands)


def _evenly(count, most):
    """Positions of at most about `most` of `count` labels, in equal steps but for the last."""
    return np.unique(np.append(np.arange(0, count, -(-count // most)), count - 1))


class StableSets(NamedTuple):
    """Which states are stable: bit k of `bits` (H, control) stands for `names[k]`.

    `unknown` names the states that were computed nowhere.
    """

    names: list
    bits: np.ndarray
    unknown: list


def stable_sets(grid):
    """The stable states of every point; of points that were not computed, those of the nearest."""
    names, planes, unknown = [], [], []
    known = False
    for number, name in enumerate(grid.states):
        status = grid.read("status", number)
        computed = status != Status.NOT_COMPUTED
        known = known | computed
        if not is_canonical(name, grid.ends):
            continue
        if not computed.any():
            unknown.append(name)
        stable = (status == Status.SOLVED) & (grid.read("stability", number) == Stability.STABLE)
        # A free shape may be stable only between two lines of the grid.
        if stable.any() or parse_state(name, grid.ends).mode:
            names.append(name)
            planes.append(stable)
    if not np.any(known):
        raise StudyError(f"the dataset has no computed point for {grid.ends}; run its study to the end")
    widest = sorted(range(len(names)), key=lambda k: -planes[k].sum())[:MOST_SETS]
    names, planes = ([values[k] for k in sorted(widest)] for values in (names, planes))
    bits = np.zeros(known.shape, np.int64)
    for k, stable in enumerate(planes):
        bits |= stable.astype(np.int64) << k
    return StableSets(names, fill(bits, known), unknown)


def preferred_bits(grid, names):
    """The bit of the preferred state of every point, 0 where none is stable."""
    position = grid.read("preferred_state")
    numbers = [grid.states.index(name) for name in names]
    bits = np.zeros(position.shape, np.int64)
    for k, number in enumerate(numbers):
        bits[position == number] = 1 << k
    return bits


def solves_exactly(dataset):
    """Whether points between those of the grid can be solved quickly: by the exact method, at given loads."""
    return "shortening" not in dataset.sizes and method_of(dataset) == "exact"


def method_of(dataset):
    """How the states were computed, "exact" or "chain"; "unknown" if the file does not say."""
    try:
        return json.loads(dataset.attrs["config_json"])["solve"]["method"]
    except (KeyError, TypeError, ValueError):
        return "unknown"


def state_variable(dataset, variable, state):
    """Position of a state whose variable can be shown.

    Raises
    ------
    StudyError
        If there is no such variable for each state, or no such state.
    """
    shown = sorted(name for name, values in dataset.data_vars.items() if values.dims[-1:] == ("state",))
    if variable not in shown:
        raise StudyError(
            f"show = {variable!r} is not possible; use stable, preferred, count or one of the dataset's "
            f"{listed(shown, variable)}"
        )
    names = [str(name) for name in dataset["state"].values]
    if state is None:
        raise StudyError(f"show = {variable!r} needs a state; name one of {listed(names)}")
    if state not in names:
        raise StudyError(f"state = {state!r} is none of the dataset's; name one of {listed(names, state)}")
    return names.index(state)
