import inspect
import pydoc
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import elastica
import studies
import studies.accessor

PUBLIC = {
    f"{package.__name__}.{name}": getattr(package, name)
    for package in (elastica, studies, studies.plot)
    for name in package.__all__
} | {"accessor": studies.accessor.Elastica, "plot": studies.accessor.Plot}
ROOT = Path(__file__).parents[2]


def functions(thing):
    """A function, or those of a class that users may call."""
    if inspect.isfunction(thing):
        return [thing]
    found = (getattr(member, "__func__", getattr(member, "fget", member)) for member in vars(thing).values())
    # Dataclasses and tuples make functions that are not from a file of ours.
    own = (f for f in found if inspect.isfunction(f) and f.__code__.co_filename.startswith(str(ROOT)))
    # Python 3.14 makes one that evaluates the annotations.
    public = (f for f in own if f.__name__.startswith("__") or not f.__name__.startswith("_"))
    return [f for f in public if f.__name__ != "__annotate__"]


@pytest.mark.parametrize("name", PUBLIC)
def test_what_users_call_has_type_hints(name):
    for function in functions(PUBLIC[name]):
        signature = inspect.signature(function)
        parameters = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
        bare = [p.name for p in parameters if p.annotation is p.empty]
        assert not bare, f"{function.__qualname__}: {bare}"
        assert signature.return_annotation is not signature.empty, function.__qualname__


def test_both_packages_say_that_they_are_typed():
    for package in (elastica, studies):
        assert Path(package.__file__).with_name("py.typed").is_file()


def test_the_citation_is_that_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    project = (ROOT / "pyproject.toml").read_text()
    changes = (ROOT / "CHANGELOG.md").read_text()
    assert f'version = "{citation["version"]}"' in project
    assert f"## {citation['version']}" in changes
    assert citation["license"] == "BSD-3-Clause"


def test_completion_shows_what_is_imported_on_first_use():
    code = "import sys, studies; print(*dir(studies)); print({'dask', 'xarray'} & {*sys.modules} or 'light')"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names, weight = run.stdout.splitlines()
    assert (names.split(), weight) == (studies.__all__, "light")


def test_help_explains_every_public_function_and_class():
    text = pydoc.plain(pydoc.render_doc(studies))
    for name in studies.__all__:
        assert re.search(rf"^{name} ", studies.__doc__, re.MULTILINE)
        kind = "class" if inspect.isclass(getattr(studies, name)) else ""
        if callable(getattr(studies, name)):
            assert re.search(rf"^ +{kind} ?{name}\(", text, re.MULTILINE), name
