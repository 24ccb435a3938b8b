"""One look for every figure: the colour of a state, the line of a verdict and of an event, axes, captions.

A state has its colour by its name alone, so it keeps it from figure to figure. The colours of states that
are stable beside each other differ in lightness as much as in hue: they are told apart in grey, and by
eyes that do not see all hues.
"""

import zlib
from enum import Enum

from elastica.codes import Stability
from elastica.ends import parse_ends
from elastica.spelling import did_you_mean
from elastica.strip import GIVEN
from studies.errors import StudyError
from studies.messages import cut, printable
from studies.schema import VARIABLES
from studies.units import STRIP, strip_of

MOST_OF_TEXT = 120
"""Characters of a text of a file in a figure."""
COLOURS = {
    "0": "#d9d9d9",
    "B1": "#56b4e9",
    "B2": "#a6bddb",
    "U": "#0b4f8a",
    "U-": "#e69f00",
    "Ua": "#cc6677",
    "UU": "#999933",
    "UD": "#8fd3b6",
    "UD-": "#b0447a",
    "UDU": "#7a3b00",
    "UDU-": "#f0e442",
    "UDUD": "#9ec5ff",
    "UDUD-": "#006d4a",
}
"""Light and dark alternate along the sequence of stable states, pale ones among those with a contact more."""
OTHERS = (
    "#882255",
    "#44aa99",
    "#ddcc77",
    "#332288",
    "#aa4499",
    "#117733",
    "#88ccee",
    "#d55e00",
    "#737373",
    "#b15928",
    "#6a51a3",
    "#41ab5d",
    "#fb9a99",
    "#2c7fb8",
    "#bcbd22",
    "#525252",
)
NONE = "#f2f2f2"
"""Where no state is known to be stable."""

AXES = {
    "P": ("thrust", "P = ", "P^*", "L^2/4\\pi^2EI"),
    "shortening": ("shortening", "\\Delta L = ", "\\Delta L^*", "/L"),
    "H": ("half gap", "H = ", "H^*", "/L"),
    "curvature": ("curvature", "\\kappa = L", "\\kappa^*", ""),
    "energy": ("energy", "", "V^*", "L/4\\pi^2EI"),
    "bending_energy": ("bending energy", "", "U^*", "L/4\\pi^2EI"),
    "reaction": ("sum of reactions", "", "\\mu^*", "L^2/4\\pi^2EI"),
}
"""What an axis shows: its name, and what is before and after the dimensional quantity in its definition."""

VERDICTS = {
    Stability.STABLE: "-",
    Stability.NEUTRAL_FAMILY: (0, (12, 2)),
    Stability.CRITICAL: (0, (12, 2)),
    Stability.UNSTABLE_THIRD_ORDER: (0, (8, 1.5, 1, 1.5)),
}
UNSTABLE = {1: (0, (5, 2)), 2: (0, (3, 1.5, 1, 1.5))}
"""Line of an unstable state by its index; of larger ones `MORE_UNSTABLE`."""
MORE_UNSTABLE = (0, (1, 1.8))


class Boundary(Enum):
    """What happens to a state where a region of the plane, or a branch, ends: its name and its line."""

    BUCKLES = "straight strip buckles", ":"
    WALL_TOUCHED = "wall is touched", "-"
    POINT_TO_LINE = "point becomes line", "--"
    FLAT_BUCKLES = "flat stretch buckles", "-."
    FOLD = "fold", (0, (6, 1.5, 1, 1.5, 1, 1.5))
    RIGHT_ANGLE = "right angle, not followed beyond", (0, (3, 1.2, 3, 1.2, 1, 1.2))
    NOT_FOLLOWED = "not followed beyond", (0, (2, 2))
    EQUAL_ENERGY = "equal energy", (0, (1, 3.5))

    @property
    def label(self):
        """Name in legends."""
        return self.value[0]

    @property
    def line(self):
        """Line style."""
        return self.value[1]


def colour(state):
    """Colour of a state, by its name without the number of the root."""
    name = state.partition(":")[0]
    return COLOURS.get(name) or OTHERS[zlib.crc32(name.encode()) % len(OTHERS)]


def ink(background):
    """Black or white, whichever can be read on a colour."""
    red, green, blue = (int(background[k : k + 2], 16) for k in (1, 3, 5))
    return "black" if 0.299 * red + 0.587 * green + 0.114 * blue > 125 else "white"


def verdict_line(stability, index):
    """Line style of a state with this verdict."""
    return VERDICTS.get(Stability(stability)) or UNSTABLE.get(index, MORE_UNSTABLE)


def verdict_name(stability, index):
    """Legend of such a line."""
    verdict = Stability(stability)
    if verdict == Stability.UNSTABLE:
        return f"unstable, index {index}" if index in UNSTABLE else "unstable, index 3 or more"
    return str(verdict).replace("_", " ").replace("unstable third", "unstable at third")


def axis_label(variable, units):
    """Label of an axis: with the definition of what it shows, or with its unit where it has one."""
    known = VARIABLES.get(variable)
    if variable in units.unknown:
        return variable
    unit = units.unit(variable)
    if variable in AXES:
        name, before, star, after = AXES[variable]
        return f"{name}  ${star}$  [{unit}]" if unit else f"{name}  ${before}{star}{after}$"
    if known is None:
        return variable
    unit = unit or ("" if known.units == "1" else known.units)
    return f"{known.long_name}  [{unit}]" if unit else known.long_name


def caption(figure, dataset, *parameters):
    """Title of the dataset over the figure, and below it what its numbers mean and where they are from."""
    title, known, study = (_plain(dataset.attrs.get(key, "")) for key in ("title", "id", "study_id"))
    figure.suptitle(title or known, fontsize="medium", parse_math=False)
    source = ", ".join(f"{name} {text}" for name, text in (("data", known), ("study", study)) if text)
    lines = [part for part in (*parameters, _strip(dataset), source) if part]
    figure.supxlabel("\n".join(lines), fontsize="x-small", color="0.3", parse_math=False)


def _plain(text):
    """A text of a file, as it stands in a figure: in one line, and not longer than that."""
    return cut(printable(text), MOST_OF_TEXT)


def _strip(dataset):
    """The strip of a dataset in physical units, in words."""
    if STRIP not in dataset.attrs:
        return ""
    strip = strip_of(dataset)
    given = {name: getattr(strip, name) for name in GIVEN}
    return "strip: " + ", ".join(f"{name} {value:g} {GIVEN[name]}" for name, value in given.items() if value)


def end_conditions(dataset):
    """The end conditions of a dataset.

    Raises
    ------
    StudyError
        If they cannot be understood.
    """
    names = [str(name) for name in dataset["ends"].values]
    for name in names:
        try:
            parse_ends(name)
        except ValueError as problem:
            raise StudyError(f"the dataset cannot be drawn: {problem}") from None
    return names


def shortest_first(state):
    """Key of the order in which states are listed, whatever their order in a dataset."""
    return len(state), state


def listed(names, wrong="", most=20):
    """Names in a sentence, of many the first; and which of them was meant by one that is wrong."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more + did_you_mean(wrong, names)


def require(dataset, *names):
    """Refuse a dataset that lacks variables.

    Raises
    ------
    StudyError
    """
    missing = [name for name in names if name not in dataset]
    if missing:
        raise StudyError(
            f"the dataset has no variable {missing[0]!r}, without which this cannot be drawn; "
            f"it has {', '.join(sorted(map(str, dataset.data_vars))) or 'none'}"
        )
