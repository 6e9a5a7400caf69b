"""How many processors this process may use."""

from __future__ import annotations

import os
from collections.abc import Iterator
from math import ceil
from pathlib import Path, PurePosixPath

#: Where Linux mounts its control groups.
CGROUPS = Path("/sys/fs/cgroup")

#: Which control groups this process is in, "hierarchy:controllers:path" line by line.
OWN_CGROUPS = Path("/proc/self/cgroup")

#: Quota and period, microseconds: of a group of version 2 in one file ("max" for no limit), of
#: version 1 in two (-1 for none).
LIMIT_FILES = ("cpu.max", "cpu.cfs_quota_us", "cpu.cfs_period_us")


def default_threads() -> int:
    """Return how many processors this process may use, at least 1.

    The least of its scheduler affinity, of the processor time that its control groups allow (a
    container's limit; a part of a processor counts as one) and of SLURM_CPUS_PER_TASK.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    processors = len(affinity(0)) if affinity else os.cpu_count() or 1
    limits = [processors, *_cgroup_limits()]
    slurm = os.environ.get("SLURM_CPUS_PER_TASK", "")
    if slurm.isdecimal():
        limits.append(int(slurm))
    return max(1, min(limits))


def _cgroup_limits() -> Iterator[int]:
    """Yield the processors that each control group allows, from the process's own to the root."""
    for line in _text(OWN_CGROUPS).splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers and "cpu" not in controllers.split(","):
            continue
        mount = CGROUPS / "cpu" if controllers else CGROUPS
        for group in (PurePosixPath(path), *PurePosixPath(path).parents):
            folder = mount / str(group).lstrip("/")
            words = " ".join(_text(folder / name) for name in LIMIT_FILES).split()
            if len(words) == 2 and all(word.isdecimal() for word in words):
                quota, period = map(int, words)
                yield ceil(quota / max(period, 1))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii", errors="replace")
    except OSError:
        return ""
