"""Answers of `elastica` as labelled datasets, with the names, units and meanings of `schema`.

Not here: datasets of whole studies (`runner`), loading paths (`loading`).
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from elastica.finding import FoundStates
from elastica.labelled import LabelledSolution
from elastica.solution import Solution
from studies.errors import StudyError
from studies.schema import COORDINATES, VARIABLES

if TYPE_CHECKING:
    from xarray import Dataset

TEXT = ("state", "ends")


def to_dataset(
    answer: Solution | FoundStates, *, eigenvalues: int = 0, frequencies: int = 0, shapes: int = 0
) -> "Dataset":
    """What `elastica.solve` or `elastica.find_states` has found, as a dataset with names, units and meanings.

    Parameters
    ----------
    answer : Solution or FoundStates
    eigenvalues, frequencies : int
        How many of each are computed as well; of a `Solution` only.
    shapes : int
        Equidistant points along each strip, if any; of a `Solution` only.

    Returns
    -------
    xarray.Dataset
        Variables as in the dataset of a study. Of a `Solution` along the dimensions of the DataArrays that
        it was asked for; if these were plain arrays, along `P` (or `shortening`) and `H` where they make
        a grid, and otherwise along `point`. Of `FoundStates` along `row`, with their `point` and labels.

    Raises
    ------
    StudyError
        If the answer is none of these, or a dimension has the name of a variable but other values.

    Examples
    --------
    >>> import elastica
    >>> found = to_dataset(elastica.solve("U", P=[2.0, 2.5], H=[[0.05], [0.1]]))
    >>> found["energy"].sel(P=2.5, H=0.1).round(4).item(), found["stability"].attrs["flag_meanings"][:15]
    (-0.0386, 'stable unstable')
    """
    if isinstance(answer, FoundStates):
        if eigenvalues or frequencies or shapes:
            raise StudyError(
                "eigenvalues, frequencies and shapes are those of a solution; solve states by name"
            )
        return _of_rows(answer)
    if not isinstance(answer, Solution):
        raise StudyError(
            f"{type(answer).__name__} is no answer of elastica.solve or elastica.find_states; give one"
        )
    plain = answer.plain if isinstance(answer, LabelledSolution) else answer
    values = {name: getattr(plain, name) for name in VARIABLES if hasattr(plain, name)}
    modes = max(eigenvalues, frequencies)
    if eigenvalues:
        values["eigenvalue"] = _padded(plain.eigenvalues(eigenvalues), modes)
    if frequencies:
        values["frequency"] = _padded(plain.frequencies(frequencies), modes)
    if shapes:
        values |= plain.shape(shapes)._asdict()
        del values["s"]
    if isinstance(answer, LabelledSolution):
        dims, coords = answer.labels.dims, dict(answer.labels.coords)
        values["H"] = plain.H
    else:
        dims, coords = _dimensions(plain)
        values.pop(plain.control)
    if taken := set(dims) & set(TEXT):
        raise StudyError(f"{min(taken)} is the name of a dimension, and of an answer; rename yours")
    coords |= {"state": plain.state.name, "ends": str(plain.ends)}
    return _dataset(values, dims, coords, plain.control, f"State {plain.state.name} of a strip between walls")


def _padded(values, modes):
    """Values of each mode filled up with NaN."""
    missing = np.full((*values.shape[:-1], modes - values.shape[-1]), np.nan)
    return np.concatenate([values, missing], axis=-1)


def _of_rows(found):
    values = {name: getattr(found, name) for name in found.columns}
    coords: dict[str, Any] = {name: ("row", labels) for name, labels in found.labels.items()}
    coords["ends"] = str(found.ends)
    return _dataset(values, ("row",), coords, found.control, "States of a strip between walls")


def _dimensions(solution):
    """Names of the axes of the points, and the coordinates H and what is prescribed."""
    axes = {name: getattr(solution, name) for name in (solution.control, "H")}
    names = [""] * solution.status.ndim
    if not solution.status.size:
        names = tuple(f"point_{axis}" for axis in range(len(names)))
        return names, {name: (names, values) for name, values in axes.items()}
    varies = {name: [_varies(values, axis) for axis in range(len(names))] for name, values in axes.items()}
    for name, others in zip(axes, reversed(axes), strict=True):
        along = np.flatnonzero(varies[name])
        if along.size == 1 and not varies[others][along[0]]:
            names[along[0]] = name
    unused = [name for name in axes if not any(varies[name])]
    for axis, size in enumerate(solution.status.shape):
        if not names[axis] and size < 2 and unused:
            names[axis] = unused.pop(0)
    left = [axis for axis, name in enumerate(names) if not name]
    for axis in left:
        names[axis] = "point" if len(left) == 1 else f"point_{axis}"
    coords = {}
    for name, values in axes.items():
        if name in names:
            axis = names.index(name)
            coords[name] = name, np.moveaxis(values, axis, 0).reshape(values.shape[axis], -1)[:, 0]
        elif any(varies[name]):
            coords[name] = tuple(names), values
        else:
            coords[name] = values.flat[0]
    return tuple(names), coords


def _varies(values, axis):
    first = np.broadcast_to(values.take([0], axis), values.shape)
    return not np.array_equal(first, values, equal_nan=True)


def _dataset(values, dims, coords, control, title):
    """A dataset with attributes of the schema."""
    import xarray

    data: dict[str, Any] = {}
    for name, array in values.items():
        variable = VARIABLES.get(name)
        attributes = variable.attributes if variable else COORDINATES.get(name, {})
        extra = variable.along if variable else ""
        along = dims
        if extra:
            if not array.shape[-1]:
                continue
            along = (*dims, extra)
            labels = np.linspace(0, 1, array.shape[-1]) if extra == "s" else np.arange(1, array.shape[-1] + 1)
            coords[extra] = extra, labels
        data[name] = xarray.Variable(along, array, attributes)
    for name in set(data) & set(coords):
        if not (coords[name].variable == data.pop(name)).all():
            raise StudyError(f"{name} is the name of a dimension or label, and of an answer; rename yours")
    dataset = xarray.Dataset(data, coords, {"Conventions": "CF-1.11", "title": title, "control": control})
    for name, attributes in COORDINATES.items():
        if name in dataset.coords:
            dataset[name].attrs = dict(attributes)
    # Text as every writer of xarray takes it.
    return dataset.assign({name: dataset[name].astype(object) for name in TEXT})
