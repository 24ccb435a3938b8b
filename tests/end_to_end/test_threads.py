"""Datasets that are read lazily in several threads, while others are opened, closed and computed."""

import copy
import pickle
import subprocess
import sys
import threading

import numpy as np
import xarray as xr

import studies
from studies.store.access import ACCESS

READERS = """
import gc, sys, threading
import studies, xarray
from studies.store.content import content_hash
path, foreign = sys.argv[1:]
whole = studies.open(path).load()
problems = []
def read():
    for turn in range(12):
        with studies.open(path, chunks={} if turn % 8 == 0 else None) as dataset:
            for name in ("energy", "eigenvalue", "theta", "status", "reaction"):
                if not dataset[name][:, :, ::3].equals(whole[name][:, :, ::3]):
                    problems.append(name)
        # Some are never closed, but collected.
        studies.open(path)["index"].values
def hash_again():
    for _ in range(12):
        content_hash(path)
def read_others():
    for _ in range(24):
        with xarray.open_dataset(foreign) as other:
            other["a"].values
threads = [threading.Thread(target=work) for work in (read, read, read, hash_again, read_others)]
for thread in threads: thread.start()
for thread in threads: thread.join()
sys.exit(problems or 0)
"""


def test_lazy_reads_in_several_threads(dataset_file, tmp_path):
    xr.Dataset({"a": ("x", np.arange(1000.0))}).to_netcdf(tmp_path / "foreign.nc")
    command = [sys.executable, "-c", READERS, str(dataset_file), str(tmp_path / "foreign.nc")]
    told = subprocess.run(command, capture_output=True, text=True)
    assert told.returncode == 0, (told.returncode, told.stderr[-2000:])


def test_who_has_access_keeps_xarray_out_and_may_read_on(dataset_file, tmp_path):
    xr.Dataset({"a": ("x", np.arange(3))}).to_netcdf(tmp_path / "foreign.nc")
    done = threading.Event()
    with studies.open(dataset_file) as dataset, xr.open_dataset(tmp_path / "foreign.nc") as foreign:

        def read():
            foreign["a"].values  # noqa: B018
            done.set()

        with ACCESS, ACCESS:
            thread = threading.Thread(target=read)
            thread.start()
            assert dataset["energy"].values.shape
            assert not free_elsewhere()
            assert not done.is_set()
        thread.join()
        assert done.is_set()
        assert free_elsewhere()


def free_elsewhere():
    """Whether another thread could have access."""
    found = []

    def ask():
        found.append(ACCESS.acquire(blocking=False))
        if found[0]:
            ACCESS.release()

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return found[0]


def test_a_dataset_that_is_open_can_be_sent_and_copied(dataset_file):
    with studies.open(dataset_file) as dataset:
        sent = pickle.loads(pickle.dumps(dataset))
        assert sent.equals(dataset)
        sent.close()
        assert copy.deepcopy(dataset).equals(dataset)
    assert pickle.loads(pickle.dumps(ACCESS)) is ACCESS
