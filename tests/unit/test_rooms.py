"""The two maps of CONTRIBUTING.md are what the code keeps to: nothing imports upward, nothing in a circle."""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("elastica", "studies")


def floors(package):
    """Floor of each room, 0 the ground, as the map of a package draws it: a floor a line, the top first."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    drawn = re.search(rf"^{package}: .*?\n\n?```\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    lines = [line for line in drawn[1].splitlines() if line.strip()]
    rooms = [re.split(r" {3,}", line.strip())[0].split() for line in lines]
    return {room.rstrip("/"): floor for floor, own in enumerate(reversed(rooms)) for room in own}


def modules(package):
    """Every module of a package by its dotted name, with its tree."""
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def imported(name, tree, known):
    """Modules that a module imports, at its head or late, for types too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            found = [m if m in known else node.module for m in inner]
        else:
            continue
        yield from (m for m in found if m in known and m != name)


def room(module):
    """Room of a module: its first name below the package."""
    return module.split(".")[1]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_is_on_the_map(package):
    rooms = {room(name) for name in modules(package) if "." in name}
    assert rooms == set(floors(package))


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_imports_upward(package):
    found, floor = modules(package), floors(package)
    pairs = [
        (name, other)
        for name, tree in found.items()
        if "." in name
        for other in imported(name, tree, found)
        if "." in other
    ]
    assert len(pairs) > 100
    upward = [f"{name} -> {other}" for name, other in pairs if floor[room(name)] < floor[room(other)]]
    assert not upward, upward


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_imports_in_a_circle(package):
    found = modules(package)
    # A package names what its modules offer: its own file stands for none of them.
    graph = {
        name: {m for m in imported(name, tree, found)} for name, tree in found.items() if name != package
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_mechanics_know_nothing_of_studies():
    known = modules("studies") | {"studies": None}
    assert not [n for n, tree in modules("elastica").items() if list(imported(n, tree, known))]
