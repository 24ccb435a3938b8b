"""The study: what is asked for, validated before anything runs, and its identity.

Not here: what each table of the file may hold (`tables`), how the work is divided (`plan`), who does it
(`runner`).
"""

import hashlib
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pydantic import ValidationError, model_validator

from elastica.chain.profile import parse_profile
from elastica.paths.transitions import LARGEST_P
from elastica.spelling import did_you_mean
from elastica.state import parse_state, states
from studies.design.block import Task
from studies.design.tables import About, Grid, Outputs, Range, Refine, Solve, States, Table
from studies.design.toml import LARGEST_FILE, read_toml
from studies.errors import StudyError
from studies.kinds import refuse_other
from studies.messages import named, shown

if TYPE_CHECKING:
    from studies.design.plan import Plan

NUMERICS_VERSION = 4
"""Raised whenever the same study may give other values than before, beyond rounding."""

DEEPEST = 4
"""Of the tables in a study, one in another, with the lists in them."""


class Study(Table):
    """A validated study: the grid, the states, the method and the outputs."""

    study: About
    grid: Grid
    states: States
    solve: Solve = Solve()
    outputs: Outputs = Outputs()

    @model_validator(mode="after")
    def _states_fit_the_ends(self):
        for name in self.states.names or ():
            problems = []
            for ends in self.grid.ends:
                try:
                    self.solve.check(name, ends)
                except ValueError as problem:
                    problems.append(str(problem))
            if len(problems) == len(self.grid.ends):
                raise ValueError(f"states.names: {problems[0]}")
        return self

    @model_validator(mode="after")
    def _a_catalogue_that_the_chain_can_solve(self):
        contacts, solve = self.states.max_contacts, self.solve
        if contacts is None or solve.method == "exact":
            return self
        if solve.stiffness and not parse_profile(solve.stiffness, solve.links).uniform:
            raise ValueError(
                "states.max_contacts lists the states of a uniform strip; name those of this one instead"
            )
        try:
            solve.check("U" * max(contacts, 1), self.grid.ends[0])
        except ValueError as problem:
            raise ValueError(f"states.max_contacts: {problem}") from None
        return self

    @model_validator(mode="after")
    def _events_that_can_be_found(self):
        if not self.outputs.transitions:
            return self
        remedy = "or leave transitions out"
        if self.grid.control != "P":
            raise ValueError(
                f"outputs.transitions = true lists events along P, but shortening is prescribed; "
                f"prescribe P {remedy}"
            )
        if self.solve.method != "exact":
            raise ValueError(
                f'outputs.transitions = true needs solve.method = "exact", not "{self.solve.method}"; '
                f"change it {remedy}"
            )
        if not 0 < self.grid.given[-1] <= LARGEST_P:
            raise ValueError(
                f"outputs.transitions = true needs loads up to {LARGEST_P:g} at the most, but P ends at "
                f"{self.grid.given[-1]:g}; change P {remedy}"
            )
        return self

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

    @property
    def name(self) -> str:
        """Name of the study and of its default output."""
        return self.study.name

    @property
    def task(self) -> Task:
        """What is computed at every grid point."""
        return Task(self.state_names, self.states.names is None, self.outputs, self.solve)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Canonical names of the states to solve, each once; with max_contacts, of their first roots."""
        if self.states.names is not None:
            wanted = (
                parse_state(name, ends).name
                for name in self.states.names
                for ends in self.grid.ends
                if _has_meaning(name, ends)
            )
        else:
            contacts = self.states.max_contacts or 0
            wanted = (name for ends in self.grid.ends for name in states(ends, contacts))
        return tuple(dict.fromkeys(wanted))

    @property
    def config_json(self) -> str:
        """The whole study as canonical JSON."""
        return json.dumps(self.model_dump(mode="json", exclude_none=True), sort_keys=True, ensure_ascii=False)

    @property
    def study_id(self) -> str:
        """Identity of everything in the study file."""
        return hashlib.sha256(self.config_json.encode()).hexdigest()[:32]

    @property
    def numerics_id(self) -> str:
        """Identity of the method; results that share it may be merged."""
        numerics = {
            "solve": self.solve.model_dump(mode="json", exclude_none=True),
            "version": NUMERICS_VERSION,
        }
        return hashlib.sha256(json.dumps(numerics, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def results_id(self) -> str:
        """Identity of what is computed: of the study file without the name and the texts in [study]."""
        results = self.model_dump(mode="json", exclude_none=True, exclude={"study"})
        text = json.dumps(results, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    @property
    def identity(self) -> dict[str, str]:
        """Identities of the results and of the method, by their names in files."""
        return {"results_id": self.results_id, "numerics_id": self.numerics_id}

    def plan(self, **policy: Any) -> "Plan":
        """Divide the study into blocks; see `studies.design.plan.Plan`."""
        from studies.design.plan import Plan

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


def _has_meaning(name, ends):
    try:
        parse_state(name, ends)
    except ValueError:
        return False
    return True


ALLOWED_KEYS = {
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
