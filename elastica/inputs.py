"""Numbers that users give: what is understood, and what is refused by the name of its argument.

NumPy makes numbers of nearly everything. It drops units, masks, labels and imaginary parts, counts days and
reads text. Every number of a user passes through here instead:

    numbers and lists, arrays, fractions    as they are
    quantities of pint                      in the unit that is asked for, mostly none
    DataArrays of xarray                    paired by the names of their dimensions (`broadcast`)
    all else                                refused: masks, labels of pandas, complex numbers, dates, text, …

xarray is asked only about what is its own: this package does not import it.
"""

import sys
from decimal import Decimal
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

PLAIN = {float, int, np.float64, np.int64}
DIMENSIONLESS = ("", "1", "dimensionless")
OWN_DIMENSIONS = ("contact", "segment", "mode", "s")
"""What an answer may have beside the dimensions of the points."""
NOT_REAL = {
    "b": ("a truth value", ""),
    "c": ("complex", ", such as its real part"),
    **dict.fromkeys("mM", ("a date or a duration", "")),
    **dict.fromkeys("SUT", ("text", "")),
}


def read_numbers(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Real numbers as an array.

    Parameters
    ----------
    name : str
        Of the argument, for messages.
    value : array_like, pint quantity or DataArray
    unit : str
        In which quantities are wanted; empty for dimensionless ones.

    Returns
    -------
    ndarray of float
        Not a copy if it need not be.

    Raises
    ------
    ValueError
        If the value is anything else, with what it is and what to give.
    """
    if type(value) is np.ndarray and value.dtype.kind in "fiu":
        return value.astype(float, copy=False)
    if is_labelled(value):
        has = value.attrs.get("units", unit)
        if has != unit and (unit or has not in DIMENSIONLESS):
            raise _refused(name, value.values, unit, f"in {has}")
        return read_numbers(name, value.data, unit)
    if has_units(value):
        try:
            magnitude = value.to(unit).magnitude
        except TypeError:
            raise _refused(name, value, unit, f"in {value.units}") from None
        return read_numbers(name, magnitude, unit)
    if what := _of_a_library(value):
        raise _refused(name, value, unit, *what)
    if isinstance(value, (list, tuple)) and not set(map(type, value)) <= PLAIN:
        if any(is_labelled(item) and item.ndim for item in value):
            raise _refused(name, value, unit, "a list of labelled arrays", ": one array, by xarray.concat")
        value = [read_numbers(name, item, unit) for item in value]
    if isinstance(value, (Real, Decimal)) and not isinstance(value, (bool, np.timedelta64)):
        return _converted(name, float, value, unit)
    array = _converted(name, np.asarray, value, unit)
    if array.dtype.kind == "O" and array.ndim:
        items = [read_numbers(name, item, unit) for item in array.ravel()]
        return _converted(name, np.asarray, items, unit).reshape(array.shape)
    if array.dtype.kind not in "fiu":
        kind = type(value).__name__
        raise _refused(name, value, unit, *NOT_REAL.get(array.dtype.kind, (f"of the type {kind}", "")))
    return array.astype(float, copy=False)


def read_number(name: str, value: Any, unit: str = "") -> float:
    """One real number; see `read_numbers`."""
    array = read_numbers(name, value, unit)
    if array.ndim:
        raise ValueError(f"{name} = {_shown(value)} has the shape {array.shape}; give one number{_in(unit)}")
    return float(array)


def check_count(count: int) -> None:
    """Raise ValueError if the number of eigenvalues asked for is not a positive whole number."""
    if not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count = {count!r}; ask for at least one eigenvalue")


class Points(NamedTuple):
    """Points at which something is asked: two flat arrays of numbers, and how the points are arranged.

    Attributes
    ----------
    prescribed, H : ndarray, shape (n,)
    shape : tuple of int
    labels : DataArray or None
        Has the dimensions and coordinates of the points, if what was given has.
    """

    prescribed: np.ndarray
    H: np.ndarray
    shape: tuple[int, ...]
    labels: Any = None


def broadcast(**arrays: Any) -> Points:
    """Two arrays of numbers, broadcast as NumPy does, or by the names of their dimensions.

    Raises
    ------
    ValueError
        If they are no numbers or do not broadcast; the message names them.
    """
    for name, values in arrays.items():
        if values is None:
            raise ValueError(f"{name} is missing; give a number or an array")
    if any(map(is_labelled, arrays.values())):
        return _broadcast_by_name(arrays)
    values = [read_numbers(name, value) for name, value in arrays.items()]
    try:
        first, second = np.broadcast_arrays(*values)
    except ValueError:
        shapes = " and ".join(f"{name} {value.shape}" for name, value in zip(arrays, values, strict=True))
        raise ValueError(
            f"the shapes of {shapes} do not broadcast: each element is a point of its own; give one H, the "
            f"half gap of both walls, or one for each {next(iter(arrays))}, or arrays such as (n, 1) and (m,)"
        ) from None
    return Points(first.ravel().copy(), second.ravel().copy(), first.shape)


def _broadcast_by_name(arrays):
    xarray = sys.modules["xarray"]
    read = []
    for name, value in arrays.items():
        if is_labelled(value):
            read.append(xarray.DataArray(relabelled(value, read_numbers(name, value))))
            continue
        values = read_numbers(name, value)
        if values.ndim:
            other = next(name for name, value in arrays.items() if is_labelled(value))
            raise ValueError(
                f"{name} has the shape {values.shape} and no names for its dimensions, but {other} has; "
                "give a number or a DataArray"
            )
        read.append(float(values))
    try:
        with xarray.set_options(arithmetic_join="exact"):
            labels = read[0] + read[1]
    except ValueError:
        raise ValueError(
            f"{' and '.join(arrays)} have different labels along a dimension; bring them to the same ones, "
            "such as by xarray.align"
        ) from None
    if taken := set(labels.dims) & set(OWN_DIMENSIONS):
        raise ValueError(
            f"{' and '.join(arrays)}: the answer itself has a dimension {min(taken)!r}; rename that of yours"
        )
    labels = xarray.zeros_like(labels)
    prescribed, H = ((labels + values).values.ravel() for values in read)
    return Points(prescribed, H, labels.shape, labels)


def is_labelled(value: Any) -> bool:
    """Whether dimensions have names: whether this is a DataArray or a Variable of xarray."""
    xarray = sys.modules.get("xarray")
    return xarray is not None and isinstance(value, (xarray.DataArray, xarray.Variable))


def relabelled(value: Any, values: Any, unit: str = "") -> Any:
    """A DataArray like another, with other values and their unit."""
    answer = value.copy(data=values)
    answer.attrs = {"units": unit} if unit else {}
    return answer


def has_units(value: Any) -> bool:
    """Whether this is a quantity of pint."""
    return hasattr(value, "magnitude") and hasattr(value, "_REGISTRY")


def _of_a_library(value):
    """What an object of another library is that NumPy would strip, and the remedy."""
    if isinstance(value, np.ma.MaskedArray):
        return "masked", ": its filled(np.nan), of which masked points fail, or its compressed()"
    home = type(value).__module__.partition(".")[0]
    if home == "pandas":
        remedy = ": its to_numpy(), paired by position, or its to_xarray(), paired by label"
        return ("labelled", remedy) if hasattr(value, "iloc") else None
    if home == "xarray":
        return f"a {type(value).__name__}", ", such as one of its variables"
    unit = getattr(value, "units", getattr(value, "unit", None))
    return (f"in {unit}", "") if unit is not None else None


def _converted(name, convert, value, unit):
    try:
        return np.asarray(convert(value))
    except OverflowError:
        raise _refused(name, value, unit, "beyond the range of numbers") from None
    except (TypeError, ValueError):
        raise _refused(name, value, unit, f"no array of numbers but a {type(value).__name__}") from None


def _refused(name, value, unit, what, remedy=""):
    if not remedy and not unit and what.startswith("in "):
        remedy = ", such as elastica.Strip(…).to_dimensionless makes"
    return ValueError(
        f"{name} = {_shown(value)} is {what}; "
        f"give {'' if unit else 'dimensionless '}numbers{_in(unit)}{remedy}"
    )


def _in(unit):
    return unit and f" in {unit}"


def _shown(value):
    text = " ".join((repr if isinstance(value, (str, bytes)) else str)(value).split())
    return text if len(text) <= 60 else f"{text[:60]}…"
