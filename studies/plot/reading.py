"""What a picture needs of a dataset: planes of one state at a time, no finer than the picture.

Not here: what lies between the grid points (`regions`).
"""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from elastica.codes import Stability, Status
from elastica.control import CONTROLS
from elastica.solution import LARGEST_LOAD
from elastica.spelling import did_you_mean
from elastica.state import MOST_ENUMERATED, is_canonical, parse_state
from studies.errors import StudyError
from studies.plot.regions import FINE
from studies.plot.style import listed, shortest_first
from studies.schema import VARIABLES, control_of
from studies.units import dimensionless

if TYPE_CHECKING:
    from xarray import Dataset

BAND_BYTES = 32_000_000
RANGES = {"H": (0, 0.5, " L"), "P": (0, LARGEST_LOAD, " 4π²EI/L²"), "shortening": (0, 2, " L")}
"""Least and largest label, and what they are divided by."""
MOST_SETS = 62
"""States that fit into the bits of a label."""


def restored(dataset):
    """The dataset as figures read it, whatever was selected from it, joined to it or done to its order.

    It is dimensionless. Dimensions that a selection of one label took away are back, labels increase along H
    and the control, and flags that became floating numbers because something was filled with NaN are integers
    again.

    Returns
    -------
    dataset : xarray.Dataset
    units : Units
        In which its variables were given, and are shown.

    Raises
    ------
    StudyError
        If labels are gone, come twice or are no numbers, an axis is empty, there is a dimension more, or
        units are not understood.
    """
    control = control_of(dataset.coords)
    axes = "ends", "H", control, "state"
    for axis in axes:
        if axis not in dataset.coords:
            raise StudyError(f"the dataset has no labels of {axis!r}; select without drop=True")
        if dataset[axis].dims not in ((), (axis,)):
            raise StudyError(f"{axis!r} is no axis of the dataset; unstack it")
        if axis != "state" and not dataset[axis].size:
            raise StudyError(f"the dataset has no value of {axis}; select one at least")
    dataset, units = dimensionless(dataset)
    missing = [axis for axis in axes if axis not in dataset.dims]
    dataset = dataset.expand_dims(missing) if missing else dataset
    if "status" in dataset and (more := set(dataset["status"].dims) - set(axes)):
        raise StudyError(f"the dataset has the dimension {more.pop()!r} as well; select one label of it")
    for axis in axes:
        dataset = _increasing(dataset, axis, control)
    flags = {
        name: values.fillna(VARIABLES[name].missing).astype(VARIABLES[name].dtype)
        for name, values in dataset.data_vars.items()
        if name in VARIABLES and VARIABLES[name].dtype != "f8" and values.dtype.kind == "f"
    }
    dataset = dataset.assign(flags)
    if "reaction" in dataset and not _every_contact(dataset):
        dataset = dataset.drop_vars("reaction")
    return dataset.transpose(*axes, ...), units


def _increasing(dataset, axis, control):
    """The dataset with the labels of H and the control in order, and those of every axis only once."""
    labels = dataset[axis].values
    if axis in ("H", control):
        if labels.dtype.kind not in "fiu" or not np.isfinite(labels).all():
            raise StudyError(f"the labels of {axis} are not all finite numbers; a figure needs such")
        least, most, of = RANGES[axis]
        if ((labels < least) | (labels > most)).any():
            wrong = labels[(labels < least) | (labels > most)][0]
            raise StudyError(f"{axis} = {wrong:g}{of} cannot be; are its units right?")
        order = np.argsort(labels, kind="stable")
        if (order != np.arange(labels.size)).any():
            dataset = dataset.isel({axis: order})
    values, counts = np.unique(labels if axis in ("H", control) else labels.astype(str), return_counts=True)
    if (counts > 1).any():
        raise StudyError(
            f"{axis} = {values[counts.argmax()]} comes twice in the dataset; decide which is meant, "
            f"dataset.drop_duplicates({axis!r}) keeps the first"
        )
    return dataset


def _every_contact(dataset):
    """Whether the reactions are those of all contacts, so that they can be added up."""
    most = max((name.count("U") + name.count("D") for name in map(str, dataset["state"].values)), default=0)
    if "contact" not in dataset["reaction"].dims or "contact" not in dataset.coords:
        return False
    return set(range(1, most + 1)) <= set(dataset["contact"].values.tolist())


def nearest_label(dataset, axis, value, units):
    """Position of the label nearest to a value in the units that are shown; the middle one if none is given.

    Raises
    ------
    StudyError
        If the value lies beyond the labels by more than half a step.
    """
    labels = units.shown(axis, dataset[axis].values)
    if value is None:
        return len(labels) // 2
    step = np.diff(labels).max(initial=0) / 2 + 1e-9 * units.shown(axis, 1.0)
    if not labels[0] - step <= value <= labels[-1] + step:
        raise StudyError(
            f"{axis} = {value:g} is not in the dataset; give one from {labels[0]:g} to {labels[-1]:g}"
        )
    return int(np.abs(labels - value).argmin())


