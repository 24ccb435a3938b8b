"""What a dataset can be asked for beyond its labels: `dataset.elastica`, an accessor of xarray.

`studies.open` and `studies.run` register it; for datasets that xarray itself opens, `import studies.accessor`
does. It names things and adds no data: `stable()` is `dataset["stability"] == 0`, `state(name)` is
`dataset.sel(state=…)`.
"""

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from xarray import DataArray, Dataset

import studies
from elastica.codes import Stability, Status
from elastica.control import CONTROLS
from elastica.solving import solve
from elastica.state import parse_state
from elastica.strip import Strip
from studies.design.study import Study
from studies.errors import StudyError
from studies.schema import COORDINATES, TRANSITIONS, VARIABLES, control_of
from studies.units import dimensionless, physical

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

SHAPE = ("theta", "x", "y")
SAMPLES = 201
MOST_SHAPES = 100_000
MOST_NAMES = 20


@xarray.register_dataset_accessor("elastica")
class Elastica:
    """Verdicts, states, shapes, charts and physical units of a dataset, whole or a selection from it.

    Examples
    --------
    >>> import studies
    >>> dataset = studies.open("first-chart.nc")                                  # doctest: +SKIP
    >>> dataset.elastica.stable().sel(state="U").sum(["H", "P"])                  # doctest: +SKIP
    >>> one = dataset.sel(ends="pinned-pinned").sel(H=0.1, P=2.0, method="nearest")  # doctest: +SKIP
    >>> one.elastica.state("D").elastica.shape().y.max()                          # doctest: +SKIP
    """

    def __init__(self, dataset: Dataset) -> None:
        """Xarray calls this once for each dataset."""
        self._dataset = dataset

    def stable(self) -> DataArray:
        """Where a state is solved and stable: bool, with the dimensions of `stability`."""
        stable = (self._variable("stability") == Stability.STABLE).rename("stable")
        stable.attrs = {"long_name": "whether the state is stable"}
        return stable

    def state(self, name: str) -> Dataset:
        """Select one state by its name.

        Parameters
        ----------
        name : str
            Also one that is not canonical: "D" is "U", "aU" between like ends "Ua". Where end conditions
            differ in what they call it, each is asked for its own.

        Returns
        -------
        Dataset
            Without the dimension `state`.

        Raises
        ------
        StudyError
            If the name is no name or the dataset does not have that state.
        """
        ends = self._variable("ends")
        try:
            names = [parse_state(name, str(label)).name for label in np.atleast_1d(ends.values)]
        except ValueError as problem:
            raise StudyError(str(problem)) from None
        present = np.atleast_1d(self._variable("state").values).tolist()
        for canonical in names:
            if canonical not in present:
                raise StudyError(
                    f"state = {name!r} is not in this dataset; it has {_listed(present)}"
                    f"{self._left_out(canonical)}"
                )
        if "state" not in self._dataset.dims:
            return self._dataset
        if len(set(names)) == 1:
            return self._dataset.sel(state=names[0])
        return self._dataset.sel(state=DataArray(names, dims="ends", coords={"ends": ends}))

    def shape(self, samples: int | None = None) -> Dataset:
        """Angle and position along the strip, at every point of the dataset.

        Select first: a shape at one point is ``dataset.sel(…).elastica.state("U").elastica.shape()``.

        Parameters
        ----------
        samples : int, optional
            Equidistant points along the strip. If the dataset has so many, or none are asked for, its shapes
            are returned; otherwise they are computed with the method of the study, 201 points by default.

        Returns
        -------
        Dataset
            `theta` in radians, `x`, `y`, divided by L, with a dimension `s`; NaN where there is no
            equilibrium. Of a dataset in physical units in metres.

        Raises
        ------
        StudyError
            If there are more than 100,000 shapes, the samples make no line, or nobody knows the units.
        """
        if "theta" in self._dataset and samples in (None, self._dataset.sizes["s"]):
            return self._dataset[list(SHAPE)]
        for name in ("status", "ends", "state", "H", control := control_of(self._dataset.coords)):
            self._variable(name)
        dataset, units = dimensionless(self._dataset)
        status = dataset["status"]
        exists = np.flatnonzero(np.isin(status, (Status.SOLVED, Status.INADMISSIBLE)))
        if exists.size > MOST_SHAPES:
            raise StudyError(f"{exists.size:,} shapes are too many at once; select {MOST_SHAPES:,} or fewer")
        samples = SAMPLES if samples is None else samples
        ends, names, H, given = (
            dataset[label].broadcast_like(status).transpose(*status.dims).values.ravel()[exists]
            for label in ("ends", "state", "H", control)
        )
        values = np.full((3, status.size, samples), np.nan)
        for A_B, name in sorted(set(zip(ends, names, strict=True))):
            at = np.flatnonzero((ends == A_B) & (names == name))
            where: dict[str, Any] = {"H": H[at], control: given[at]}
            solution = solve(name, ends=A_B, **where, **self._method)
            values[:, exists[at]] = solution.shape(samples)[1:]
        shapes = Dataset(
            {
                name: ((*status.dims, "s"), field.reshape(*status.shape, samples), VARIABLES[name].attributes)
                for name, field in zip(SHAPE, values, strict=True)
            },
            {**status.coords, "s": ("s", np.linspace(0, 1, samples), COORDINATES["s"])},
            dataset.attrs,
        )
        return physical(shapes, units.strip) if units.strip else shapes

    def transitions(self) -> Dataset:
        """Where states begin, end, meet and change their stability, at the labels of this dataset.

        Of ``dataset.sel(…)`` those of the ends, gaps and states that are left; ``.to_dataframe()`` makes a
        table.

        Returns
        -------
        Dataset
            One row an event along `transition`: `ends`, `H`, `P`, `shortening`, `state`, `other_state`, the
            codes of `elastica.Event` in `event`, `index_before`, `index_after`.

        Raises
        ------
        StudyError
            If the study did not ask for them.
        """
        dataset = self._dataset
        if "transition" not in dataset.dims:
            raise StudyError(
                "the dataset has no transitions; compute it with transitions = true in [outputs], or find "
                "those of one state with elastica.transitions"
            )
        rows = dataset[list(TRANSITIONS)]
        left = np.logical_and.reduce(
            [np.isin(rows[f"transition_{axis}"], self._variable(axis)) for axis in ("ends", "H", "state")]
        )
        rows = rows.reset_coords(drop=True).isel(transition=left)
        return rows.rename({name: name.removeprefix("transition_") for name in TRANSITIONS})

    def table(self) -> "DataFrame":
        """One row for each state that is solved, not for each that might be.

        Returns
        -------
        pandas.DataFrame
            Columns are the labels and what is known of a state: codes by their names, what there is for each
            contact or mode in columns with its number (``reaction_1``). Shapes are left out.

        Raises
        ------
        StudyError
            If the dataset has no status.
        """
        from pandas import DataFrame

        status = self._variable("status")
        at = np.flatnonzero((status == Status.SOLVED).values)
        labels = ("ends", "H", *CONTROLS, "state")
        names = [name for name in labels if name in self._dataset.coords]
        columns = {name: status.coords[name].broadcast_like(status) for name in names}
        for name in [name for name in VARIABLES if name in self._dataset.data_vars and name != "status"]:
            values = self._dataset[name]
            more = [dim for dim in values.dims if dim not in status.dims]
            if not more and set(values.dims) == set(status.dims):
                columns[name] = values
            elif more in (["contact"], ["mode"]):
                numbers = self._dataset[more[0]].values
                columns |= {f"{name}_{n}": values.isel({more[0]: i}) for i, n in enumerate(numbers)}
        rows = {name: values.transpose(*status.dims).values.ravel()[at] for name, values in columns.items()}
        for name in rows.keys() & VARIABLES.keys():
            if (flags := VARIABLES[name].flags) is not None:
                rows[name] = flags.names(rows[name]).astype(object)
        return DataFrame(rows)

    def physical(self, strip: Strip) -> Dataset:
        """The dataset of a real strip: newtons, metres, joules, 1/m and hertz in place of numbers.

        Parameters
        ----------
        strip : elastica.Strip
            Without a density frequencies stay as they are. The attribute `strip` keeps it, by which figures
            and shapes of the dataset are found in these units.

        Returns
        -------
        Dataset
            `H` is half of what the walls leave to the middle line: (gap − thickness)/2.
        """
        return physical(self._dataset, strip)

    @property
    def plot(self) -> "Plot":
        """Figures, as functions of the same name in `studies.plot`: ``dataset.elastica.plot.chart()``."""
        return Plot(self._dataset)

    def _variable(self, name: str) -> DataArray:
        if name not in self._dataset.variables:
            raise StudyError(f"the dataset has no {name!r}; open one with studies.open and keep what it has")
        return self._dataset[name]

    @property
    def _method(self) -> dict[str, Any]:
        """How the study solves its states: arguments of `elastica.solve`."""
        if "config_json" not in self._dataset.attrs:
            raise StudyError("the dataset has lost its attribute 'config_json', which says how it was solved")
        return Study.from_dict(json.loads(self._dataset.attrs["config_json"])).solve.arguments

    def _left_out(self, name: str) -> str:
        searched = str(self._dataset.attrs.get("states_searched", "")).split()
        return f"; {name} was searched and is solved nowhere" if name in searched else ""


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more


class Plot:
    """Figures of one dataset."""

    def __init__(self, dataset: Dataset) -> None:
        """Keep the dataset to draw."""
        self._dataset = dataset

    def chart(self, **options: Any) -> "Figure":
        """Draw `studies.plot.chart` of this dataset."""
        return studies.plot.chart(self._dataset, **options)

    def bifurcation(self, **options: Any) -> "Figure":
        """Draw `studies.plot.bifurcation` of this dataset."""
        return studies.plot.bifurcation(self._dataset, **options)

    def shapes(self, **options: Any) -> "Figure":
        """Draw `studies.plot.shapes` of this dataset."""
        return studies.plot.shapes(self._dataset, **options)
