"""Answers that have rows: one by one, as text, or as a table of pandas. Codes appear by their names."""

from collections import Counter, namedtuple
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from elastica.codes import CODES

if TYPE_CHECKING:
    from pandas import DataFrame

SHOWN = ("P", "H", "status", "stability", "index", "curvature", "energy", "shortening")
MOST_SHOWN = 10
"""Points of a solution that are printed."""


class Rows:
    """What answers of several rows have in common; their columns are arrays of shape (rows, ...)."""

    row_name: ClassVar[str]
    """Of the type of one row."""
    columns: ClassVar[tuple[str, ...]]
    """Names of the columns that a row has."""

    def __len__(self) -> int:
        """Number of rows."""
        return len(getattr(self, self.columns[0]))

    def __iter__(self) -> Iterator[Any]:
        """Each row as a named tuple, with codes as members of `Status`, `Stability` or `Event`."""
        row = namedtuple(self.row_name, self.columns)  # type: ignore[misc]  # each has its own name
        arrays = [getattr(self, name) for name in self.columns]
        columns = [array.tolist() if array.ndim == 1 else array for array in arrays]
        codes = [CODES.get(name) for name in self.columns]
        for values in zip(*columns, strict=True):
            yield row(
                *(value if code is None else code(value) for value, code in zip(values, codes, strict=True))
            )

    def __repr__(self) -> str:
        """The rows as text."""
        return str(self)

    def to_dataframe(self) -> "DataFrame":
        """The rows as a table of pandas, with the names of codes.

        What has several values a row has a column for each, such as `reaction_1` and `reaction_2`.
        """
        from pandas import DataFrame

        table: dict[str, np.ndarray] = {**getattr(self, "labels", {})}
        for name in self.columns:
            values = getattr(self, name)
            if name in CODES:
                table[name] = CODES[name].names(values)
            elif values.ndim > 1:
                table |= {f"{name}_{i + 1}": values[:, i] for i in range(values.shape[1])}
            else:
                table[name] = values
        return DataFrame(table)


def described(solution: Any) -> str:
    """What a solution is of, and a line for each of its first points."""
    columns = {}
    for name in SHOWN:
        values = np.ravel(getattr(solution, name))[:MOST_SHOWN]
        named = CODES[name].names(values) if name in CODES else [f"{value:.6g}" for value in values]
        columns[name] = [name, *named]
    widths = [max(map(len, column)) for column in columns.values()]
    rows = zip(*columns.values(), strict=True)
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    size, shape = solution.status.size, solution.status.shape
    points = f"points {shape}" if len(shape) > 1 else "points" if size != 1 else "point"
    heading = (
        f"{type(solution).__name__} of {solution.state.name}, {solution.ends}, at {size} {points}, "
        f"{solution.control} prescribed"
    )
    more = [f"… {size - MOST_SHOWN} more"] if size > MOST_SHOWN else []
    return "\n".join([heading, *lines, *more, *failures(solution.reasons)])


def failures(reasons: dict[int, str]) -> list[str]:
    """A line for each reason why points failed, of which there are few."""
    counts = Counter(reasons.values())
    return [
        f"failed at {count} point{'s' * (count > 1)}: {why}" for why, count in counts.most_common(MOST_SHOWN)
    ]
