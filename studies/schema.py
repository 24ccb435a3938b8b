"""What a dataset contains: its variables with dimensions, types and meanings.

A dataset is one netCDF-4 file (CF-1.11, ACDD) that needs none of this code: `ncdump -h FILE.nc` shows all
that is said here, and xarray, MATLAB, Julia or R read it.

    ends  H  P  state            status, stability, index, nullity, curvature, energy, … (`VARIABLES`)
    ends  H  P  state  contact   reaction, contact_position
    ends  H  P  state  mode      eigenvalue, frequency: if [outputs] asks for them
    ends  H  P  state  s         theta, x, y: if [outputs] asks for shapes
    ends  H  P                   stable_count, preferred_state
    transition                   transition_ends, _H, _P, _state, _other_state, _event, …: if [outputs] asks
                                 for them; one row an event (`TRANSITIONS`)
    failure                      failure_ends, failure_H, failure_P, failure_state: positions; failure_reason

* At prescribed shortening `shortening` is the dimension in place of `P`, which becomes a variable; the
  attribute `control` says which. The failure table is there only if points failed.
* The transition table has the events of every state of the dataset at every gap, between the first and the
  last load, exactly and not to the nearest grid point. It holds names and numbers, not positions. The
  attribute `transitions_failed` tells where events could not be found.
* Numbers are dimensionless, `comment` tells by what they were divided; NaN where there is nothing.
* Codes are small integers whose meanings stand in `flag_meanings`. `status`: 0 solved, 1 no_equilibrium,
  2 inadmissible (a contact would have to pull, or a bump passes a wall: values kept, no verdict), 3 failed,
  4 not_followed (the search ended before it could tell, mostly at 90°; since format 2), −1 not_computed.
  `stability`: 0 stable, 1 unstable, 2 unstable_third_order, 3 neutral_family, 4 critical
  (about to change), −1 not_solved.
* `ends` and `state` are text, the names of `elastica.ends` and `elastica.states`. States that are solved
  nowhere are left out unless the study names them; the attribute `states_searched` lists all.
* A merged dataset may lack points, so many that `points_not_computed` says, and states at points of some of
  the datasets: `states_not_computed` names those, with what may have been left out there.
* Attributes: `config_json` (the whole study), `study_id`, `numerics_id` (datasets that share it can be
  merged), `format_version`, versions of the code and libraries, `history`, and `content_hash` over all
  values, which `elastica check` verifies. Every chunk carries a checksum.

Not here: how they are computed (`evaluate`) and written (`files`).
"""

from typing import Any, NamedTuple

import numpy as np

from elastica.codes import CODES, Code, Status
from elastica.control import CONTROLS, LOAD, SHORTENING
from elastica.properties import ON_DEMAND, QUANTITIES
from elastica.state import is_canonical

LABEL_DIGITS = 12
FORMAT_VERSION = 2
"""Raised whenever an older version would misread a file; files of older formats still open."""
ANY_NAME = "1/2"
"""Ends at which every name of a state has a meaning."""
GRID = ("ends", "H", "control")
"""Dimensions of a grid point; `control` stands for the name of what is prescribed."""
STATES = (*GRID, "state")


class Variable(NamedTuple):
    """A data variable: its type, dimensions and CF attributes; `missing` fills what is not known.

    `scale` is the one of `Strip.scales` that makes it physical, "" for none.
    """

    dtype: str
    dims: tuple
    long_name: str
    missing: float = np.nan
    comment: str = ""
    flags: type[Code] | None = None
    units: str = "1"
    scale: str = ""

    @property
    def along(self):
        """Its dimension besides those of a state: "contact", "mode" or "s"; "" for none."""
        return "".join(self.dims[len(STATES) :])

    @property
    def attributes(self):
        """CF attributes of the variable."""
        attributes: dict[str, Any] = {"long_name": self.long_name}
        if self.comment:
            attributes["comment"] = self.comment
        if self.flags is not None:
            codes = list(self.flags)
            attributes["flag_values"] = np.array([code.value for code in codes], self.dtype)
            attributes["flag_meanings"] = " ".join(map(str, codes))
        elif self.units:
            attributes["units"] = self.units
        return attributes


