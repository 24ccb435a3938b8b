"""Solutions at points whose dimensions have names: what went in as DataArrays of xarray comes out as such.

Not here: how the points were paired (`inputs`), attributes and units of a dataset (`studies.to_dataset`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from elastica.shapes import Shape
from elastica.solution import QUANTITIES, Solution
from elastica.stability.spectrum import Conventional
from elastica.state import Segment


@dataclass(frozen=True, eq=False, repr=False)
class LabelledSolution(Solution):
    """A solution whose arrays are DataArrays, with the dimensions and coordinates of what was given.

    What has more than one value a point has a dimension more: `contact`, `segment` (of `lam`, `lengths`,
    `periods`), `mode` (of eigenvalues and frequencies) or `s` (of shapes).

    Attributes
    ----------
    plain : Solution
        The same with arrays of NumPy.
    labels : DataArray
        Has the dimensions and coordinates of the points.
    """

    plain: Any = None
    labels: Any = None

    @classmethod
    def of(cls, plain: Solution, labels: Any) -> "LabelledSolution":
        """Label a solution whose points are those of `labels`."""
        values = {f.name: getattr(plain, f.name) for f in fields(Solution)}
        for name, each in QUANTITIES.items():
            values[name] = _label(labels, name, values[name], each.along)
        return cls(**values, plain=plain, labels=labels)

    def __repr__(self) -> str:
        """What is known at the first points."""
        return f"{self.plain!r}\nalong {', '.join(self.labels.dims)}"

    def patterns(self, points: np.ndarray) -> Iterator[tuple[np.ndarray, tuple[Segment, ...]]]:
        """Divide points by the segments that the state has there; see `Solution`."""
        return self.plain.patterns(points)

    def eigenvalues(self, count: int) -> Any:
        """The `count` lowest eigenvalues of the second variation along `mode`; see `Solution`."""
        return _label(self.labels, "eigenvalue", self.plain.eigenvalues(count), "mode")

    def frequencies(self, count: int) -> Any:
        """The `count` lowest natural frequencies along `mode`; see `Solution`."""
        return _label(self.labels, "frequency", self.plain.frequencies(count), "mode")

    def conventional(self, count: int = 1) -> Conventional:
        """The verdict of the conventional energy method; see `Solution`."""
        held = self.plain.conventional(count)
        return Conventional(
            _label(self.labels, "eigenvalue", held.eigenvalues, "mode"),
            _label(self.labels, "index", held.index),
            _label(self.labels, "stable", held.stable),
        )

    def shape(self, samples: int) -> Shape:
        """Points of the strip along `s`; see `Solution`."""
        s, *fields = self.plain.shape(samples)
        names = ("theta", "x", "y")
        labelled = (
            _label(self.labels, name, field, "s", s) for name, field in zip(names, fields, strict=True)
        )
        return Shape(s, *labelled)


def labels_of_rows(labels, point, columns):
    """Labels of the points that rows belong to, by dimension.

    Parameters
    ----------
    labels : DataArray
        Has the dimensions and coordinates of the points.
    point : ndarray of int, shape (rows,)
        Flat indices.
    columns : dict of str to ndarray
        What the rows say already.

    Returns
    -------
    dict of str to ndarray, shape (rows,)
        Of a dimension that has the name of a column and other values, as ``P_label``.
    """
    along = np.unravel_index(point, labels.shape) if labels.dims else ()
    named = {dim: labels[dim].values[at] for dim, at in zip(labels.dims, along, strict=True)}
    for name in [dim for dim in labels.dims if dim in columns]:
        # What is the load or gap itself says nothing new, another label of that name something else.
        label = named.pop(name)
        if not np.array_equal(label, columns[name]):
            named[f"{name}_label"] = label
    return named


def _label(labels, name, values, extra="", along=None):
    """Values as a DataArray, with one dimension more if it has a name; its labels count from 1."""
    coords, dims = dict(labels.coords), labels.dims
    if extra:
        dims = (*dims, extra)
        coords[extra] = np.arange(1, values.shape[-1] + 1) if along is None else along
    # What is the name of a coordinate cannot be that of other values.
    return type(labels)(values, coords, dims, name=None if name in coords else name)
