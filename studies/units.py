"""Units of a dataset: from numbers to newtons and metres, and back to the numbers that are solved.

A dataset of a real strip says in the attribute `units` of each variable what it is in, and in its own
attribute `strip` which strip that is; without the second the first cannot be undone.
"""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from elastica.properties import QUANTITIES
from elastica.strip import GIVEN, PHYSICAL, Strip
from studies.errors import StudyError
from studies.schema import TRANSITIONS, VARIABLES, canonical, control_of

if TYPE_CHECKING:
    from xarray import Dataset

SCALES = {
    **{name: variable.scale for name, variable in (VARIABLES | TRANSITIONS).items() if variable.scale},
    **{"H": QUANTITIES["H"].scale, "s": "distance"},
}
"""Which of `Strip.scales` makes variables and coordinates physical; the others stay as they are."""
PREFIXES = {"": 1.0, "k": 1e3, "M": 1e6, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6}
STRIP = "strip"
"""Attribute with the strip of a dataset in physical units, as JSON."""


class Units(NamedTuple):
    """What the dimensionless 1 of each variable is, and in which unit; those that are numbers are left out.

    `unknown` are the variables of which nobody knows, `strip` is that of a dataset in physical units.
    """

    scales: dict[str, tuple[float, str]]
    unknown: frozenset[str]
    strip: Strip | None

    def shown(self, name: str, number: Any) -> Any:
        """A dimensionless number, or an array, in the unit of a variable."""
        return number * self.scales[name][0] if name in self.scales else number

    def unit(self, name: str) -> str:
        """Its name, "" for numbers."""
        return self.scales[name][1] if name in self.scales else ""

    def text(self, name: str, number: float) -> str:
        """A dimensionless number in the unit of a variable, to read."""
        return f"{self.shown(name, number):.4g} {self.unit(name)}".rstrip()


NUMBERS = Units({}, frozenset(), None)


def physical(dataset: "Dataset", strip: Strip) -> "Dataset":
    """The dataset of a real strip, in SI units; one that is in physical units already is converted anew."""
    dataset, units = dimensionless(dataset)
    if units.strip and units.unknown:
        raise StudyError(
            f"{min(units.unknown)} has lost its attribute 'units'; convert the dataset as it was"
        )
    scales, converted = strip.scales, dataset.copy()
    for name, values in dataset.variables.items():
        key = SCALES.get(str(name), "")
        if key in scales:
            attributes = {"long_name": values.attrs.get("long_name", name), "units": PHYSICAL[key]}
            converted[name] = (values.dims, values.data * scales[key], attributes)
    converted.attrs[STRIP] = json.dumps({name: getattr(strip, name) for name in GIVEN})
    return converted


def dimensionless(dataset: "Dataset") -> tuple["Dataset", Units]:
    """The dataset in the numbers that are solved, and the units it was in.

    Raises
    ------
    StudyError
        If the units of a label are not known, or those of a variable not understood, or the strip is not.
    """
    labels = "H", control_of(dataset.coords)
    numbers, scales, unknown = dataset.copy(), {}, set()
    for name in [str(name) for name in dataset.variables if name in SCALES]:
        values = dataset[name].variable
        unit = values.attrs.get("units")
        if unit == "1":
            continue
        if unit is None and name not in labels:
            unknown.add(name)
            continue
        scale = _scale(dataset, name, unit)
        number = values.data / scale
        if name in labels:
            # As studies write them, so that they are the same labels again.
            number = np.reshape([canonical(float(label)) for label in np.ravel(number)], number.shape)
        numbers[name] = values.dims, number, {**values.attrs, "units": "1"}
        scales[name] = scale, str(unit)
    if not scales:
        return numbers, NUMBERS._replace(unknown=frozenset(unknown))
    strip = strip_of(dataset)
    for name in SCALES.keys() - dataset.variables.keys():
        if SCALES[name] in strip.scales:
            scales[name] = strip.scales[SCALES[name]], PHYSICAL[SCALES[name]]
    return numbers, Units(scales, frozenset(unknown), strip)


def _scale(dataset, name, unit):
    """What the dimensionless 1 of a variable is in a unit."""
    key = SCALES[name]
    SI = PHYSICAL[key]
    if unit is None:
        raise StudyError(
            f"{name} has lost its attribute 'units': is it a number, or in {SI}? Open the dataset again, or "
            f"say so by dataset[{name!r}].attrs['units'] = '1'"
        )
    prefix = str(unit).removesuffix(SI)
    if not str(unit).endswith(SI) or prefix not in PREFIXES:
        raise StudyError(f"{name} is in units {str(unit)!r}, which are not understood; use 1 or {SI}")
    scales = strip_of(dataset).scales
    if key not in scales:
        raise StudyError(f"{name} is in {unit}, but the strip has no density")
    return scales[key] / PREFIXES[prefix]


def strip_of(dataset):
    """The strip of a dataset in physical units."""
    try:
        return Strip(**json.loads(dataset.attrs[STRIP]))
    except (KeyError, TypeError, ValueError):
        raise StudyError(
            "the dataset is in physical units, but no attribute 'strip' says of which strip; "
            "convert it with dataset.elastica.physical(strip)"
        ) from None
