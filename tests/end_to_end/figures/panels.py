"""A small dataset with pinned and clamped ends, and what is read from its figures."""

import numpy as np
from click.testing import CliRunner

from studies.command_line import main

CC, PP = "clamped-clamped", "pinned-pinned"
SMALL = {
    "study": {"name": "figures"},
    "grid": {
        "ends": [CC, PP],
        "H": {"start": 0.04, "stop": 0.12, "num": 5},
        "P": {"start": 0.2, "stop": 6.0, "num": 15},
    },
    "states": {"names": ["0", "B1", "U", "Ua", "U-", "UD"]},
}


def curves(ax):
    """H and P of all curves of a panel, by their labels."""
    found = {}
    for line in ax.get_lines():
        found.setdefault(line.get_label(), []).append(line.get_xydata())
    return {label: np.concatenate(parts) for label, parts in found.items()}


def centres(edges, axis):
    edges = np.asarray(edges)
    edges = edges[0] if axis == 0 else edges[:, 0]
    return (edges[1:] + edges[:-1]) / 2


def hatched(figure):
    """Hatches of the first panel, and the labels of the legend."""
    hatches = {hatch for area in figure.axes[0].collections for hatch in getattr(area, "hatches", None) or ()}
    return hatches, [text.get_text() for text in figure.legends[0].get_texts()]


def legend(figure):
    (only,) = figure.legends
    return zip(only.get_texts(), only.legend_handles, strict=True)


def painted(figure, panel=0):
    """Colours of a panel, of shape (control, H, 3)."""
    return np.asarray(figure.axes[panel].collections[0].get_array())


def plotted(*arguments):
    return CliRunner().invoke(main, ["plot", *map(str, arguments)])
