"""Hard cases with known right answers: both sides of every transition, limits of loads, gaps, springs, words.

Every case is a state at a point with what is true there. Transition loads come from closed forms (theory
of the pendulum) at 50 digits; a point lies beside one at a relative distance of 1e-2 … 1e-12, as a double.
Equilibria are Newton's method at 50 digits on the equations of `references.make_states`, from starts that
the closed forms give; verdicts follow from the side of the transition. Nothing is imported from the package.

Run ``python -m hard_cases.make_hard_cases`` in the folder ``tests`` to write ``hard_cases.json``.
"""

import json
from pathlib import Path

from hard_cases.folds import folds_at_shortening, folds_under_load
from hard_cases.free_shapes import buckling, folds_of_free_shapes, loops
from hard_cases.line_states import (
    beyond_the_pitchfork,
    flat_buckles,
    folds_of_lines,
    pitchfork,
    point_to_line,
)
from hard_cases.long_words import words
from hard_cases.meetings import free_shapes_touch, meetings
from hard_cases.one_contact import narrow, overhanging, touching
from hard_cases.spring_ends import spring_contacts
from hard_cases.straight_strip import springs, straight

OUTPUT = Path(__file__).parent / "hard_cases.json"

FAMILIES = (
    straight,
    springs,
    buckling,
    loops,
    narrow,
    touching,
    point_to_line,
    pitchfork,
    flat_buckles,
    folds_of_lines,
    folds_of_free_shapes,
    words,
    overhanging,
    free_shapes_touch,
    meetings,
    folds_under_load,
    folds_at_shortening,
    spring_contacts,
    beyond_the_pitchfork,
)


def main():
    """Write the file."""
    cases = []
    for family in FAMILIES:
        before = len(cases)
        cases += family()
        print(f"{family.__name__}: {len(cases) - before}", flush=True)
    text = ",\n".join(json.dumps(record, separators=(",", ":")) for record in cases)
    OUTPUT.write_text(f"[\n{text}\n]\n", encoding="utf-8")
    print(len(cases), "cases,", OUTPUT.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
