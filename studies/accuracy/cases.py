"""The states that all methods solve, the tasks, and how an answer's error is measured."""

import json
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

TASKS = {
    "equilibrium": "equilibrium",
    "index": "equilibrium + index",
    "eigenvalue": "equilibrium + lowest eigenvalue",
    "shape": "equilibrium + index + shape",
}
"""What is asked of a method, with its title. Errors: of equilibria and indices the larger of the relative
errors of energy and shortening, of shapes max |δy|/H over 21 places."""
SAMPLES = 201
"""Points of a shape; every tenth has a reference."""


class Case(NamedTuple):
    """A state of a clamped strip with its references; `y` are heights at equidistant arc lengths."""

    name: str
    state: str
    P: float
    H: float
    energy: float
    shortening: float
    eigenvalue: float
    index: int  # type: ignore[assignment]  # hides tuple.index
    y: np.ndarray


class Answer(NamedTuple):
    """Values of one method for one case, and the seconds a state that each task took; None: not asked."""

    seconds: dict
    energy: float
    shortening: float
    index: int | None = None  # type: ignore[assignment]  # hides tuple.index
    eigenvalue: float | None = None
    y: np.ndarray | None = None

    def errors(self, case):
        """Error of each task that was done; infinite where the index is wrong."""
        equilibrium = max(abs(self.energy / case.energy - 1), abs(self.shortening / case.shortening - 1))
        right = self.index is None or self.index == case.index
        found = {"equilibrium": equilibrium, "index": equilibrium if right else np.inf}
        if self.eigenvalue is not None:
            found["eigenvalue"] = abs(self.eigenvalue / case.eigenvalue - 1)
        if self.y is not None:
            y = self.y[:: (self.y.size - 1) // (case.y.size - 1)]
            found["shape"] = np.abs(np.abs(y) - case.y).max() / case.H
        # Below the rounding of the reference itself all are alike.
        return {task: max(float(found[task]), np.finfo(float).eps / 2) for task in self.seconds}


@cache
def cases():
    """All cases by name."""
    text = files("studies.accuracy").joinpath("references.json").read_text(encoding="utf-8")
    return {name: _case(name, record) for name, record in json.loads(text).items()}


def _case(name, record):
    eigenvalues = np.array(record["eigenvalues"], float)
    return Case(
        name,
        record["state"],
        record["P"],
        record["H"],
        float(record["energy"]),
        float(record["shortening"]),
        eigenvalues[0],
        int((eigenvalues < 0).sum()),
        np.array(record["y"], float),
    )
