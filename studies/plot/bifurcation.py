"""Bifurcation diagrams: the load over shortening, or another quantity, of all states at one gap."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from elastica.codes import Stability
from studies.errors import StudyError
from studies.plot.branches import MOST_INDEX, QUANTITIES, branches, jumps
from studies.plot.drawing import new_figure
from studies.plot.reading import method_of, nearest_label, restored, solves_exactly
from studies.plot.style import (
    Boundary,
    axis_label,
    caption,
    colour,
    end_conditions,
    listed,
    require,
    verdict_line,
    verdict_name,
)
from studies.schema import control_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

MARKERS = {
    Boundary.BUCKLES: "P",
    Boundary.WALL_TOUCHED: "o",
    Boundary.POINT_TO_LINE: "s",
    Boundary.FLAT_BUCKLES: "D",
    Boundary.FOLD: "^",
    Boundary.RIGHT_ANGLE: "X",
}
MOST_UNTOLD = 4
AT = {"P": "the load", "shortening": "the shortening"}
ARROWS = {"P": ("black", "jump at given load"), "shortening": ("#b2182b", "jump at given shortening")}


def bifurcation(
    dataset: "Dataset",
    H: float | None = None,
    show: str = "shortening",
    states: Sequence[str] | None = None,
) -> "Figure":
    """Draw the load over another quantity for all states at one gap, one panel for each end condition.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `studies.open` or `studies.run`.
    H : float, optional
        Half gap; the nearest label is taken, and the caption says which. Without it the middle one.
    show : str
        "shortening" (default), "curvature", "energy", "bending_energy" or "reaction".
    states : sequence of str, optional
        Only these.

    Returns
    -------
    matplotlib.figure.Figure
        Stable states solid, unstable ones dashed by their index; events marked; arrows from where a stable
        state is lost, at given load and at given shortening, to where a strip goes that is loaded slowly, as
        `studies.loading_path` tells it. Where that cannot be told the caption says so instead. Of chains
        there are no arrows.

    Raises
    ------
    StudyError
        If something that is needed is missing.
    """
    if show not in QUANTITIES[1:]:
        raise StudyError(f"show = {show!r} is not possible; use {listed(QUANTITIES[1:], show)}")
    dataset, units = restored(dataset)
    control = control_of(dataset.sizes)
    exact, told = solves_exactly(dataset), method_of(dataset) == "exact"
    needed = () if exact else ("index", "stability", {"P": "shortening", "shortening": "P"}[control], show)
    require(dataset, "status", *(name for name in needed if name != control))
    if dataset.sizes.get(control, 0) < 2:
        raise StudyError(f"the dataset has fewer than two values of {control}; a branch needs more")
    dataset = _only(dataset, states)
    gap = float(dataset["H"].values[nearest_label(dataset, "H", H, units)])
    panels = [dataset.isel(ends=number).sel(H=gap) for number in range(len(end_conditions(dataset)))]
    figure = new_figure((5.2 * min(len(panels), 2) + 2.3, 5.4 * -(-len(panels) // 2)))
    axes = figure.subplots(-(-len(panels) // 2), min(len(panels), 2), squeeze=False).ravel()
    for unused in axes[len(panels) :]:
        unused.remove()
    handles: dict[tuple[int, str], Line2D] = {}
    untold = []
    for ax, panel in zip(axes, panels, strict=False):
        pieces = branches(panel, control)
        if not pieces:
            raise StudyError(f"no state is solved for {panel['ends'].values} at H = {units.text('H', gap)}")
        _draw(ax, pieces, show, handles, units)
        place = str(panel["ends"].values), gap
        found = [jump for kind in ARROWS if told for jump in jumps(pieces, kind, control, *place)]
        _arrows(ax, [jump for jump in found if jump.stop], show, handles, units)
        untold += [_untold(jump, units, panel) for jump in found if not jump.stop]
        ax.set(title=str(panel["ends"].values), xlabel=axis_label(show, units), ylabel=axis_label("P", units))
    order = sorted(handles, key=lambda key: (key[0], str(key[1])))
    figure.legend(
        handles=[handles[key] for key in order],
        loc="outside right upper",
        frameon=False,
        fontsize="small",
        handlelength=3,
        ncols=1 + (len(order) > 24),
    )
    nearest = (
        "" if H is None or np.isclose(units.shown("H", gap), H, rtol=1e-9) else f", the label next to {H:g}"
    )
    what = f"H = {units.text('H', gap)}{nearest}; verdicts at given " + (
        "load" if control == "P" else "shortening"
    )
    how = "" if exact else "; values of the grid points, events to the nearest of them"
    arrows = (
        "arrows: where a strip goes that is loaded slowly" if told else "no arrows: of the exact method only"
    )
    caption(figure, dataset, f"{what}; {arrows}{how}", *_lines(untold))
    return figure


def _only(dataset, states):
    """The dataset with some of its states."""
    if not states:
        return dataset
    names = [str(name) for name in dataset["state"].values]
    for name in states:
        if name not in names:
            raise StudyError(f"state = {name!r} is none of the dataset's; name one of {listed(names, name)}")
    return dataset.isel(state=[names.index(name) for name in states])


def _draw(ax, pieces, show, handles, units):
    """Draw the branches of one panel; `handles` collects its legend: states, verdicts, events."""
    for piece in sorted(pieces, key=lambda piece: piece.stability == Stability.STABLE):
        stable = piece.stability == Stability.STABLE
        far = piece.negative >= MOST_INDEX
        look: dict[str, Any] = {
            "color": colour(piece.state),
            "ls": verdict_line(piece.stability, piece.negative),
            "lw": 2.4 if stable else 0.6 if far else 1.2,
        }
        x, P = (units.shown(quantity, piece.values[quantity]) for quantity in (show, "P"))
        ax.plot(x, P, label=piece.state, zorder=3 if stable else 2, **look)
        name = piece.state.partition(":")[0]
        if not far:
            handles.setdefault((0, name), Line2D([], [], color=colour(name), lw=2.4, label=name))
        verdict = verdict_name(piece.stability, piece.negative)
        handles.setdefault(
            (1, verdict), Line2D([], [], color="0.3", ls=look["ls"], lw=look["lw"], label=verdict)
        )
        for event, at in zip(piece.events, (0, -1), strict=True):
            if event is None:
                continue
            mark: dict[str, Any] = {
                "marker": MARKERS[event],
                "mfc": "white",
                "mec": "black",
                "ms": 5 if stable else 3,
            }
            ax.plot(x[at], P[at], ls="none", zorder=4, **mark)
            handles.setdefault(
                (2, event.label), Line2D([], [], ls="none", label=event.label, **mark | {"ms": 5})
            )


def _arrows(ax, found, show, handles, units):
    """Draw jumps and bring the picture to where they lead."""
    for jump in found:
        shade, label = ARROWS[jump.control]
        stop, start = (tuple(units.shown(q, at[q]) for q in (show, "P")) for at in (jump.stop, jump.start))
        ax.annotate(
            "",
            stop,
            start,
            arrowprops={"arrowstyle": "-|>", "color": shade, "lw": 1.3, "shrinkA": 3, "shrinkB": 1},
            zorder=5,
        ).set_gid(f"{jump.control} {jump.state} {jump.other_state}")
        # An arrow to a point outside of the axes would not be drawn.
        ax.update_datalim([stop])
        handles.setdefault((3, jump.control), Line2D([], [], color=shade, marker=">", lw=1.3, label=label))
    ax.autoscale_view()


def _untold(jump, units, panel):
    """The words for an arrow that is left out."""
    where = (
        f"{AT[jump.control]} {units.text(jump.control, jump.start[jump.control])} ({panel['ends'].values})"
    )
    if jump.other_state == "?":
        return f"{jump.state} is lost at {where}: it cannot be told where the strip goes"
    return f"{jump.state} goes on beyond {where}, but is not followed"


def _lines(untold):
    """The words for the arrows that are left out, of many the first."""
    more = [f"and {len(untold) - MOST_UNTOLD} more without an arrow"] if len(untold) > MOST_UNTOLD else []
    return [*untold[:MOST_UNTOLD], *more]
