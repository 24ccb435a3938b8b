"""PyElastica has the import name of this package: whoever has both is told."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMAND = "from studies.command_line import main; main()"


@pytest.fixture
def theirs(tmp_path):
    """A folder with what PyElastica puts there."""
    package = tmp_path / "site" / "elastica"
    (package / "rod").mkdir(parents=True)
    (package / "rod" / "__init__.py").touch()
    (package / "__init__.py").write_text("from elastica.rod import *\n")
    return package.parent


def run(code, *path, arguments=()):
    """What Python does with modules from these folders, in this order."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path)), "PYTHONSAFEPATH": "1"}
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], env=environment, capture_output=True, text=True, timeout=120
    )


def test_alone_nothing_is_said():
    done = run("import elastica, studies; print(elastica.solve('U', P=2.5, H=0.1).stable)", ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


def test_beside_each_other(theirs):
    done = run("import elastica; print(elastica.solve('U', P=2.5, H=0.1).stable)", ROOT, theirs)
    assert done.stdout == "True\n" and done.stderr.count("UserWarning") == 1
    assert (
        f"PyElastica lies in {theirs / 'elastica'}" in done.stderr and "environment of its own" in done.stderr
    )


def test_in_one_folder(theirs):
    for file in (ROOT / "elastica").rglob("*.py"):
        target = theirs / file.relative_to(ROOT)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(file, target)
    done = run("import elastica; print(elastica.solve('U', P=2.5, H=0.1).stable)", theirs)
    assert done.stdout == "True\n" and f"PyElastica lies in {theirs / 'elastica'}" in done.stderr


@pytest.mark.parametrize("mixed", [False, True], ids=["first on the path", "written over this one"])
def test_where_it_hides_this_package_the_command_and_studies_say_so(theirs, mixed):
    if mixed:
        shutil.copytree(ROOT / "elastica", theirs / "both" / "elastica")
        shutil.copytree(theirs / "elastica", theirs / "both" / "elastica", dirs_exist_ok=True)
        theirs = theirs / "both"
    done = run(COMMAND, theirs, ROOT, arguments=["states"])
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"{theirs / 'elastica'} is PyElastica, whose import name is elastica too; install" in done.stderr
    done = run("import studies; studies.run", theirs, ROOT)
    assert done.stderr.splitlines()[-1].startswith(
        f"studies.errors.StudyError: {theirs / 'elastica'} is PyEl"
    )
