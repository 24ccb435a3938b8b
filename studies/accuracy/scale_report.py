"""Table and figure of the costs of whole studies, as `scale` measures them."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

TITLES = {"points": "grid points", "outputs": "outputs of 10,000 points", "layout": "layout"}
PARTS = {
    "solving": ("solving", "#0b4f8a"),
    "shards": ("start, dispatch, shards", "#56b4e9"),
    "reduction": ("joining, hash, verification", "#e69f00"),
}


def markdown(data):
    """The measured costs as Markdown."""
    lines = [
        "# Whole studies",
        "",
        f"{data.attrs['machine']}; {data.attrs['workers']} workers. Equilibrium, index and verdict of "
        "U, Ua, U- and UD for a clamped strip over gap and load.",
        "",
    ]
    for dim, title in TITLES.items():
        if dim not in data.dims:
            continue
        names = [name for name in data.data_vars if data[name].dims == (dim,)]
        lines += [
            f"| {title} | " + " | ".join(_heading(data[name]) for name in names) + " |",
            "|---|" + "---:|" * len(names),
        ]
        for label in data[dim].values:
            numbers = (_number(data[name].sel({dim: label})) for name in names)
            lines.append(f"| {label:,} | " if dim == "points" else f"| {label} | ")
            lines[-1] += " | ".join(numbers) + " |"
        lines.append("")
    return "\n".join(lines)


def _heading(variable):
    """Name and unit of a column."""
    name = variable.name.removeprefix(f"{variable.dims[0]}_").replace("_", " ")
    return f"{name}, {'MB' if variable.attrs['units'] == 'byte' else 's'}"


def _number(value):
    """Seconds as they are, bytes in MB."""
    scaled = value.item() / (1e6 if value.attrs["units"] == "byte" else 1.0)
    return f"{scaled:,.2f}" if scaled < 100 else f"{scaled:,.0f}"


def figure(data):
    """Time per point and peak memory against the number of points.

    Returns
    -------
    matplotlib.figure.Figure
    """
    drawn = Figure(figsize=(9.5, 4.2), layout="constrained")
    FigureCanvasAgg(drawn)
    left, right = drawn.subplots(1, 2)
    points = data["points"].values
    for name, (label, colour) in PARTS.items():
        left.plot(points, data[name].values / points * 1e6, "o-", color=colour, markersize=4, label=label)
    whole = sum(data[name].values for name in PARTS)
    left.plot(points, whole / points * 1e6, "-", color="black", label="all")
    left.set(ylabel="µs a grid point (four states)", yscale="log", title="Time")
    for name, label, colour in (
        ("client_memory", "command, with the scheduler", "#0b4f8a"),
        ("worker_memory", "largest worker", "#e69f00"),
    ):
        right.plot(points, data[name].values / 2**20, "o-", color=colour, markersize=4, label=label)
    right.axhline(1024, color="0.5", linestyle=":")
    right.set(ylabel="peak memory, MiB", title="Memory", ylim=(0, 1100))
    for axes in (left, right):
        axes.set(xscale="log", xlabel="grid points")
        axes.legend(frameon=False)
    return drawn