def _of(names, table):
    """Variables of a table of quantities."""
    return {
        name: Variable(
            each.dtype,
            (*STATES, each.along) if each.along else STATES,
            each.long_name,
            each.missing,
            each.comment,
            CODES.get(name),
            each.units,
            each.scale,
        )
        for name, each in table.items()
        if name in names
    }


VARIABLES = {
    **_of(QUANTITIES.keys() - {"H", "error"}, QUANTITIES),
    **_of(ON_DEMAND, ON_DEMAND),
    **_of(["error"], QUANTITIES),
    "stable_count": Variable(
        "i2", GRID, "number of states with stability stable", -1, comment="-1 where no state is computed"
    ),
    "preferred_state": Variable(
        "i2",
        GRID,
        "position along state of the stable state that is preferred",
        -1,
        comment="of least energy, or bending_energy at prescribed shortening; -1 where no state is stable",
    ),
}

EVENT = ("transition",)
TRANSITIONS = {
    "transition_ends": Variable("S1", EVENT, "end conditions at A and B of an event", units=""),
    "transition_H": Variable("f8", EVENT, "half gap of an event", comment="H*/L", scale="distance"),
    "transition_P": Variable("f8", EVENT, "thrust at an event", comment="P* L^2/(4 pi^2 EI)", scale="force"),
    "transition_shortening": Variable(
        "f8", EVENT, "approach of the ends at an event", comment="Delta L*/L", scale="distance"
    ),
    "transition_state": Variable("S1", EVENT, "state to which an event happens", units=""),
    "transition_other_state": Variable(
        "S1", EVENT, "state that is met at an event", comment="empty if none is known", units=""
    ),
    "transition_event": Variable("i1", EVENT, "what happens to the state", flags=CODES["event"]),
    "transition_index_before": Variable(
        "i2", EVENT, "index of the state just below the load", comment="-1 where it does not exist"
    ),
    "transition_index_after": Variable(
        "i2", EVENT, "index of the state just above the load", comment="-1 where it does not exist"
    ),
}
"""Columns of the transition table, as `elastica.transitions` has them."""
TRANSITIONS_FAILED = "transitions_failed"
"""Attribute that tells where transitions could not be found, and why."""
STATES_NOT_COMPUTED = "states_not_computed"
"""Attribute of a merged dataset that names the states which are not computed at all its points."""

COORDINATES = {
    "ends": {"long_name": "end conditions at A and B"},
    "H": {"long_name": "half gap between the walls", "units": "1", "comment": "H*/L"},
    **{name: VARIABLES[name].attributes for name in CONTROLS},
    "state": {"long_name": "name of the equilibrium state"},
    "contact": {"long_name": "number of the contact, counted from end A"},
    "mode": {"long_name": "number of the mode, by increasing eigenvalue"},
    "s": {"long_name": "arc length from end A", "units": "1", "comment": "divided by L"},
}


def coordinates(ends, H, control, prescribed, names, outputs):
    """Labels of every dimension that a dataset with these states and outputs has.

    Parameters
    ----------
    ends, names : sequence of str
    H : sequence of float
    control : str
        What is prescribed, "P" or "shortening".
    prescribed : sequence of float
        Its values.
    outputs : studies.design.tables.Outputs

    Returns
    -------
    dict of str to ndarray
        In the order of the dimensions.
    """
    contacts = max((name.count("U") + name.count("D") for name in names), default=0)
    axes = {"ends": ends, "H": H, control: prescribed, "state": names}
    labels = {name: np.array(values) for name, values in axes.items()}
    if contacts:
        labels["contact"] = np.arange(1, contacts + 1, dtype="i2")
    if outputs.eigenvalues or outputs.frequencies:
        labels["mode"] = np.arange(1, max(outputs.eigenvalues, outputs.frequencies) + 1, dtype="i2")
    if outputs.shapes:
        labels["s"] = np.linspace(0, 1, outputs.shapes)
    return labels


