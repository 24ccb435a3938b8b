"""What a run leaves in its folder: `accuracy.nc` after every round, then the report and the figures."""

import os
import platform
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy
import xarray as xr

from studies.accuracy.cases import cases
from studies.accuracy.floor import floor
from studies.accuracy.measure import dataset
from studies.accuracy.report import figure, figure_of_contacts, markdown
from studies.errors import StudyError
from studies.whole_files import written_whole


@dataclass
class Folder:
    """Where the results go, and what has been measured so far."""

    path: Path
    data: xr.Dataset = field(default_factory=xr.Dataset)

    @classmethod
    def made(cls, path):
        """A folder that can be written to, made in one that is there if need be.

        Raises
        ------
        StudyError
        """
        try:
            path.mkdir(exist_ok=True)
        except OSError as problem:
            raise StudyError(f"{path}: this folder cannot be made ({problem.strerror})") from None
        if not os.access(path, os.W_OK):
            raise StudyError(f"{path}: this folder cannot be written to")
        return cls(path)

    def keep(self, chosen, seconds, error):
        """Take over what was measured so far and write it."""
        self.data = dataset(chosen, seconds, error, {"machine": machine(), "title": "Speed against error"})
        self.write(self.data, "accuracy.nc")

    def add_floor(self, quick):
        """Measure the floor too."""
        self.data = self.data.merge(floor(quick), combine_attrs="override")
        self.write(self.data, "accuracy.nc")

    def finish(self):
        """Write tables and figures; the tables as text."""
        text = markdown(self.data)
        (self.path / "accuracy.md").write_text(text, encoding="utf-8")
        if "contacts" in self.data.dims:
            figure_of_contacts(self.data).savefig(self.path / "accuracy-contacts.png", dpi=150)
        for case in cases():
            figure(self.data, case).savefig(self.path / f"accuracy-{case}.png", dpi=150)
        return text

    def write(self, data, name):
        """Write a dataset into the folder, whole."""
        with written_whole(self.path / name) as temporary:
            data.to_netcdf(temporary)


def machine():
    """Architecture, processor and versions."""
    return (
        f"{platform.machine()}, {_processor()}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, SciPy {scipy.__version__}"
    )


def _processor():
    """Name of the processor, where the system tells."""
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo", encoding="utf-8") as information:
            for line in information:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"
