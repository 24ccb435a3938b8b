"""Whether a file has the structure of a dataset, on which every reader relies: dimensions, types, labels.

Not here: whether the values are those that were written (`files`) and are right (`checking`).
"""

import json
from itertools import zip_longest

import numpy as np

from elastica.ends import parse_ends
from elastica.state import parse_state
from studies.messages import named, shown
from studies.schema import ANY_NAME, STATES_NOT_COMPUTED, TRANSITIONS, VARIABLES, control_of, every_variable

MEANING = ("units", "flag_values", "flag_meanings")
"""Attributes that say what values mean."""
FOR_READERS = ("long_name", "standard_name", "comment")
MOST_WORDS = 2000
"""Characters of a text for readers."""
TIMES = ("days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds")
"""Units, beside those since a date, that make readers take numbers for times."""
TEXTS = (
    *("study_id", "numerics_id", "content_hash", "config_json", "control", "states_searched"),
    STATES_NOT_COMPUTED,
)
KNOWN_FLAGS = {
    name: {(code.value, str(code)) for code in variable.flags}
    for name, variable in (VARIABLES | TRANSITIONS).items()
    if variable.flags
}
"""Codes with their names, by variable. Those that a later version added a file need not have."""


def fault(dataset):
    """The first thing that is wrong with the structure of an open dataset.

    Parameters
    ----------
    dataset : netCDF4.Dataset

    Returns
    -------
    str or None
        In words; None if nothing is wrong.
    """
    for name in set(TEXTS) & set(dataset.ncattrs()):
        if not isinstance(dataset.getncattr(name), str):
            return f"the attribute {name} is no text"
    if not isinstance(getattr(dataset, "numerics_version", 0), (int, np.integer)):
        return "the attribute numerics_version is no whole number"
    if "config_json" in dataset.ncattrs() and not _is_table(dataset.config_json):
        return "the attribute config_json holds no study"
    if "coordinates" in dataset.ncattrs():
        return "the attribute coordinates makes coordinates of variables"
    for name, variable in dataset.variables.items():
        if problem := _fault_of_attributes(variable):
            return f"{named(name)} {problem}"
    control = control_of(dataset.dimensions)
    axes = ("ends", "H", control, "state")
    for axis in axes:
        problem = _fault_of_axis(dataset, axis, "f8" if axis in ("H", control) else "S1")
        if problem:
            return problem
    ends, states = (_texts(dataset.variables[axis]) for axis in ("ends", "state"))
    if len(set(ends)) < len(ends) or len(set(states)) < len(states):
        return "two labels of ends or of state are the same"
    if strange := [text for text in ends if not _is_known(parse_ends, text)]:
        return f"{shown(strange[0])} is no end condition"
    # Of a selection of ends, some may have no meaning at those that are left.
    if strange := [text for text in states if not _is_known(parse_state, text, ANY_NAME)]:
        return f"{shown(strange[0])} is no state"
    if "status" not in dataset.variables:
        return "status is missing"
    for name, expected in every_variable(control).items():
        variable = dataset.variables.get(name)
        if variable is None:
            continue
        if variable.dimensions != expected.dims:
            return f"{name} has dimensions {variable.dimensions}, not {expected.dims}"
        if not is_type(variable, expected.dtype):
            return f"{name} has values of type {variable.dtype}, not {expected.dtype}"
    return _fault_of_failures(dataset, axes)


def _fault_of_attributes(variable):
    """What is wrong with the attributes of a variable: readers decode its values by them."""
    is_text = variable.dtype == "S1"
    attributes = variable.__dict__
    for key, value in attributes.items():
        if key == "_FillValue":
            good = np.dtype(variable.dtype).kind == "f" and np.size(value) == 1 and np.isnan(value).all()
        elif key == "_Encoding":
            good = is_text and value == "utf-8"
        elif key == "units":
            good = isinstance(value, str) and "since" not in value and value not in TIMES
        elif key in ("flag_values", "flag_meanings"):
            good = _flags(attributes) <= KNOWN_FLAGS.get(variable.name, set())
        else:
            good = key in FOR_READERS and isinstance(value, str) and len(value) <= MOST_WORDS
        if not good:
            return f"has the attribute {named(key)} = {shown(value)}, with which its values would be misread"
    if is_text and "_Encoding" not in attributes:
        return "has no attribute _Encoding"
    return None


def _is_table(text):
    """Whether a text is a table in JSON."""
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _flags(attributes):
    """Codes with their names, as attributes give them."""
    values = np.atleast_1d(attributes.get("flag_values", ())).tolist()
    names = str(attributes.get("flag_meanings", "")).split()
    return set(zip_longest(values, names))


def is_type(variable, dtype):
    """Whether values are of a type, in either order of bytes."""
    if variable.dtype is str:
        # What other programs make of characters.
        return dtype == "S1"
    return isinstance(variable.dtype, np.dtype) and variable.dtype.newbyteorder("=") == np.dtype(dtype)


def _fault_of_axis(dataset, axis, dtype):
    variable = dataset.variables.get(axis)
    if variable is None:
        return f"{axis} is missing"
    dims = variable.dimensions[: -1 if variable.dtype == "S1" else None]
    if dims != (axis,) or not is_type(variable, dtype) or variable.size == 0:
        return f"{axis} has no labels along itself"
    if dtype == "f8":
        values = variable[:]
        if not (np.isfinite(values).all() and (np.diff(values) > 0).all()):
            return f"the labels of {axis} are no increasing numbers"
    return None


def _texts(variable):
    if variable.dtype is str:
        return variable[:].tolist()
    return [row.tobytes().rstrip(b"\0").decode(errors="replace") for row in variable[:]]


def _is_known(parse, *arguments):
    try:
        parse(*arguments)
    except ValueError:
        return False
    return True


def _fault_of_failures(dataset, axes):
    """Rows of the table of failures that are of no point of the dataset."""
    if "failure" not in dataset.dimensions:
        return None
    for axis in axes:
        column = dataset.variables.get(f"failure_{axis}")
        if column is None or column.dimensions != ("failure",) or not is_type(column, "i4"):
            return f"the table of failures has no column for {axis}"
        rows = column[:]
        if ((rows < 0) | (rows >= dataset.dimensions[axis].size)).any():
            return f"the table of failures has points outside {axis}"
    reasons = dataset.variables.get("failure_reason")
    if reasons is None or reasons.dimensions[:1] != ("failure",) or not is_type(reasons, "S1"):
        return "the table of failures has no reasons"
    return None
