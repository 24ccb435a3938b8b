"""Stability charts: the plane of half gap and load, or shortening, coloured by the states that are stable.

Under load control regions are bounded by the exact transition loads, not by the grid: a point of the
picture takes the verdict of the nearest grid point on the same side of every curve. A zone too thin for
the grid is solved where it is.
"""

from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from elastica.codes import Stability, Status
from elastica.ends import parse_ends
from elastica.onsets import EVENTS, loads
from elastica.solution import solve
from elastica.states import is_canonical
from studies.errors import StudyError
from studies.schema import control_of

if TYPE_CHECKING:
    from xarray import Dataset

AXES = {"P": "thrust  $P = P^*L^2/4\\pi^2EI$", "shortening": "shortening  $\\Delta L^*/L$"}
COLOURS = {
    "none": "#ffffff",
    "0": "#d9d9d9",
    "B1": "#56b4e9",
    "U": "#0b4f8a",
    "U-": "#e69f00",
}
"""Light and dark alternate, so that the sequence of regions survives in grey."""
OTHERS = (
    "#009e73",
    "#cc79a7",
    "#f0e442",
    "#d55e00",
    "#999933",
    "#882255",
    "#88ccee",
    "#332288",
    "#ddcc77",
    "#aa4499",
    "#44aa99",
    "#cc6677",
    "#bbbbbb",
    "#117733",
)
NAMES = {
    "buckles": "straight strip buckles",
    "touches": "wall is touched",
    "point_to_line": "point becomes line",
    "flat_buckles": "flat stretch buckles",
    "line_ends": "line state ends in a fold",
}
STYLES = {
    "buckles": ":",
    "touches": "-",
    "point_to_line": "--",
    "flat_buckles": "-.",
    "line_ends": (0, (6, 1.5, 1, 1.5, 1, 1.5)),
}
CONCERNS = {
    "buckles": "0",
    "touches": "B1",
    "point_to_line": "U",
    "flat_buckles": "U-",
    "line_ends": "U-",
}
PICTURE = (420, 900)
"""Points of the picture along H and the control."""


