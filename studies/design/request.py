"""What is asked for: the tables of a study together, and the identities that follow from them.

Not here: what each table may hold (`tables`), how they are read (`study`), how the work is divided (`plan`).
"""

import hashlib
import json

from pydantic import model_validator

from elastica.chain.profile import parse_profile
from elastica.paths.transitions import LARGEST_P
from elastica.state import parse_state, states
from studies.design.axes import Table
from studies.design.block import Task
from studies.design.tables import About, Grid, Outputs, Solve, States

NUMERICS_VERSION = 5
"""Raised whenever the same study may give other values than before, beyond rounding."""


class Request(Table):
    """The tables of a study, which fit together."""

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
    def _a_search_that_the_chain_can_make(self):
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
        if not 0 < self.grid.prescribed[-1] <= LARGEST_P:
            raise ValueError(
                f"outputs.transitions = true needs loads up to {LARGEST_P:g} at the most, but P ends at "
                f"{self.grid.prescribed[-1]:g}; change P {remedy}"
            )
        return self

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


def _has_meaning(name, ends):
    try:
        parse_state(name, ends)
    except ValueError:
        return False
    return True
