"""Workers on this machine: nothing listens, they start from any thread and program, and Ctrl-C is heard."""

import logging
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager
from copy import deepcopy

import dask
import distributed  # noqa: F401  (its defaults are there before a test compares them)
import psutil
import pytest
from end_to_end.conftest import TOML
from end_to_end.processes import poisoned, start

import studies
from studies.running import processors, session
from studies.store.datasets import identify

STUDY = TOML.replace("num = 12", "num = 4").replace("eigenvalues = 3\nshapes = 11", "")
HANG = ("clamped-pinned", 0.2, 4.6)
PLAIN = """
import studies
study = studies.Study.from_toml("small.toml")
with open("imported", "a") as file:
    file.write("x")
def work():
    studies.run(study, "out.nc", workers=2, block_points=10).close()
{}
"""
PROGRAMS = {
    "no guard": "work()",
    "another thread": "import threading\nt = threading.Thread(target=work)\nt.start()\nt.join()",
    "a running loop": "import asyncio\nasync def main(): work()\nasyncio.run(main())",
    "a pool, after a helper": (
        "from studies.sandbox import call\nassert call(len, 'four', limit=60) == 4\n"
        "import multiprocessing\nwith multiprocessing.get_context('fork').Pool(1) as p: p.apply(work)\n"
        "assert call(len, 'four', limit=60) == 4"
    ),
    "a pool, after a run": (
        "import multiprocessing, os\nwork()\nos.remove('out.nc')\n"
        "with multiprocessing.get_context('fork').Pool(1) as p: p.apply(work)"
    ),
}


def tree(pid):
    root = psutil.Process(pid)
    return [root, *root.children(recursive=True)]


def helpers(process):
    """Helper processes of a run that have begun to solve."""
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        try:
            if "studies.sandbox" in " ".join(child.cmdline()):
                found.append(child)
        except psutil.Error:
            continue
    return found


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    (folder / "small.toml").write_text(STUDY)
    studies.run(studies.Study.from_toml(folder / "small.toml"), folder / "small.nc", workers=0).close()
    return identify(folder / "small.nc")["content_hash"]


@pytest.fixture
def hanging(tmp_path):
    """A run of two workers, both of which have blocks; it does not end by itself."""
    # A study that is not small is cut into more than one block.
    (tmp_path / "small.toml").write_text(TOML.replace("max_contacts = 1", "max_contacts = 4"))
    process = start("run", "small.toml", "--workers", 2, cwd=tmp_path, **poisoned("hang", *HANG))
    yield process
    for one in tree(process.pid) if process.poll() is None else ():
        one.kill()
    process.communicate()


def until_both_work(process):
    while len(helpers(process)) < 2:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)


def test_no_process_of_a_run_listens(hanging):
    until_both_work(hanging)
    for process in tree(hanging.pid):
        found = process.net_connections(kind="inet")
        assert [one for one in found if one.status == psutil.CONN_LISTEN] == []
        assert [one for one in process.net_connections(kind="unix") if one.laddr] == []


