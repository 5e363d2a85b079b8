"""How many workers a machine has room for."""

import os
from dataclasses import dataclass
from pathlib import Path

MEMORY_PER_WORKER_BYTES = 2 * 2**30
"""A simulator with a furnished place, its supervisor and a modest solution; solutions with networks need more."""


@dataclass(frozen=True)
class Capacity:
    """What this process may use of its machine; `memory_bytes` is None where that cannot be told."""

    cpus: int
    memory_bytes: int | None

    def jobs(self, memory_per_job_bytes: int = MEMORY_PER_WORKER_BYTES) -> int:
        """Return how many workers there is room for, one at least."""
        by_memory = self.cpus if self.memory_bytes is None else self.memory_bytes // memory_per_job_bytes
        return max(1, min(self.cpus, by_memory))


def of_this_machine() -> Capacity:
    """Return what is free now: processor cores that this process may run on, and memory without swapping."""
    cpus = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return Capacity(cpus, _free_memory_bytes())


def _free_memory_bytes() -> int | None:
    limits = [bytes_free for bytes_free in (_available_bytes(), _group_bytes()) if bytes_free is not None]
    return min(limits) if limits else None


def _available_bytes() -> int | None:
    try:
        text = Path("/proc/meminfo").read_text("utf-8")
    except OSError:
        return None
    line = next((line for line in text.splitlines() if line.startswith("MemAvailable:")), None)
    return None if line is None else int(line.split()[1]) * 1024


def _group_bytes() -> int | None:
    """Return what is left of the memory of this process's control group (cgroup v2), if it has a limit."""
    folder = Path("/sys/fs/cgroup")
    try:
        limit = (folder / "memory.max").read_text("utf-8").strip()
        return None if limit == "max" else int(limit) - int((folder / "memory.current").read_text("utf-8"))
    except (OSError, ValueError):
        return None
