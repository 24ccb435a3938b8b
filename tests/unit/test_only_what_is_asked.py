"""Nothing is computed that no output needs: calls of the expensive parts, counted."""

from collections import Counter

import pytest

import elastica
from elastica import shapes
from elastica.stability import assembly, spectrum, vibration
from studies import Study
from studies.design.plan import Plan
from studies.running.evaluate import evaluate

PARTS = (
    (spectrum, "eigenvalues"),
    (vibration, "frequencies"),
    (shapes, "sample"),
    (assembly, "reduced"),
)
CONTENT = {
    "study": {"name": "lean", "title": "Only what is asked"},
    "grid": {"ends": ["clamped-clamped"], "H": [0.05, 0.1], "P": [1.5, 2.5, 5.0]},
    "states": {"names": ["0", "U", "Ua", "U-"]},
}


@pytest.fixture
def calls(monkeypatch):
    """How often each part was called."""
    counted = Counter()
    for module, name in PARTS:
        monkeypatch.setattr(module, name, counting(getattr(module, name), counted))
    return counted


def counting(part, counted):
    def call(*arguments, **keywords):
        counted[part.__name__] += 1
        return part(*arguments, **keywords)

    return call


def run(outputs):
    plan = Plan.of(Study.from_dict(CONTENT | {"outputs": outputs}))
    for block in plan.blocks:
        evaluate(block, plan.task)


def test_maps_alone_need_no_eigenvalues_and_no_shapes(calls):
    run({"eigenvalues": 0, "frequencies": 0, "shapes": 0})
    assert not calls


@pytest.mark.parametrize(
    ("output", "part"), [("eigenvalues", "eigenvalues"), ("frequencies", "frequencies"), ("shapes", "sample")]
)
def test_each_output_computes_its_own_part_alone(output, part, calls):
    run({"eigenvalues": 0, "frequencies": 0, "shapes": 0} | {output: 5})
    assert calls[part] == len(CONTENT["states"]["names"])
    others = {"eigenvalues", "frequencies", "sample"} - {part}
    assert not any(calls[name] for name in others)
    assert bool(calls["reduced"]) == (output != "shapes")


def test_a_solution_computes_on_demand(calls):
    s = elastica.solve("U", P=2.5, H=0.1)
    assert not calls
    s.eigenvalues(2)
    # Both segments of this state are the same.
    assert calls["reduced"] == 1
