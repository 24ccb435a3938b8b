"""Figures that belong to no window: shown by a notebook, or by `show`, and written whole to a file."""

import io
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from studies.errors import StudyError
from studies.whole_files import written_whole

RESOLUTION, ON_SCREEN = 200, 100
"""Dots to the inch, in files and in notebooks."""


class Drawing(Figure):
    """A figure of matplotlib that needs no display until it is shown.

    pyplot does not know it, so that figures of a long program do not pile up, and a notebook shows it where a
    cell ends with it, once, whether or not `%matplotlib inline` was said.
    """

    note = ""
    """What should be told beside the figure."""

    def _repr_png_(self):
        """What notebooks show."""
        picture = io.BytesIO()
        self.savefig(picture, format="png", dpi=ON_SCREEN)
        return picture.getvalue()

    def show(self, warn=True):
        """Show the figure now: in a window that blocks until it is closed, in a notebook below the cell."""
        from matplotlib import pyplot

        # pyplot makes a window for a figure of its own; in it this one is put.
        manager: Any = pyplot.figure(figsize=self.get_size_inches()).canvas.manager
        manager.canvas.figure = self
        self.set_canvas(manager.canvas)
        try:
            pyplot.show()
        finally:
            pyplot.close(manager.num)
            FigureCanvasAgg(self)

    def draw(self, renderer):
        """Draw everything; names and titles are plain text in Unicode, whatever the user's LaTeX setting."""
        with matplotlib.rc_context({"text.usetex": False}):
            for text in self.findobj(Text):
                text.set_usetex(False)
            super().draw(renderer)


def new_figure(size):
    """An empty figure of `size` inches."""
    figure = Drawing(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def format_of(path):
    """PNG, PDF or SVG, by the ending of a path.

    Raises
    ------
    StudyError
        If the ending is another.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".png", ".pdf", ".svg"):
        raise StudyError(f"{path}: the ending decides the format; use .png, .pdf or .svg")
    return ending[1:]


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure as PNG, PDF or SVG, by the ending; letters stay letters.

    What was at `path` is replaced only by the whole figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : str or Path

    Raises
    ------
    StudyError
        If the ending is another, or the file cannot be written.
    """
    with (
        matplotlib.rc_context({"svg.fonttype": "none", "pdf.fonttype": 42}),
        finished_elsewhere(path, f".{format_of(path)}") as finished,
    ):
        figure.savefig(finished, dpi=RESOLUTION)


@contextmanager
def finished_elsewhere(path, ending):
    """Give a path where a picture is made; once it is there, it is moved to `path` whole.

    Raises
    ------
    StudyError
        If there is no room, or one may not write there.
    """
    try:
        with tempfile.TemporaryDirectory() as folder:
            finished = Path(folder) / f"picture{ending}"
            yield finished
            with written_whole(path) as temporary:
                shutil.copyfile(finished, temporary)
    except OSError as problem:
        raise StudyError(
            f"{path}: the figure could not be written ({problem.strerror or problem}); "
            "what was there before is kept"
        ) from None
