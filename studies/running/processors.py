"""How many processors a run may use: what its affinity, its container or its service leave of the machine."""

import os
from math import ceil
from pathlib import Path

GROUPS, QUOTAS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
"""Where Linux says how much of the processors a container or a service may use."""


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
