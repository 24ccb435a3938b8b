"""Charts: the plane of half gap and load, or shortening, coloured by what is stable or by any variable.

Not here: what is stable where (`picture`), colours of states and captions (`style`).
"""

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.ndimage import distance_transform_edt

from elastica.control import CONTROLS
from studies.errors import StudyError
from studies.plot.drawing import new_figure
from studies.plot.picture import picture_of_regions, picture_of_values
from studies.plot.reading import Panel, further_states, restored, solves_exactly, state_variable
from studies.plot.regions import log_spaced
from studies.plot.style import (
    NONE,
    axis_label,
    caption,
    colour,
    end_conditions,
    ink,
    listed,
    require,
    shortest_first,
)
from studies.schema import VARIABLES, control_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

TITLES = {
    "stable": "stable states",
    "preferred": "preferred state",
    "count": "stable states of those searched",
}
STRIPES = 28
"""Stripes across a panel where several states are stable."""
LEAST_ROOM, ROOM_OF_A_SENTENCE = 0.022, 0.12
"""Distance from its edge that a region must have somewhere to bear its name, as part of the panel."""
HATCHED = {
    "none": ("///", "none of the states searched"),
    "unfollowed": ("xxx", "not followed beyond 90°"),
}
"""How regions are hatched of which a chart does not know, and what they are called."""


def chart(dataset: "Dataset", show: str = "stable", state: str | None = None) -> "Figure":
    """Draw the plane of half gap and what is prescribed, one panel for each end condition.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `studies.open` or `studies.run`.
    show : str
        "stable": the stable states, in stripes where there are several; "preferred": the one of least
        energy; "count": how many are stable; or the name of a variable.
    state : str, optional
        Whose variable is shown.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    StudyError
        If what is needed is missing, or the grid is no plane.
    """
    require(dataset, "status", "stability")
    dataset, units = restored(dataset)
    if show == "preferred":
        require(dataset, CONTROLS[control_of(dataset.sizes)].potential)
    position = None if show in TITLES else state_variable(dataset, show, state)
    control = control_of(dataset.sizes)
    for axis in ("H", control):
        if dataset.sizes[axis] < 2:
            raise StudyError(f"the dataset has fewer than two values of {axis}; a chart needs a plane")
    count = len(end_conditions(dataset))
    panels = [Panel.of(dataset.isel(ends=number), control) for number in range(count)]
    exact = solves_exactly(dataset)
    if position is None:
        pictures = [picture_of_regions(panel, show, exact) for panel in panels]
    else:
        pictures = [picture_of_values(panel, show, position, exact) for panel in panels]
    pictures = [picture.shown(units, control, show) for picture in pictures]
    figure, axes = _panels(count)
    for left in axes[:: min(count, 2)]:
        left.set_ylabel(axis_label(control, units))
    draw = {"stable": _draw_sets, "preferred": _draw_sets, "count": _draw_counts}.get(show, _draw_values)
    handles = draw(figure, axes, pictures, show, units)
    for ax, picture in zip(axes, pictures, strict=True):
        _frame(ax, picture, axis_label("H", units))
    handles += _draw_unknown(axes, pictures) + _draw_curves(axes, pictures)
    if handles:
        figure.legend(handles=handles, loc="outside right upper", frameon=False, title=TITLES.get(show))
    caption(figure, dataset, *_explain(dataset, show, state, control, exact, pictures))
    return figure


