"""Workers on this machine: threads of this process, each of which lets a helper process solve its blocks.

Nothing listens, nothing of the user's program is imported again, and any thread may start them. The threads
but wait; helpers solve and write. Not here: workers on other machines (`cluster`).
"""

import os
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from math import ceil
from pathlib import Path
from queue import SimpleQueue

from studies.running.worker import compute_block
from studies.sandbox import OWN, Helper

IN_FLIGHT = 2
"""Blocks for each worker, so that none idles while this process is busy with what came back."""
GROUPS, QUOTAS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
"""Where Linux says how much of the processors a container or a service may use."""


@contextmanager
def local_workers(count):
    """Give a function (blocks, job) that yields what blocks gave as they finish.

    At the end the helpers are ended, whatever they are doing.

    Parameters
    ----------
    count : int
        How many blocks are solved at the same time.
    """
    helpers, free = [Helper() for _ in range(count)], SimpleQueue()
    for helper in helpers:
        free.put(helper)

    def take():
        OWN.helper = free.get()

    threads = ThreadPoolExecutor(count, "elastica", initializer=take)
    try:
        yield lambda blocks, job: _finished(threads, count * IN_FLIGHT, blocks, job)
    finally:
        for helper in helpers:
            helper.close()
        threads.shutdown(cancel_futures=True)


def _finished(threads, most, blocks, job):
    waiting = (threads.submit(compute_block, block, job) for block in blocks)
    flight = set(islice(waiting, most))
    while flight:
        done, flight = wait(flight, return_when=FIRST_COMPLETED)
        flight |= set(islice(waiting, len(done)))
        for future in done:
            yield future.result()


def processors():
    """Processors that this process may use: of its affinity, and by the quota of its control groups."""
    present = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return ceil(min([present, *_quotas()]))


def _quotas():
    """Processors that the control groups of this process allow, of both versions of their file system."""
    for line in GROUPS.read_text().splitlines() if GROUPS.exists() else ():
        _, kinds, name = line.split(":", 2)
        if kinds and "cpu" not in kinds.split(","):
            continue
        group = (QUOTAS / "cpu" if kinds else QUOTAS) / name.lstrip("/")
        # A container sees its own group as the root, whatever its name is outside.
        for folder in (group, *group.parents):
            if not folder.is_relative_to(QUOTAS):
                break
            try:
                if kinds:
                    files = [folder / f"cpu.cfs_{what}_us" for what in ("quota", "period")]
                    quota, period = (file.read_text().strip() for file in files)
                else:
                    quota, period = (folder / "cpu.max").read_text().split()
            except (OSError, ValueError):
                continue
            if quota not in ("max", "-1"):
                yield int(quota) / int(period)