class Panel(NamedTuple):
    """What a picture uses of the dataset of one end condition: positions along both axes.

    Attributes
    ----------
    dataset : xarray.Dataset
    control : str
    rows, columns : ndarray of int
        Positions along H and along the control.
    """

    dataset: "Dataset"
    control: str
    rows: np.ndarray
    columns: np.ndarray

    @classmethod
    def of(cls, dataset, control):
        """Every label of a small grid, of a large one about as many as a picture has points."""
        axes = zip(("H", control), FINE, strict=True)
        return cls(dataset, control, *(_evenly(dataset.sizes[axis], 2 * fine) for axis, fine in axes))

    @property
    def ends(self):
        """The end condition."""
        return str(self.dataset["ends"].values)

    @property
    def axes(self):
        """Values of H and of the control."""
        return self.dataset["H"].values[self.rows], self.dataset[self.control].values[self.columns]

    @property
    def states(self):
        """Names of the states."""
        return [str(name) for name in self.dataset["state"].values]

    def read(self, name, state=None):
        """A variable, of one state if it has any, of shape (H, control).

        What is read at a time is a band of rows: strides within a compressed file would take longer.
        """
        variable = self.dataset[name] if state is None else self.dataset[name].isel(state=state)
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

    Bit k of `computed` tells whether it was computed there, `known` whether anything was, `unfollowed`
    whether the search for one ended before it could tell; `unknown` names the states that were not computed
    everywhere that others were.
    """

    names: list
    bits: np.ndarray
    computed: np.ndarray
    known: np.ndarray
    unfollowed: np.ndarray
    unknown: list


def stable_sets(panel):
    """The stable states of every point that was computed."""
    found, computed, critical = {}, {}, False
    unfollowed: Any = False  # An array as soon as there is a state.
    for name in sorted(panel.states, key=shortest_first):
        if not is_canonical(name, panel.ends):
            continue
        number = panel.states.index(name)
        status = panel.read("status", number)
        computed[name] = status != Status.NOT_COMPUTED
        unfollowed = unfollowed | (status == Status.NOT_FOLLOWED)
        verdict = np.where(status == Status.SOLVED, panel.read("stability", number), Stability.NOT_SOLVED)
        stable, critical = verdict == Stability.STABLE, critical | (verdict == Stability.CRITICAL)
        # A free shape may be stable only between two lines of the grid.
        if stable.any() or parse_state(name, panel.ends).mode:
            found[name] = stable
    known = np.logical_or.reduce(list(computed.values()))
    if not np.any(known):
        raise StudyError(f"the dataset has no computed point for {panel.ends}; run its study to the end")
    widest = sorted(found, key=lambda name: -found[name].sum())[:MOST_SETS]
    names = [name for name in found if name in widest]
    unknown = [name for name, there in computed.items() if (known & ~there).any()]
    bits, there = (_bits(names, planes, known) for planes in (found, computed))
    # Just where one state hands over to another, none is stable: such a point is like those beside it.
    settled = known & ~(critical & (bits == 0))
    known = settled if settled.any() else known
    return StableSets(names, bits, there, known, unfollowed, unknown)


def _bits(names, planes, known):
    """Bit k where the plane of names[k] holds."""
    bits = np.zeros(known.shape, np.int64)
    for k, name in enumerate(names):
        bits |= planes[name].astype(np.int64) << k
    return bits


def preferred(panel, sets):
    """The sets with the state of least potential alone.

    It is found again from the states that are there: `preferred_state` is a position along the axis of states
    as it was written, before anything was selected.
    """
    potential = CONTROLS[panel.control].potential
    least, bits = np.full(sets.bits.shape, np.inf), np.zeros_like(sets.bits)
    for k, name in enumerate(sets.names):
        stable = sets.bits >> k & 1 == 1
        energy = panel.read(potential, panel.states.index(name))
        if np.isnan(energy[stable]).any():
            raise StudyError(f"the dataset lacks the {potential} of {name} where it is stable")
        lower = stable & (energy < least)
        least[lower], bits[lower] = energy[lower], 1 << k
    return sets._replace(bits=bits)


def solves_exactly(dataset):
    """Whether points between those of the grid can be solved quickly: by the exact method, at given loads."""
    return "shortening" not in dataset.sizes and method_of(dataset) == "exact"


def method_of(dataset):
    """How the states were computed, "exact" or "chain"; "unknown" if the file does not say."""
    try:
        return json.loads(dataset.attrs["config_json"])["solve"]["method"]
    except (KeyError, TypeError, ValueError):
        return "unknown"


def further_states(dataset):
    """How to search for more states than a dataset has, a sentence for captions."""
    try:
        asked = json.loads(dataset.attrs["config_json"])["states"]
    except (KeyError, TypeError, ValueError):
        asked = {}
    most = asked.get("max_contacts") if isinstance(asked, dict) else None
    how = (
        f"with max_contacts = {most + 1}"
        if isinstance(most, int) and most < MOST_ENUMERATED
        else "by more names"
    )
    return f"some state is stable everywhere; where none is shown, search further {how} in [states]"


def state_variable(dataset, variable, state):
    """Position of a state whose variable can be shown.

    Raises
    ------
    StudyError
        If there is no such variable for each state, or no such state.
    """
    shown = sorted(name for name, values in dataset.data_vars.items() if values.dims[-1:] == ("state",))
    if variable not in shown:
        question = did_you_mean(variable, ("stable", "preferred", "count", *shown))
        raise StudyError(
            f"show = {variable!r} is not possible{question}; use stable, preferred, count or one of the "
            f"dataset's {listed(shown)}"
        )
    names = [str(name) for name in dataset["state"].values]
    if state is None:
        raise StudyError(f"show = {variable!r} needs a state; name one of {listed(names)}")
    if state not in names:
        raise StudyError(f"state = {state!r} is none of the dataset's; name one of {listed(names, state)}")
    return names.index(state)
