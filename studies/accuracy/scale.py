"""Whole studies of growing size: time, memory and bytes; what solving takes apart from what keeping takes.

Each study runs as its user would run it, in processes of its own: `elastica run --shard 1/1` solves and
writes the shards, `elastica reduce` joins them. The seconds that the blocks spent on solving alone stand in
the dataset; the rest of the first command is starting, dispatch and writing shards.

Not here: tables and figures of it (`scale_report`).
"""

import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import psutil
import xarray as xr

from studies.accuracy.folder import machine
from studies.accuracy.storage import LAYOUTS, stored
from studies.design.tables import MOST_POINTS
from studies.errors import StudyError
from studies.store.files import opened
from studies.store.shards import folder_of

STUDY = """
[study]
name = "scale"
[grid]
ends = ["clamped-clamped"]
H = {{ start = 0.01, stop = 0.2, num = {gaps} }}
P = {{ start = 0.05, stop = 12.0, num = {loads} }}
[states]
names = ["U", "Ua", "U-", "UD"]
[outputs]
{outputs}
"""
SMALLEST = 1_000
EVERY = 0.1
"""Seconds between two looks at the memory."""
COMMAND = [sys.executable, "-c", "from studies.command_line import main; main()"]
OUTPUTS = {
    "maps": "",
    "maps, eigenvalues": "eigenvalues = 4",
    "maps, shapes": "shapes = 101",
    "maps, eigenvalues, shapes": "eigenvalues = 4\nshapes = 101",
}
"""What the same grid is asked for, to compare."""
POINTS_OF_OUTPUTS = 10_000
MOST_REWRITTEN = 1_000_000
"""Points of the dataset that is stored in several layouts."""


class Cost(NamedTuple):
    """What one study took: seconds of wall time, peak bytes of memory, bytes on the disk."""

    solving: float
    shards: float
    reduction: float
    cpu: float
    client_memory: float
    worker_memory: float
    shard_bytes: float
    file_bytes: float


ABOUT = {
    "solving": ("s", "time that blocks spent on solving, over the number of workers"),
    "shards": ("s", "rest of the time until all shards are there: starting, dispatch, writing"),
    "reduction": ("s", "time of joining, hashing and verifying the dataset"),
    "cpu": ("s", "processor time of all processes"),
    "client_memory": ("byte", "largest resident memory of the command's process"),
    "worker_memory": ("byte", "largest resident memory of any other process"),
    "shard_bytes": ("byte", "size of all shards"),
    "file_bytes": ("byte", "size of the dataset"),
    "writing": ("s", "time of writing the whole dataset"),
    "reading": ("s", "time of reading status, stability and energy of one state"),
}


def sizes(largest):
    """Numbers of grid points, tenfold each: 1,000 … `largest`.

    Raises
    ------
    StudyError
        If that is fewer than the smallest, or more than a study may have.
    """
    if not SMALLEST <= largest <= MOST_POINTS:
        raise StudyError(f"--scale {largest:g}: give {SMALLEST:,} to {MOST_POINTS:,} points, such as 1e6")
    return [10**k for k in range(3, int(np.log10(largest) + 1e-9) + 1)]


def study_file(points, outputs=""):
    """A study of a clamped strip with so many grid points."""
    gaps = 10 ** int(np.log10(points) / 2)
    return STUDY.format(gaps=gaps, loads=points // gaps, outputs=outputs)


def scale(largest, workers, folder):
    """Run the studies one after another in a folder and throw their files away.

    Parameters
    ----------
    largest : float
        Grid points of the largest study.
    workers : int
    folder : Path

    Yields
    ------
    str
        What was measured.
    xarray.Dataset
        All so far: `Cost` by number of grid points (`points`), and of `OUTPUTS` at a small grid
        (`outputs`); `Stored` of the `LAYOUTS` (`layout`).
    """
    tables: dict[str, dict[Any, tuple]] = {"points": {}, "outputs": {}, "layout": {}}
    with TemporaryDirectory(prefix=".scale-", dir=folder) as place:
        place = Path(place)
        for points in sizes(largest):
            out = place / f"{points}.nc"
            tables["points"][points] = spent = cost(study_file(points), workers, out)
            yield f"{points:,} points: {sum(spent[:3]):.1f} s", _dataset(tables, workers)
        for name, outputs in OUTPUTS.items():
            spent = cost(study_file(POINTS_OF_OUTPUTS, outputs), workers, place / "outputs.nc")
            (place / "outputs.nc").unlink()
            tables["outputs"][name] = spent
            yield (
                f"{POINTS_OF_OUTPUTS:,} points with {name}: {sum(spent[:3]):.1f} s",
                _dataset(tables, workers),
            )
        file = place / f"{min(max(sizes(largest)), MOST_REWRITTEN)}.nc"
        for layout in LAYOUTS:
            tables["layout"][layout.title] = took = stored(file, layout, place)
            yield f"{layout.title}: written in {took.writing:.2f} s", _dataset(tables, workers)


def cost(study, workers, out):
    """What a study takes, given as the text of its file; its dataset is written to `out`."""
    source = out.with_suffix(".toml")
    source.write_text(study, encoding="utf-8")
    command = [str(source), "-o", str(out)]
    computing = _watched(["run", *command, "--shard", "1/1", "--workers", str(workers)])
    shard_bytes = sum(path.stat().st_size for path in folder_of(out).iterdir())
    joining = _watched(["reduce", *command])
    with opened(out) as dataset:
        solving = float(dataset.getncattr("block_seconds").rpartition("sum ")[2].removesuffix(" s"))
    return Cost(
        solving=solving / workers,
        shards=computing.seconds - solving / workers,
        reduction=joining.seconds,
        cpu=computing.cpu + joining.cpu,
        client_memory=max(computing.own, joining.own),
        worker_memory=computing.others,
        shard_bytes=shard_bytes,
        file_bytes=out.stat().st_size,
    )


class Watched(NamedTuple):
    """Wall and processor seconds of a command, and peak memory of its process and of the others."""

    seconds: float
    cpu: float
    own: float
    others: float


def _watched(arguments):
    """Run the command line and look at its processes now and then."""
    begin = time.perf_counter()
    process = psutil.Popen([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    memory: dict[int, int] = {}
    cpu: dict[int, float] = {}
    while process.poll() is None:
        for seen in _family(process):
            try:
                memory[seen.pid] = max(memory.get(seen.pid, 0), seen.memory_info().rss)
                cpu[seen.pid] = sum(seen.cpu_times()[:2])
            except psutil.NoSuchProcess:
                continue
        time.sleep(EVERY)
    seconds = time.perf_counter() - begin
    if process.returncode:
        raise StudyError(f"the study failed: {process.stderr.read().decode().strip()}")
    own = memory.pop(process.pid, 0)
    return Watched(seconds, sum(cpu.values()), own, max(memory.values(), default=0))


def _family(process):
    try:
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def _dataset(tables, workers):
    """The tables, each along a dimension of its own."""
    variables = {
        name if dim == "points" else f"{dim}_{name}": (
            dim,
            [getattr(row, name) for row in table.values()],
            {"units": ABOUT[name][0], "long_name": ABOUT[name][1]},
        )
        for dim, table in tables.items()
        if table
        for name in next(iter(table.values()))._fields
    }
    labels = {dim: list(table) for dim, table in tables.items() if table}
    about = {"title": "Whole studies: time, memory and bytes", "workers": workers, "machine": machine()}
    return xr.Dataset(variables, labels, about)
