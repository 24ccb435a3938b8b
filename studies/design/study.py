"""The study as a user gives it: read from a file or a dict, refused in one sentence, planned.

Not here: what is asked for in it (`request`), how the work is divided (`plan`), who does it (`runner`).
"""

import re
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ValidationError

from elastica.spelling import did_you_mean
from studies.design.axes import Range, Refine
from studies.design.plan import Plan
from studies.design.request import Request
from studies.design.tables import About, Grid, Outputs, Solve, States
from studies.design.toml import LARGEST_FILE, read_toml
from studies.errors import StudyError
from studies.kinds import refuse_other
from studies.messages import named, shown

DEEPEST = 4
"""Of the tables in a study, one in another, with the lists in them."""


class Study(Request):
    """A validated study: the grid, the states, the method and the outputs."""

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read and validate a study file.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Study

        Raises
        ------
        StudyError
            With file, key, value and remedy in one sentence.
        """
        path = Path(path)
        try:
            with path.open("rb") as stream:
                content = stream.read(LARGEST_FILE + 1)
        except OSError as problem:
            raise StudyError(f"{path}: {problem.strerror}; give the path of a study file") from None
        refuse_other("study", path, content)
        return cls.from_dict(read_toml(content, path), path)

    @classmethod
    def from_dict(cls, content: dict[str, Any], path: str | Path = "study") -> Self:
        """Validate the content of a study file; `path` names it in messages.

        Numbers and arrays may be those of NumPy, texts may be paths.
        """
        try:
            return cls.model_validate(_plain(content))
        except ValidationError as problem:
            raise StudyError(f"{path}: {_explain(problem)}") from None

    def plan(self, **policy: Any) -> Plan:
        """Divide the study into blocks; see `Plan.of`."""
        return Plan.of(self, **policy)


def _plain(value, depth=DEEPEST):
    """Content as TOML would have it, from types of NumPy and the like."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # Arrays and scalars of NumPy, series of pandas.
        return value.tolist()
    if depth and isinstance(value, dict):
        return {key: _plain(item, depth - 1) for key, item in value.items()}
    if depth and isinstance(value, (list, tuple, range)):
        return [_plain(item, depth - 1) for item in value]
    return value


ALLOWED_KEYS: dict[tuple[str, ...], type[BaseModel]] = {
    (): Study,
    ("study",): About,
    ("grid",): Grid,
    ("grid", "refine"): Refine,
    ("states",): States,
    ("solve",): Solve,
    ("outputs",): Outputs,
}


REMEDIES = {
    "tuple_type": "write a list, in [ ]",
    "model_type": "write a table",
    "string_type": "write a text, in quotes",
    "string_pattern_mismatch": "use letters, digits, '.', '_' and '-'",
    "int_type": "write a whole number",
    "too_short": "name at least one",
}


def _explain(problem):
    """One error of a validation as one sentence: key, value, remedy; that of a misspelled key first."""
    errors = problem.errors()
    error = next((each for each in errors if each["type"] == "extra_forbidden"), errors[0])
    where = tuple(str(part) for part in error["loc"])
    key = ".".join(map(named, where))
    kind, value = error["type"], error["input"]
    if kind == "extra_forbidden":
        allowed = ALLOWED_KEYS.get(where[:-1], Range).model_fields
        homes = (".".join(home) for home, table in ALLOWED_KEYS.items() if where[-1] in table.model_fields)
        home = next(homes, None)
        question = did_you_mean(where[-1], allowed) if home is None else f", which belongs to [{home}]"
        if home == "":
            question = f", which is a table of its own, [{where[-1]}]"
        return f"unknown key {key}{question}; allowed here are {', '.join(allowed)}"
    if kind == "missing":
        return f"{f'[{key}]' if len(where) == 1 else key} is missing; add it"
    if kind == "value_error":
        message = str(error["ctx"]["error"])
        if isinstance(error["ctx"]["error"], ValidationError):
            message = _explain(error["ctx"]["error"])
        return f"{key}: {message}" if key else message
    remedy = REMEDIES.get(kind, error["msg"][:1].lower() + error["msg"][1:])
    question = ""
    if kind == "literal_error":
        expected = error["ctx"]["expected"]
        question, remedy = did_you_mean(value, re.findall("'(.*?)'", expected)), f"use {expected}"
    return f"{key} = {shown(value)} is not allowed{question}; {remedy}"