@pytest.mark.parametrize("program", PROGRAMS)
def test_any_program_may_run_a_study(program, tmp_path, content):
    """Without a guard of its main module, which no worker imports, and outside its main thread."""
    (tmp_path / "small.toml").write_text(STUDY)
    text = PLAIN.format(PROGRAMS[program])
    told = subprocess.run(
        [sys.executable, "-"],
        input=text,
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (told.returncode, told.stderr) == (0, "")
    assert identify(tmp_path / "out.nc")["content_hash"] == content
    assert (tmp_path / "imported").read_text() == "x"


@pytest.mark.parametrize(
    ("moment", "sign"),
    [
        ("at the lock", signal.SIGINT),
        ("at the first helper", signal.SIGINT),
        ("when both work", signal.SIGINT),
        ("when both work", signal.SIGTERM),
    ],
)
def test_a_run_stops_when_it_is_told(hanging, moment, sign, tmp_path):
    def there():
        return {
            "at the lock": (tmp_path / "small.nc.shards" / "run.lock").exists(),
            "at the first helper": len(helpers(hanging)) > 0,
            "when both work": len(helpers(hanging)) > 1,
        }[moment]

    while not there():
        assert hanging.poll() is None, hanging.communicate()
        time.sleep(0.01)
    processes = tree(hanging.pid)
    hanging.send_signal(sign)
    _, errors = hanging.communicate()
    assert hanging.returncode == 130
    assert "the same command goes on from there" in errors
    assert "Traceback" not in errors
    psutil.wait_procs(processes)
    assert list((tmp_path / "small.nc.shards").glob(".*")) == []


def test_a_stopped_run_goes_on_in_the_same_process(tmp_path, content, monkeypatch):
    """As in a notebook: what was under way has ended, and the next run has workers of its own."""
    (tmp_path / "small.toml").write_text(STUDY)
    study = studies.Study.from_toml(tmp_path / "small.toml")
    # Dask keeps one thread for all that a process does with it.
    studies.run(study, tmp_path / "first.nc", workers=2, block_points=10).close()
    before = set(threading.enumerate())

    @contextmanager
    def interrupted(total, done):
        def advance(points):
            raise KeyboardInterrupt

        yield advance

    with monkeypatch.context() as patch:
        patch.setattr(session, "progress", interrupted)
        with pytest.raises(KeyboardInterrupt):
            studies.run(study, tmp_path / "out.nc", workers=2, block_points=10)
    assert set(threading.enumerate()) == before
    studies.run(study, tmp_path / "out.nc", workers=2, block_points=10).close()
    assert identify(tmp_path / "out.nc")["content_hash"] == content
    assert set(threading.enumerate()) == before


def test_what_is_configured_for_dask_does_not_matter_and_stays(tmp_path, content, monkeypatch):
    """Nor do two runs in one process disturb each other."""
    (tmp_path / "small.toml").write_text(STUDY)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    study, names = studies.Study.from_toml(tmp_path / "small.toml"), ("one.nc", "other.nc")

    def work(name):
        studies.run(study, tmp_path / name, workers=2, block_points=10).close()

    def everything():
        filters = [handler.filters[:] for handler in logging.getLogger().handlers]
        return deepcopy(dask.config.config), sys.path[:], filters

    with dask.config.set(
        {
            "temporary-directory": "/nowhere/at/all",
            "distributed.scheduler.contact-address": "tcp://nowhere:1",
            "distributed.worker.lifetime.duration": "1 ms",
            "distributed.worker.preload": ["no_such_module"],
        }
    ):
        before = everything()
        threads = [threading.Thread(target=work, args=(name,)) for name in names]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert everything() == before
    assert [identify(tmp_path / name)["content_hash"] for name in names] == [content] * 2
    assert list((tmp_path / "temporary").iterdir()) == []


@pytest.mark.parametrize(
    ("groups", "files", "most"),
    [
        ("0::/user/a.service", {"user/a.service/cpu.max": "150000 100000"}, 2),
        ("0::/user/a.service", {"user/cpu.max": "50000 100000", "user/a.service/cpu.max": "max 100000"}, 1),
        ("0::/outside/name", {"cpu.max": "100000 100000"}, 1),
        ("0::/", {"cpu.max": "max 100000"}, 8),
        (
            "3:cpu,cpuacct:/a\n1:memory:/b\n0::/",
            {"cpu/a/cpu.cfs_quota_us": "300000", "cpu/a/cpu.cfs_period_us": "100000"},
            3,
        ),
        ("3:cpu:/", {"cpu/cpu.cfs_quota_us": "-1", "cpu/cpu.cfs_period_us": "100000"}, 8),
    ],
)
def test_a_quota_of_processors_is_respected(groups, files, most, tmp_path, monkeypatch):
    (tmp_path / "cgroup").write_text(f"{groups}\n")
    for name, text in files.items():
        path = tmp_path / "fs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{text}\n")
    monkeypatch.setattr(processors, "GROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(processors, "QUOTAS", tmp_path / "fs")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(8), raising=False)
    assert processors.processors() == most