def _panels(count):
    """A figure and its panels, two beside each other."""
    columns, rows = min(count, 2), -(-count // 2)
    figure = new_figure((4.3 * columns + 2.1, 5.4 * rows))
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for unused in axes[count:]:
        unused.remove()
    return figure, axes[:count]


def _draw_sets(figure, axes, pictures, show, units):
    """Fill the regions with the colours of their states, name them, and list the states."""
    for ax, picture in zip(axes, pictures, strict=True):
        ax.pcolormesh(
            picture.H, picture.given, _painted(picture).transpose(1, 0, 2), shading="nearest", rasterized=True
        )
        for label, states in picture.meaning.items():
            if states:
                background = colour(states[0]) if len(states) == 1 else "#ffffff"
                _name_region(ax, picture, picture.labels == label, " + ".join(states), background)
    found = {states for picture in pictures for states in picture.meaning.values()}
    single = sorted({state for states in found for state in states}, key=shortest_first)
    return [Patch(facecolor=colour(name), edgecolor="0.3", label=name) for name in single]


def _painted(picture):
    """Colours (H, control, 3) of a picture; stripes where several states share a region."""
    rows, columns = np.indices(picture.labels.shape, sparse=True)
    stripe = (STRIPES * (rows / len(picture.H) + columns / len(picture.given))).astype(int)
    painted = np.empty((*picture.labels.shape, 3))
    for label, states in picture.meaning.items():
        inside = picture.labels == label
        colours = np.array([to_rgb(colour(state)) for state in states] or [to_rgb(NONE)])
        painted[inside] = colours[stripe[inside] % len(colours)]
    return painted


def _draw_counts(figure, axes, pictures, show, units):
    """Fill the regions by the number of stable states, the more the darker."""
    most = max(max(picture.meaning) for picture in pictures)
    shades = [NONE, "#d0e1f2", "#94c4df", "#4a98c9", "#1764ab", "#08306b"]
    shades += shades[-1:] * (most + 1 - len(shades))
    for ax, picture in zip(axes, pictures, strict=True):
        ax.pcolormesh(
            picture.H,
            picture.given,
            picture.labels.T,
            cmap=ListedColormap(shades[: most + 1]),
            norm=BoundaryNorm(np.arange(most + 2) - 0.5, most + 1),
            shading="nearest",
            rasterized=True,
        )
        for label, (name,) in picture.meaning.items():
            if label:
                _name_region(ax, picture, picture.labels == label, name, shades[label])
    return [Patch(facecolor=shades[n], edgecolor="0.3", label=str(n)) for n in range(1, most + 1)]


def _draw_values(figure, axes, pictures, show, units):
    """Colour the panels by a variable, with one scale for all; flags in steps with their names."""
    values = np.concatenate([picture.labels[np.isfinite(picture.labels)] for picture in pictures])
    known = VARIABLES.get(show)
    norm, ticks, names = None, None, None
    if known is not None and known.dtype != "f8":
        codes = np.arange(int(values.min()), int(values.max()) + 1)
        norm = BoundaryNorm(np.append(codes, codes[-1] + 1) - 0.5, 256)
        ticks = codes
        if known.flags is not None:
            names = [str(known.flags(code)).replace("_", " ") for code in codes]
    else:
        norm = ScalarMappable(norm=None).norm
        norm.autoscale(values)
    for ax, picture in zip(axes, pictures, strict=True):
        mesh = ax.pcolormesh(
            picture.H,
            picture.given,
            np.ma.masked_invalid(picture.labels.T),
            cmap="cividis",
            norm=norm,
            shading="nearest",
            rasterized=True,
        )
    bar = figure.colorbar(mesh, ax=list(axes), label=axis_label(show, units), ticks=ticks, pad=0.02)
    if names:
        bar.ax.set_yticklabels(names)
    return []


def _draw_unknown(axes, pictures):
    """Hatch what is not known: where none of the states searched is stable, and where none was followed."""
    handles = []
    for field, (hatch, name) in HATCHED.items():
        drawn = False
        for ax, picture in zip(axes, pictures, strict=True):
            inside = getattr(picture, field)
            if not inside.any():
                continue
            area = ax.contourf(
                picture.H, picture.given, inside.T.astype(float), [0.5, 1.5], colors=[NONE], hatches=[hatch]
            )
            area.set(edgecolor="0.6", linewidth=0)
            _name_region(ax, picture, inside, textwrap.fill(name, 16), NONE, ROOM_OF_A_SENTENCE)
            drawn = True
        if drawn:
            handles.append(Patch(facecolor=NONE, edgecolor="0.6", hatch=hatch, label=name))
    return handles


def _draw_curves(axes, pictures):
    """Draw the exact curves, each event in its own line, and list the events."""
    drawn = {}
    for ax, picture in zip(axes, pictures, strict=True):
        for event, H, given in picture.curves:
            (line,) = ax.plot(H, given, color="black", lw=1.2, ls=event.line, label=event.label)
            drawn[event] = Line2D([], [], color="black", lw=1.2, ls=line.get_linestyle(), label=event.label)
    for event, handle in drawn.items():
        handle.set_linestyle(event.line)
    return [drawn[event] for event in sorted(drawn, key=lambda event: event.label)]


def _frame(ax, picture, label):
    """Axes to the first and last label, logarithmic where the labels are."""
    if log_spaced(picture.H):
        ax.set_xscale("log")
    else:
        ax.xaxis.set_major_locator(MaxNLocator(4))
    if log_spaced(picture.given):
        ax.set_yscale("log")
    ax.set(
        xlim=(picture.H[0], picture.H[-1]),
        ylim=(picture.given[0], picture.given[-1]),
        xlabel=label,
        title=picture.ends,
    )


def _name_region(ax, picture, inside, name, background, least=LEAST_ROOM):
    """Write the name of a region where there is most room for it."""
    sampling = [1 / size for size in inside.shape]
    room = distance_transform_edt(np.pad(inside, 1), sampling=sampling)[1:-1, 1:-1]
    if room.max(initial=0) < least:
        return
    roomy = np.argwhere(room > 0.9 * room.max())
    i, j = roomy[np.abs(roomy - roomy.mean(axis=0)).sum(axis=1).argmin()]
    ax.text(
        picture.H[i],
        picture.given[j],
        name,
        ha="center",
        va="center",
        color=ink(background),
        fontsize="small",
        bbox={"facecolor": background, "edgecolor": "none", "pad": 1.5},
    )


def _explain(dataset, show, state, control, exact, pictures):
    """Lines of the caption."""
    what = {
        "stable": "stripes: several states are stable",
        "preferred": "stable state of least " + ("energy" if control == "P" else "bending energy"),
        "count": "number of stable states",
        "status": f"status of {state}",
    }.get(show, f"{show} of {state}; white: no such equilibrium")
    how = (
        "boundaries solved exactly" if exact and show != "status" else "boundaries to the nearest grid point"
    )
    unknown = sorted({name for picture in pictures for name in picture.unknown})
    missing = f"not computed, or only in part: {listed(unknown)}" if unknown else ""
    if any(picture.meaning and (picture.none | picture.unfollowed).any() for picture in pictures):
        missing = "\n".join(filter(None, (missing, further_states(dataset))))
    prescribed = {"P": "stability at given load", "shortening": "stability at given shortening"}[control]
    return f"{what}; {prescribed}; {how}", missing
