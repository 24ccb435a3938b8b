"""Turn a study (a grid of ends, H and P with a list of states) into one labelled netCDF dataset.

>>> import studies
>>> study = studies.Study.from_toml("catalogs/first-chart.toml")      # doctest: +SKIP
>>> dataset = studies.run(study, workers=2)                           # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies import plot as plot
    from studies.catalog import Catalog as Catalog
    from studies.checking import check as check
    from studies.errors import StudyError as StudyError
    from studies.files import open as open
    from studies.loading import loading_path as loading_path
    from studies.plan import Plan as Plan
    from studies.runner import run as run
    from studies.study import Study as Study

_HOME = {
    "Study": "study",
    "StudyError": "errors",
    "Plan": "plan",
    "run": "runner",
    "open": "files",
    "check": "checking",
    "Catalog": "catalog",
    "plot": "plot",
    "loading_path": "loading",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Import on first use: solving one state must not wait for dask, xarray and matplotlib."""
    if name not in _HOME:
        raise AttributeError(f"module 'studies' has no attribute {name!r}")
    home = import_module(f"studies.{_HOME[name]}")
    return home if name == _HOME[name] else getattr(home, name)