def canonical(value):
    """A label with 12 significant digits, so that the same label from another grid compares equal."""
    return float(f"{value:.{LABEL_DIGITS - 1}e}") + 0.0


def control_of(labels):
    """What is prescribed in a dataset with these dimensions."""
    return (SHORTENING if SHORTENING.name in labels else LOAD).name


def every_variable(control):
    """All variables that a dataset may have where this is prescribed, with the names of its dimensions."""
    return {
        name: variable._replace(dims=tuple(control if dim == "control" else dim for dim in variable.dims))
        for name, variable in VARIABLES.items()
        if name != control
    }


def variables(labels, outputs):
    """The variables of a dataset, with the names of its dimensions: those it has labels for and asks for."""
    unwanted = {
        *(["eigenvalue"] if not outputs.eigenvalues else []),
        *(["frequency"] if not outputs.frequencies else []),
    }
    return {
        name: variable
        for name, variable in every_variable(control_of(labels)).items()
        if name not in unwanted and set(variable.dims) <= set(labels)
    }


def per_state(labels, outputs):
    """Those of the variables that are given for each state, not only for each grid point."""
    return {
        name: variable for name, variable in variables(labels, outputs).items() if "state" in variable.dims
    }


def failure_indices(control):
    """Columns of the failure table that say where a point is."""
    return tuple(f"failure_{axis}" for axis in ("ends", "H", control, "state"))


def first_root(name):
    """Name of the first root of a state's word: of the state itself where it is one."""
    return name.partition(":")[0]


def status_unless_found(states, ends):
    """Status of states where they are not found: no equilibrium, if they have a meaning with these ends."""
    has_meaning = [is_canonical(first_root(state), ends) for state in states]
    return np.where(has_meaning, Status.NO_EQUILIBRIUM, Status.NOT_COMPUTED).astype("i1")


def nothing_found(points, ends, control, states, outputs):
    """Variables of points with the same ends as long as nothing is found.

    Parameters
    ----------
    points : int
    ends, control : str
    states : sequence of str
        Their labels.
    outputs : studies.design.tables.Outputs

    Returns
    -------
    dict of str to ndarray, shape (points, states, ...)
    """
    labels = coordinates((ends,), (), control, (), states, outputs)
    arrays = {
        name: np.full(
            (points, *(labels[dim].size for dim in variable.dims[3:])), variable.missing, variable.dtype
        )
        for name, variable in per_state(labels, outputs).items()
    }
    arrays["status"][:] = status_unless_found(states, ends)
    return arrays


def absent(name, status, among, states):
    """Status of a state where it was not found: if a root of its word was not followed, neither was it.

    Parameters
    ----------
    name : str
    status : ndarray of int, shape (...)
        NO_EQUILIBRIUM where it was not found.
    among : ndarray of int, shape (..., states)
        Status of other roots of the word, among others.
    states : sequence of str
        Their labels.

    Returns
    -------
    ndarray of int, shape (...)
    """
    word = first_root(name)
    roots = [number for number, state in enumerate(states) if first_root(state) == word]
    lost = (among[..., roots] == Status.NOT_FOLLOWED).any(axis=-1)
    return np.where(lost & (status == Status.NO_EQUILIBRIUM), Status.NOT_FOLLOWED, status)


def word_failed(status, states):
    """Whether the search for a state's word failed: then nothing is known of its higher roots.

    Parameters
    ----------
    status : ndarray, shape (..., states)
    states : sequence of str
        Labels of the states.

    Returns
    -------
    ndarray of bool, shape (..., states)
    """
    failed = status == Status.FAILED
    place = {state: number for number, state in enumerate(states)}
    first = [place.get(first_root(state), number) for state, number in place.items()]
    return failed | failed[..., first]
