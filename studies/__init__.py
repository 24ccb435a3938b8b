"""Turn a study (a grid of ends, H and P with a list of states) into one labelled netCDF dataset.

>>> import studies
>>> study = studies.Study.from_toml("catalogs/first-chart.toml")      # doctest: +SKIP
>>> dataset = studies.run(study, workers=2)                           # doctest: +SKIP

Study         what is asked for, from a TOML file or a dict, validated before anything runs
Plan          a study cut into blocks: how many points, how large, how long
run           compute a study and open its dataset
open          open a dataset as `xarray.Dataset`, which has `.elastica` for what this package adds
check         verify a dataset and say what is in it
plot          figures and films of a dataset: `plot.chart`, `plot.bifurcation`, `plot.shapes` …
loading_path  push and release a strip slowly: the loop, with its jumps, as a dataset
to_dataset    an answer of elastica.solve or elastica.find_states, as a labelled dataset
Catalog       a folder of finished datasets, found again without opening them
StudyError    the error of everything here: one sentence that says what to change

Each is imported when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies import plot as plot
    from studies.answers import to_dataset as to_dataset
    from studies.archive.catalog import Catalog as Catalog
    from studies.archive.checking import check as check
    from studies.design.plan import Plan as Plan
    from studies.design.study import Study as Study
    from studies.errors import StudyError as StudyError
    from studies.loading import loading_path as loading_path
    from studies.running.runner import run as run
    from studies.store.datasets import open as open

_HOME = {
    "Study": "design.study",
    "StudyError": "errors",
    "Plan": "design.plan",
    "run": "running.runner",
    "open": "store.datasets",
    "check": "archive.checking",
    "Catalog": "archive.catalog",
    "plot": "plot",
    "loading_path": "loading",
    "to_dataset": "answers",
}

__all__ = sorted(_HOME)


def __dir__() -> list[str]:
    """What there is, imported or not: completion and `help` look here."""
    return __all__


def __getattr__(name: str) -> Any:
    """Import on first use: solving one state must not wait for dask, xarray and matplotlib."""
    if name not in _HOME:
        raise AttributeError(f"module 'studies' has no attribute {name!r}")
    if name != "StudyError":
        system = import_module("studies.system")
        system.refuse_windows()
        system.refuse_pyelastica()
    home = import_module(f"studies.{_HOME[name]}")
    return home if name == _HOME[name] else getattr(home, name)
