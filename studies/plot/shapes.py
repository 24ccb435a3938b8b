"""Strips between their walls, drawn to scale with contacts and reactions; and films along a loading path."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.patches import Rectangle

from elastica.codes import Stability, Status
from elastica.scales import FOUR_PI_SQUARED
from elastica.solution import Solution
from elastica.solving import solve
from studies.errors import StudyError
from studies.plot.drawing import finished_elsewhere, new_figure
from studies.plot.reading import method_of, nearest_label, restored
from studies.plot.style import caption, colour, end_conditions, listed, require, verdict_name
from studies.schema import control_of
from studies.units import NUMBERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

SAMPLES = 301
MOST_STRIPS, ALONG = 12, 6
"""Strips of a figure, and of a branch."""
FLAT = 0.12
"""Half gap of the drawing, in strip lengths, below which heights are stretched."""


class Configuration(NamedTuple):
    """One equilibrium: `solution` has a single point."""

    solution: Solution

    @classmethod
    def at(cls, given, H, state, ends, control="P"):
        """Solve a state at a point.

        Raises
        ------
        StudyError
            If it has no equilibrium there.
        """
        try:
            point: dict[str, Any] = {"H": [float(H)], control: [float(given)]}
            solution = solve(state, ends=ends, **point)
        except ValueError as problem:
            raise StudyError(str(problem)) from None
        if solution.status[0] not in (Status.SOLVED, Status.INADMISSIBLE):
            where = f"{control} = {given:g}, H = {H:g} ({ends})"
            raise StudyError(f"state = {state!r} has no equilibrium at {where}; choose another point")
        return cls(solution)

    @property
    def verdict(self):
        """In words."""
        if self.solution.status[0] == Status.INADMISSIBLE:
            return "inadmissible"
        return verdict_name(int(self.solution.stability[0]), int(self.solution.index[0]))

    @property
    def stable(self):
        """Whether it is stable under its control."""
        return self.solution.stability[0] == Stability.STABLE

    @property
    def presses(self):
        """Arc length and size of each point force of the walls.

        A line presses at its two ends only, each with the λ of the free segment that leaves it there: what
        lies flat has no curvature, and so no shear force that could change along it.
        """
        s = self.solution
        if not s.state.line:
            return [*zip(s.contact_position[0], s.reaction[0], strict=True)]
        lines = s.contact_position[0]
        ends = np.stack([lines, lines + s.flat_length[0] / max(lines.size, 1)], axis=1)
        forces = np.stack([s.lam[0, :-1], s.lam[0, 1:]], axis=1) / FOUR_PI_SQUARED
        return [*zip(ends.ravel(), forces.ravel(), strict=True)]


def shapes(
    dataset: "Dataset",
    H: float | None = None,
    given: float | Sequence[float] | None = None,
    states: Sequence[str] | None = None,
    ends: str | None = None,
) -> "Figure":
    """Draw strips at chosen points, each between its walls.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `studies.open` or `studies.run`.
    H : float, optional
        Half gap, in the units of the dataset; the nearest label is taken. Without it the middle one.
    given : float or sequence of float, optional
        Loads, or shortenings where these are prescribed; the nearest labels are taken. Without it, of one
        state six along its branch, else the label at which most states are stable.
    states : sequence of str, optional
        Without it all that are solved at the point, the stable ones first. Of more than twelve strips the
        first twelve are drawn, and the figure says of how many.
    ends : str, optional
        One of the end conditions of the dataset; without it the first.

    Returns
    -------
    matplotlib.figure.Figure
        Stable strips in full, others as outlines; contacts as dots, reactions as arrows, all to one scale.

    Raises
    ------
    StudyError
        If a point or state is not there.
    """
    require(dataset, "status")
    dataset, units = restored(dataset)
    control = control_of(dataset.sizes)
    known = end_conditions(dataset)
    ends = ends or known[0]
    if ends not in known:
        raise StudyError(f"ends = {ends!r} is none of the dataset's; name one of {listed(known, ends)}")
    gap = float(dataset["H"].values[nearest_label(dataset, "H", H, units)])
    panel = dataset.isel(ends=known.index(ends)).sel(H=gap)
    points = _points(panel, control, given, list(states or ()), units)
    strips = [Configuration.at(value, gap, state, ends, control) for value, state in points[:MOST_STRIPS]]
    method = "" if method_of(dataset) == "exact" else ", the exact strip in place of the chain"
    where, note = f"H = {units.text('H', gap)}, {ends}{method}", ""
    if len(points) > MOST_STRIPS:
        note = f"{MOST_STRIPS} of {len(points)} strips are drawn; choose others by their states"
    figure = draw(strips, "\n".join(filter(None, (note, where))), dataset, units)
    figure.note = note
    return figure


def _points(panel, control, given, states, units):
    """Pairs (control, state) to draw."""
    names = [str(name) for name in panel["state"].values]
    for state in states:
        if state not in names:
            raise StudyError(
                f"state = {state!r} is none of the dataset's; name one of {listed(names, state)}"
            )
    labels = panel[control].values
    solved = (panel["status"] == Status.SOLVED).transpose(control, "state").values
    rank = _rank(panel, control, solved)
    here = f"at H = {units.text('H', float(panel['H']))}"
    if given is not None:
        rows = [nearest_label(panel, control, value, units) for value in np.atleast_1d(given)]
    elif len(states) == 1:
        there = np.flatnonzero(solved[:, names.index(states[0])])
        if not there.size:
            raise StudyError(f"state = {states[0]!r} is solved nowhere {here}")
        rows = there[np.unique(np.linspace(0, there.size - 1, ALONG).round().astype(int))].tolist()
    else:
        count = solved.sum(axis=1) + 1000 * (rank == 0).sum(axis=1)
        most = np.flatnonzero(count == count.max())
        rows = [int(most[most.size // 2])]
    points = [
        (float(labels[row]), state)
        for row in rows
        for state in states or [names[i] for i in np.argsort(rank[row], kind="stable")]
        if solved[row, names.index(state)]
    ]
    if not points:
        places = ", ".join(units.text(control, labels[row]) for row in rows)
        raise StudyError(f"no state is solved {here}, {control} = {places}; choose another point")
    return points


def _rank(panel, control, solved):
    """Order (control, state) in which strips are drawn: 0 stable, then by index, as far as the file knows.

    A state without negative directions need not be stable: a clamped line is not, at third order.
    """
    rank = np.where(solved, 1, 999)
    for name in ("index", "stability"):
        if name in panel:
            values = panel[name].transpose(control, "state").values
            rank = rank + values.clip(0) if name == "index" else np.where(values == Stability.STABLE, 0, rank)
    return np.where(solved, rank, 999)


def draw(strips, where="", dataset=None, units=NUMBERS):
    """Draw strips of `Configuration.at`, one below the other in two columns, with one scale of forces."""
    rows = -(-len(strips) // 2)
    stretch = _stretch(strips)
    tall = stretch * max(float(strip.solution.H[0]) for strip in strips)
    figure = new_figure((9.5, 0.9 + rows * (0.45 + 9.5 * tall)))
    axes = figure.subplots(rows, min(2, len(strips)), squeeze=False).ravel()
    for unused in axes[len(strips) :]:
        unused.remove()
    largest = _largest(strips)
    for ax, strip in zip(axes, strips, strict=False):
        _draw_strip(ax, strip, stretch, largest, units)
    force = "force of a wall μ*" + ("" if units.unit("reaction") else "L²/4π²EI")
    scale = f"; longest arrow: {force} = {units.text('reaction', largest)}"
    heights = "" if stretch == 1 else f"; heights × {stretch:g}"
    text = f"{where}{scale}{heights}; filled: stable, hollow: unstable"
    if dataset is not None:
        caption(figure, dataset, text)
    else:
        figure.supxlabel(text, fontsize="x-small", color="0.3")
    return figure


def _largest(strips):
    """The largest force of a wall."""
    return max((force for strip in strips for _, force in strip.presses), default=0.0) or 1.0


def _stretch(strips):
    """Factor of the heights: 1 unless the gap is too narrow to see."""
    widest = max(float(strip.solution.H[0]) for strip in strips)
    return 1 if widest > FLAT / 3 else round(FLAT / widest)


def _draw_strip(ax, strip, stretch, largest, units=NUMBERS):
    """One strip between its walls, with contact points and the reactions of the walls."""
    s = strip.solution
    H, shape = float(s.H[0]) * stretch, s.shape(SAMPLES)
    x, y = shape.x[0], shape.y[0] * stretch
    thick = 0.18 * max(H, 0.05)
    low, high = min(x.min(), 0) - 0.06, max(x.max(), 1) + 0.06
    for side in (1, -1):
        corner = low, side * H - (side < 0) * thick
        ax.add_patch(Rectangle(corner, high - low, thick, fc="0.85", ec="0.6", hatch="////", lw=0))
        ax.plot([low, high], [side * H] * 2, color="0.35", lw=0.8, zorder=2)
    ax.plot(x, y, color="0.25", lw=4.2, solid_capstyle="butt", zorder=2.9)
    ax.plot(x, y, color=colour(s.state.name), lw=3.4, solid_capstyle="butt", zorder=3)
    if not strip.stable:
        ax.plot(x, y, color="white", lw=1.6, zorder=3.1)
    for at, force in strip.presses:
        place = np.interp(at, shape.s, x), np.interp(at, shape.s, y)
        side = np.sign(place[1]) or 1.0
        ax.plot(*place, "o", ms=4.5, color="black", zorder=5)
        if force > 0:
            length = 1.5 * H * force / largest
            ax.annotate(
                "",
                (place[0], place[1] - side * length),
                place,
                arrowprops={
                    "arrowstyle": "-|>",
                    "mutation_scale": min(10, 60 * force / largest),
                    "lw": 1.2,
                    "color": "black",
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
                zorder=4,
            )
    ax.set(xlim=(low, high), ylim=(-H - thick, H + thick), xticks=[], yticks=[], aspect="equal")
    ax.spines[:].set_visible(False)
    P, shorter = units.text("P", float(s.P[0])), units.text("shortening", float(s.shortening[0]))
    title = f"{s.state.name}   P = {P},  ΔL = {shorter}   {strip.verdict}"
    ax.set_title(title, fontsize="small", loc="left")


def film(
    points: Iterable[tuple[float, float, str, str]],
    path: str | Path,
    control: str = "P",
    frames_per_second: int = 12,
) -> None:
    """Write a film (GIF) of a strip along a path of equilibria, beside its load over its shortening.

    Parameters
    ----------
    points : sequence of (float, float, str, str)
        Control, H, state and ends of each frame.
    path : str or Path
        Ends in .gif.
    control : str
        What the first number of a point is, "P" or "shortening"; names of higher roots count under it.
    frames_per_second : int

    Raises
    ------
    StudyError
        If a state does not exist at its point, there is no point, the ending is another, or the film cannot
        be written.

    Examples
    --------
    A strip that is pushed and released slowly; only its two jumps lie between two frames:

    >>> import numpy as np
    >>> import studies
    >>> P = np.concatenate([np.linspace(0.9, 4.5, 40), np.linspace(4.5, 0.9, 40)])
    >>> path = studies.loading_path("clamped-clamped", H=0.05, P=P)              # doctest: +SKIP
    >>> points = [(P, 0.05, state, "clamped-clamped") for P, state in zip(path.P.values, path.state.values)]
    ...                                                                          # doctest: +SKIP
    >>> studies.plot.film(points, "loop.gif")                                    # doctest: +SKIP
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise StudyError(f"{path}: a film is written as GIF; use the ending .gif")
    strips = [Configuration.at(*point, control=control) for point in points]
    if not strips:
        raise StudyError("a film needs at least one point")
    figure = new_figure((7.0, 3.9))
    ax, diagram = figure.subplots(2, 1, height_ratios=(1.2, 1))
    stretch = _stretch(strips)
    largest = _largest(strips)
    shortening, P = (
        np.array([float(getattr(s.solution, q)[0]) for s in strips]) for q in ("shortening", "P")
    )

    def frame(number):
        strip = strips[number]
        ax.clear()
        _draw_strip(ax, strip, stretch, largest)
        diagram.clear()
        diagram.plot(shortening, P, color="0.75", lw=1)
        filled = colour(strip.solution.state.name) if strip.stable else "white"
        diagram.plot(shortening[number], P[number], "o", mfc=filled, mec="black", ms=8)
        diagram.set(xlabel="shortening  ΔL*/L", ylabel="thrust  P*L²/4π²EI")

    animation = FuncAnimation(figure, frame, frames=len(strips))
    with finished_elsewhere(path, ".gif") as finished:
        animation.save(finished, writer=PillowWriter(fps=frames_per_second), dpi=90)
