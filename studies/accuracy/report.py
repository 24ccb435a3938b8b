"""Tables and figures of a measured dataset: ratios at equal error first, then everything.

Not here: measuring (`measure`, `floor`), whole studies (`scale_report`).
"""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from studies.accuracy.cases import TASKS, cases

CURVES = {
    "exact": ("exact, in blocks", "#0b4f8a", "*", "-"),
    "exact-call": ("exact, one call", "#0b4f8a", "P", "-"),
    "spectral": ("exact + Legendre elements, 4 … 48 terms", "#56b4e9", "v", "-"),
    "chain-consistent": ("chain, consistent, 25 … 12,800 links", "#009e73", "o", "-"),
    "chain-consistent-extrapolated": ("the same, extrapolated", "#009e73", "o", ":"),
    "chain-published": ("chain, published", "#e69f00", "s", "-"),
    "chain-published-extrapolated": ("the same, extrapolated", "#e69f00", "s", ":"),
    "dense": ("published procedure, dense", "#d55e00", "D", "-"),
    "solve_bvp": ("SciPy solve_bvp", "#332288", "^", "--"),
    "ipopt": ("IPOPT through casadi", "#cc79a7", "X", "--"),
}
"""Label, colour, marker and line of each curve."""
QUANTITIES = ("#0b4f8a", "*"), ("#d55e00", "D"), ("#e69f00", "s"), ("#009e73", "o")
"""Colour and marker of each quantity against the number of contacts."""
PEERS = {
    "solve_bvp, tolerance 1e-09": "equilibrium",
    "IPOPT, 400 links": "equilibrium",
    "dense procedure, 200 links": "index",
    "dense procedure, 1,600 links": "index",
}
"""Peers of the headline, and the task at which they are compared."""
EXACT = "exact, blocks of 10,000"


def headline(data):
    """Rows of the first table: how much longer a peer takes, and how much larger its error is.

    Returns
    -------
    list of (str, str, str, float, float)
        Case, task, peer, ratio of times, ratio of errors.
    """
    median = data["seconds"].median("round")
    rows = []
    names = set(data["solver"].values.tolist())
    for case in cases():
        for peer, task in PEERS.items():
            if peer in names and EXACT in names:
                at = {"scene": case, "task": task}
                times, errors = (
                    field.sel(at).sel(solver=peer).item() / field.sel(at).sel(solver=EXACT).item()
                    for field in (median, data["error"])
                )
                rows.append((case, task, peer, times, errors))
    chains = "dense procedure, 1,600 links", "published chain, 1,600 links"
    if set(chains) <= names:
        for case in cases():
            dense, linear = (median.sel(scene=case, task="index", solver=name).item() for name in chains)
            rows.append(
                (case, "index", "dense procedure against the O(N) chain, 1,600 links", dense / linear, 1.0)
            )
    return rows


def markdown(data):
    """The whole report as Markdown."""
    lines = [
        "# Speed against error",
        "",
        f"{data.attrs['machine']}; one core; medians of {data.sizes['round']} interleaved rounds.",
        "Errors are relative, against references of 50-digit arithmetic. " + _cases(),
        "",
    ]
    rows = headline(data)
    if rows:
        lines += [
            f"## Against {EXACT}",
            "",
            "| state | task | method | its time, exact = 1 | its error, exact = 1 |",
            "|---|---|---|---:|---:|",
            *(
                f"| {case} | {TASKS[task]} | {peer} | {times:,.0f} | {errors:.1e} |"
                for case, task, peer, times, errors in rows
            ),
            "",
            "The last kind of row compares the two ways to do the chain's algebra, with equal results."
            if rows[-1][-1] == 1.0
            else "",
        ]
    if "floor_seconds" in data:
        lines += [*_floor(data), *_quantities(data), *_contacts(data)]
    median = data["seconds"].median("round")
    for case in cases():
        for task, title in TASKS.items():
            lines += ["", f"## {case}: {title}", ""]
            lines += ["| method | µs a state | states/s | error |", "|---|---:|---:|---:|"]
            for name in data["solver"].values:
                at = {"scene": case, "task": task, "solver": name}
                seconds, error = median.sel(at).item(), data["error"].sel(at).item()
                if np.isfinite(seconds):
                    wrong = "wrong index" if np.isinf(error) else f"{error:.1e}"
                    lines.append(f"| {name} | {seconds * 1e6:,.2f} | {1 / seconds:,.0f} | {wrong} |")
    return "\n".join([*lines, ""])


def _cases():
    """What the cases are."""
    return "; ".join(f"{s.name}: `{s.state}` at P = {s.P}, H = {s.H}" for s in cases().values()) + "."


def _floor(data):
    lines = [
        "",
        "## The floor",
        "",
        "Equilibrium + index over the elliptic integrals that a perfect solver needs, in processor time:",
        "four evaluations for each distinct segment (three Newton steps from the closed form of small",
        "deflections, and the result). The functions: SciPy's ellipk, ellipe, ellipkinc, ellipeinc, or",
        "one pass for all four as the solver has it.",
        "",
        "| state | block | functions | floor, µs a state | measured, µs a state | measured / floor |",
        "|---|---:|---|---:|---:|---:|",
    ]
    for at in data["floor_seconds"].stack(row=("floor_state", "block", "functions")).transpose("row"):
        state, block, functions = at["row"].item()
        least, taken = at.item(), data["solve_seconds"].sel(floor_state=state, block=block).item()
        lines.append(
            f"| {state} | {block:,} | {functions} | {least * 1e6:.2f} | {taken * 1e6:.2f} "
            f"| {taken / least:.2f} |"
        )
    return lines


