"""Workers on this machine: a scheduler and a worker of dask in this process, whose threads let helpers solve.

Nothing listens, nothing of the user's program is imported again, and any thread may start them. The threads
but wait; helpers are processes, which solve and write. What a user configures for dask is meant for other
clusters, and stays as it is.

Not here: workers on other machines (`cluster`), what they are given (`dispatch`).
"""

import logging
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from threading import Lock

import dask
from distributed import Client, Scheduler, SpecCluster, Worker, utils
from distributed.comm.inproc import global_manager
from distributed.config import defaults

from studies.sandbox import OWN, Helper

CONFIGURED = {
    # The last messages, each with its block, and looks at what the threads do, which wait.
    "admin": {"low-level-log-length": 20, "tick": {"interval": "1s"}},
    "scheduler": {"http": {"routes": []}, "work-stealing": False, "worker-ttl": None},
    "worker": {"http": {"routes": []}, "profile": {"enabled": False}},
}
STARTING = Lock()


@contextmanager
def local_workers(count):
    """Give a dask client of workers that solve so many blocks at the same time.

    At the end the helpers are ended, whatever they are doing.
    """
    helpers = [Helper() for _ in range(count)]
    free: SimpleQueue[Helper] = SimpleQueue()
    for helper in helpers:
        free.put(helper)

    def take():
        OWN.helper = free.get()

    threads = ThreadPoolExecutor(count, "elastica", initializer=take)
    scheduler = {"protocol": "inproc", "dashboard": False}
    worker = {"nthreads": count, "executor": threads, "memory_limit": 0}
    with _silence():
        with _configured():
            cluster = SpecCluster(
                scheduler={"cls": LocalScheduler, "options": scheduler},
                workers={0: {"cls": LocalWorker, "options": worker}},
            )
        with cluster:
            with _configured():
                client = Client(cluster, set_as_default=False)
            with client:
                try:
                    yield client
                finally:
                    for helper in helpers:
                        helper.close()


class Unseen:
    """A part of dask that leaves no trace outside this process."""

    local_directory: str

    def __init__(self, *arguments, **options):
        # A folder is made, named in the path of Python and never used:
        # https://github.com/dask/distributed/blob/2026.8.0/distributed/core.py#L228
        with TemporaryDirectory() as folder:
            options |= {"local_directory": folder, "needs_workdir": False}
            super().__init__(*arguments, **options)
            sys.path.remove(self.local_directory)

    def start_http_server(self, *_, **__):
        """Listen to nobody; there is no option for it.

        https://github.com/dask/distributed/blob/2026.8.0/distributed/node.py#L133
        """


class LocalScheduler(Unseen, Scheduler):
    """The scheduler of this process."""


class LocalWorker(Unseen, Worker):
    """The worker of this process."""


@contextmanager
def _configured():
    """Let a part of dask start as if nothing were configured; only one, since all threads see it."""
    own = dask.config.merge(defaults["distributed"], CONFIGURED)
    with STARTING, dask.config.set({"distributed": own, "temporary-directory": None}):
        yield


@contextmanager
def _silence():
    """Keep from the user what dask logs of its own affairs, unless it is an error."""
    handlers = [*logging.getLogger("distributed").handlers, *logging.getLogger().handlers]

    def matters(record):
        return record.levelno >= logging.ERROR or not record.name.startswith("distributed")

    for handler in handlers:
        handler.addFilter(matters)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(matters)


def _begin_anew():
    """Give a process that forked what threads of the other one may hold."""
    global STARTING
    STARTING = Lock()
    # https://github.com/dask/distributed/blob/2026.8.0/distributed/utils.py#L1426
    utils._offload_executor = type(utils._offload_executor)(1, "Dask-Offload")


os.register_at_fork(after_in_child=_begin_anew)
# An address that is never used would be looked for in the internet.
global_manager._ip = global_manager._ip or "127.0.0.1"