def chart(dataset: "Dataset") -> Figure:
    """Draw the stable states over half gap and what is prescribed, one panel for each end condition.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `studies.open` or `studies.run`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    StudyError
        If a variable that is needed is missing, or the grid is no plane.
    """
    for name in ("status", "stability"):
        if name not in dataset:
            raise StudyError(f"the dataset has no variable {name!r}; a chart cannot be drawn")
    control = control_of(dataset.sizes)
    for axis in ("H", control):
        if dataset.sizes.get(axis, 0) < 2 or not np.isfinite(dataset[axis]).all():
            raise StudyError(f"the dataset has fewer than two values of {axis}; a chart needs a plane")
    panels = dataset.sizes["ends"]
    for number in range(panels):
        _known_ends(str(dataset["ends"].values[number]))
    columns, rows = min(panels, 2), -(-panels // 2)
    figure = Figure(figsize=(4.3 * columns + 1.9, 5.2 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False)
    for unused in axes.flat[panels:]:
        unused.remove()
    for left in axes[:, 0]:
        left.set_ylabel(AXES[control])
    axes = list(axes.flat[:panels])
    pictures = [_picture(dataset.isel(ends=number), control) for number in range(panels)]
    found = {name for picture in pictures for name in np.unique(picture.names)}
    palette = _palette(sorted(found, key=_rank))
    for ax, picture in zip(axes, pictures, strict=True):
        _panel(ax, picture, palette)
    handles = [
        Patch(facecolor=colour, edgecolor="0.3", label=_label(name)) for name, colour in palette.items()
    ]
    curves = {line.get_label(): line for ax in axes for line in ax.get_lines()}
    handles += [curves[name] for name in NAMES.values() if name in curves]
    figure.legend(handles=handles, loc="outside right upper", frameon=False, title="stable states")
    title = dataset.attrs.get("title") or dataset.attrs.get("id", "")
    figure.suptitle(title, fontsize="medium")
    return figure


def save_chart(dataset, path):
    """Draw the chart and write it to `path` (PNG, PDF or SVG by its ending)."""
    path = Path(path)
    chart(dataset).savefig(path, dpi=200)


def _stable_sets(panel):
    """For each point of the plane the names of the stable states, joined."""
    stable = (panel["status"] == Status.SOLVED) & (panel["stability"] == Stability.STABLE)
    stable = stable.transpose("H", ..., "state").values
    names = np.full(stable.shape[:2], "", object)
    for number, state in enumerate(panel["state"].values):
        joined = np.where(names == "", state, names + f" + {state}")
        names = np.where(stable[:, :, number], joined, names)
    names[names == ""] = "none"
    return names.astype(str)


def _rank(name):
    known = list(COLOURS)
    return (known.index(name) if name in known else len(known), name)


def _palette(names):
    """Colour of each set of stable states, the same in every figure for the usual ones."""
    spare = cycle(OTHERS)
    return {name: COLOURS.get(name) or next(spare) for name in names}


def _label(name):
    return "none of those searched" if name == "none" else name


class Picture(NamedTuple):
    """One panel: names of the stable states (H, given) on a fine grid, and the curves over its `H`."""

    ends: str
    H: np.ndarray
    given: np.ndarray
    names: np.ndarray
    curves: dict


def _picture(panel, control):
    """Sharpen the grid of one end condition to a picture."""
    ends, H, given = str(panel["ends"].values), panel["H"].values, panel[control].values
    states = [str(name) for name in panel["state"].values]
    fine_H, fine = (_between(labels, count) for labels, count in zip((H, given), PICTURE, strict=True))
    # The transition loads are those of load control: at prescribed shortening more is stable.
    curves = _curves(ends, fine_H, states) if control == "P" else {}
    names = _sharpen(H, given, _stable_sets(panel), fine_H, fine, curves, ends, states)
    return Picture(ends, fine_H, fine, names, curves)


def _panel(ax, picture, palette):
    """Draw one panel: regions, exact curves, their names."""
    _, H, given, names, curves = picture
    order = list(palette)
    codes = np.vectorize(order.index)(names)
    ax.pcolormesh(
        H,
        given,
        codes.T,
        cmap=ListedColormap(list(palette.values())),
        vmin=-0.5,
        vmax=len(order) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    for event, load in curves.items():
        if ((load >= given[0]) & (load <= given[-1])).any():
            ax.plot(H, load, color="black", lw=1.2, ls=STYLES[event], label=NAMES[event])
    _name_regions(ax, names, H, given, palette)
    if _log_spaced(H):
        ax.set_xscale("log")
    else:
        ax.xaxis.set_major_locator(MaxNLocator(5))
    if _log_spaced(given):
        ax.set_yscale("log")
    ax.set(xlim=(H[0], H[-1]), ylim=(given[0], given[-1]), xlabel="half gap  $H = H^*/L$", title=picture.ends)


def _curves(ends, H, names):
    """Exact loads of the one-contact sequence, of those events that concern the states drawn."""
    return {event: loads(event, H, ends) for event in EVENTS if CONCERNS[event] in names}


def _sharpen(H, P, names, fine_H, fine_P, curves, ends, states):
    """Names on the fine grid: of the nearest grid point on the same side of every curve."""
    coarse, fine = (
        np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        for axes in ((H, P), (fine_H, fine_P))
    )
    zone_coarse, zone_fine = np.zeros(len(coarse), int), np.zeros(len(fine), int)
    for load in curves.values():
        for zone, points in ((zone_coarse, coarse), (zone_fine, fine)):
            edge = np.interp(points[:, 0], fine_H, load)
            zone *= 3
            zone += np.where(np.isnan(edge), 2, points[:, 1] > edge)
    place = fine
    coarse, fine = (
        np.stack([_steps(H, points[:, 0]), _steps(P, points[:, 1])], axis=-1) for points in (coarse, fine)
    )
    flat = names.ravel().astype(object)
    picture = np.empty(len(fine), object)
    for zone in np.unique(zone_fine):
        members, known = np.flatnonzero(zone_fine == zone), np.flatnonzero(zone_coarse == zone)
        if known.size:
            picture[members] = flat[known[cKDTree(coarse[known]).query(fine[members])[1]]]
        else:
            picture[members] = _stable_at(*place[members[len(members) // 2]], ends, states)
    return picture.reshape(len(fine_H), len(fine_P))


def _stable_at(H, P, ends, states):
    """Names of the stable states at one point, joined."""
    known = [name for name in states if is_canonical(name, ends)]
    stable = [name for name in known if solve(name, P=P, H=H, ends=ends).stability == Stability.STABLE]
    return " + ".join(stable) or "none"


def _steps(labels, values):
    """Position of values in steps of the grid, whatever its spacing."""
    return np.interp(values, labels, np.arange(len(labels)))


def _log_spaced(labels):
    """Whether the labels are spaced evenly on a logarithmic axis and not on a linear one."""
    return len(labels) > 2 and labels[0] > 0 and np.ptp(np.diff(np.log(labels))) < 1e-6


def _between(labels, count):
    """Evenly spaced points of the picture between the first and the last label."""
    return (np.geomspace if _log_spaced(labels) else np.linspace)(labels[0], labels[-1], count)


def _known_ends(ends):
    try:
        parse_ends(ends)
    except ValueError as problem:
        raise StudyError(f"the dataset cannot be drawn: {problem}") from None


def _name_regions(ax, picture, H, given, palette):
    """Write the name of each region where there is most room for it."""
    for name in palette:
        inside = np.pad(picture == name, 1)
        room = distance_transform_edt(inside, sampling=(2.0, 1.0))[1:-1, 1:-1]
        if room.max(initial=0) < 8:
            continue
        roomy = np.argwhere(room > 0.9 * room.max())
        i, j = roomy[np.abs(roomy - roomy.mean(axis=0)).sum(axis=1).argmin()]
        dark = sum(int(palette[name][k : k + 2], 16) for k in (1, 3, 5)) < 330
        ax.text(
            H[i],
            given[j],
            name if name != "none" else "none stable",
            ha="center",
            va="center",
            color="white" if dark else "black",
            fontsize="small",
            bbox={"facecolor": palette[name], "edgecolor": "none", "pad": 1.5},
        )