def _quantities(data):
    """What each quantity of a state costs, beside the floor in the largest block and beside dense algebra."""
    lines = [
        "",
        "## Eigenvalues, frequencies, shapes",
        "",
        "Four eigenvalues, four frequencies, 101 points of the shape, in processor time, and over the floor",
        "of one pass. Dense: the same from one matrix for all segments; differences are relative to",
        "the value or to π², whichever is larger.",
        "",
        "| state | quantity | µs a state | over the floor | dense, µs | dense / measured | difference |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    least = data["floor_seconds"].sel(functions="one pass").isel(block=-1)
    for state in data["floor_state"].values:
        for quantity in data["quantity"].values:
            at = {"floor_state": state, "quantity": quantity}
            taken, dense, difference = (
                data[name].sel(at).item() for name in ("quantity_seconds", "dense_seconds", "difference")
            )
            peer = (
                f"{dense * 1e6:,.0f} | {dense / taken:,.0f} | {difference:.0e}"
                if np.isfinite(dense)
                else "— | — | —"
            )
            ratio = taken / least.sel(floor_state=state).item()
            lines.append(f"| {state} | {quantity} | {taken * 1e6:,.1f} | {ratio:,.0f} | {peer} |")
    return lines


def _contacts(data):
    """What contacts cost."""
    names = ["equilibrium + index", *data["quantity"].values]
    lines = [
        "",
        "## Cost against the number of contacts",
        "",
        "µs of processor time a state, words U, UD, UDU, … between clamps.",
        "",
        f"| contacts | {' | '.join(names)} |",
        "|---:|" + "---:|" * len(names),
    ]
    for number, *seconds in zip(data["contacts"].values, *_by_contacts(data).values(), strict=True):
        lines.append(f"| {number} | " + " | ".join(f"{value * 1e6:,.1f}" for value in seconds) + " |")
    return lines


def _by_contacts(data):
    """Seconds of each quantity against the number of contacts."""
    return {"equilibrium + index": data["contact_solve_seconds"].values} | {
        quantity: data["contact_seconds"].sel(quantity=quantity).values
        for quantity in data["quantity"].values
    }


def figure_of_contacts(data):
    """Time per state against the number of contacts.

    Returns
    -------
    matplotlib.figure.Figure
    """
    drawn = Figure(figsize=(6.2, 4.6), layout="constrained")
    FigureCanvasAgg(drawn)
    axes = drawn.subplots()
    for (name, seconds), (colour, marker) in zip(_by_contacts(data).items(), QUANTITIES, strict=True):
        axes.plot(data["contacts"].values, seconds * 1e6, "-", color=colour, marker=marker, label=name)
    number = data["contacts"].values
    first = data["contact_solve_seconds"].values[0] * 1e6
    axes.plot(number, first * number, ":", color="0.5", label="proportional")
    axes.set(xscale="log", yscale="log", xlabel="contacts", ylabel="µs a state", title="Cost of contacts")
    axes.set_xticks(number, [str(n) for n in number])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="#e5e5e5", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, fontsize=9)
    return drawn


def figure(data, case):
    """Error against time per state of one case, a panel for each task.

    Returns
    -------
    matplotlib.figure.Figure
    """
    drawn = Figure(figsize=(11, 8.6), layout="constrained")
    FigureCanvasAgg(drawn)
    panels = drawn.subplots(2, 2, sharex=True, sharey=True)
    median = data["seconds"].median("round").sel(scene=case)
    error = data["error"].sel(scene=case)
    handles: dict[str, Line2D] = {}
    for (task, title), axes in zip(TASKS.items(), panels.flat, strict=True):
        for curve, (label, colour, marker, style) in CURVES.items():
            of_curve = (data["curve"] == curve).values
            x, y = (field.sel(task=task).values[of_curve] for field in (median, error))
            good = np.isfinite(x) & np.isfinite(y)
            if good.any():
                order = np.argsort(data["setting"].values[of_curve][good])
                (line,) = axes.plot(
                    x[good][order],
                    y[good][order],
                    style,
                    color=colour,
                    marker=marker,
                    markersize=13 if marker == "*" else 6,
                    markerfacecolor="white" if style == ":" else colour,
                    linewidth=1.2,
                    label=label,
                    zorder=4 if curve.startswith("exact") else 2,
                )
                handles.setdefault(label + style + colour, line)
        axes.set(xscale="log", yscale="log", title=title)
        axes.yaxis.set_major_locator(LogLocator(numticks=20))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(color="#e5e5e5", linewidth=0.6)
        axes.set_axisbelow(True)
    s = cases()[case]
    drawn.suptitle(f"Error against time: {s.state} of a clamped strip, P = {s.P}, H = {s.H} (one core)")
    for axes in panels[1]:
        axes.set_xlabel("seconds a state")
    for axes in panels[:, 0]:
        axes.set_ylabel("relative error")
    drawn.legend(
        handles=list(handles.values()), loc="outside lower center", ncols=3, frameon=False, fontsize=9
    )
    return drawn
