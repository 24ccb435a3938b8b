"""What a dataset says about its origin: the study, its identities, versions of the code and libraries."""

import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from studies.design.request import NUMERICS_VERSION
from studies.messages import readable_path
from studies.schema import FORMAT_VERSION

DISTRIBUTION = "constrained-elastica"
LIBRARIES = ("numpy", "scipy", "netCDF4", "xarray", "dask")
DECISIVE = (DISTRIBUTION, "numpy", "scipy")
"""What values come from. Python, the other libraries and the machine may differ within one dataset."""


@cache
def decisive_versions():
    """Versions of what values come from, by name."""
    return {"numerics": str(NUMERICS_VERSION)} | {name: version(name) for name in DECISIVE}


def now():
    """The time in UTC, as attributes and the index of a catalog have it."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def describe(study):
    """Global attributes of the dataset of a study, by CF-1.11 and ACDD-1.3.

    Parameters
    ----------
    study : Study

    Returns
    -------
    dict of str to str or int
        What is unknown is absent.
    """
    made = now()
    return {
        **texts(study),
        "source": f"{DISTRIBUTION} {version(DISTRIBUTION)}, closed-form solution",
        "date_created": made,
        "history": f"{made} {DISTRIBUTION} {version(DISTRIBUTION)}: computed",
        "numerics_id": study.numerics_id,
        "format_version": FORMAT_VERSION,
        "control": study.grid.control,
        "states_searched": " ".join(study.task.names),
        "python_version": platform.python_version(),
        "library_versions": ", ".join(f"{name} {version(name)}" for name in LIBRARIES),
        "numerics_version": NUMERICS_VERSION,
        "host": platform.node(),
        "command": readable_path(shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])),
        "platform": f"{sys.platform} {platform.machine()}",
        **_git(),
    }


def texts(study):
    """Those of the attributes that follow the name and the texts of a study."""
    about = {key: value for key, value in study.study.model_dump().items() if value}
    about.pop("name")
    about.setdefault("title", study.name)
    about.setdefault("summary", "Equilibria and stability of an inextensible strip between two rigid walls")
    return {**about, "id": study.name, "config_json": study.config_json, "study_id": study.study_id}


def _git():
    """Revision of a source checkout, and whether it was changed; nothing for an installed package."""
    here = Path(__file__).resolve().parent
    if not (here.parent / ".git").exists():
        return {}
    try:
        described = subprocess.run(
            ["git", "describe", "--always", "--tags", "--dirty"],
            cwd=here,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return {}
    return {
        "git_describe": described.removesuffix("-dirty"),
        "git_dirty": int(described.endswith("-dirty")),
    }
