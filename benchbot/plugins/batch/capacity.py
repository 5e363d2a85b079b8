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
    return Capacity(cpus, free_memory_bytes())


def free_memory_bytes() -> int | None:
    """Return how much memory this process may still take, of the machine's and within its limits; None: not known."""
    limits = [bytes_free for bytes_free in (_available_bytes(), group_bytes()) if bytes_free is not None]
    return min(limits) if limits else None


def _available_bytes() -> int | None:
    try:
        text = Path("/proc/meminfo").read_text("utf-8")
    except OSError:
        return None
    line = next((line for line in text.splitlines() if line.startswith("MemAvailable:")), None)
    return None if line is None else int(line.split()[1]) * 1024


def group_bytes(root: Path = Path("/sys/fs/cgroup"), membership: Path = Path("/proc/self/cgroup")) -> int | None:
    """Return what is left of the memory of this process's control groups; None when none of them has a limit."""
    try:
        lines = [line.split(":", 2) for line in membership.read_text("utf-8").splitlines()]
    except OSError:
        return None
    left = [
        _left_bytes(group, version)
        for _, controllers, own in lines
        for version in _VERSIONS
        if controllers == version.controller
        # The limit may be that of a group around its own, such as a cluster's job around its step.
        for group in _around(root / version.controller, own)
    ]
    return min((free for free in left if free is not None), default=None)


@dataclass(frozen=True)
class _Version:
    """How one of the two versions of control groups calls things (Linux, cgroup-v1/memory.rst and cgroup-v2.rst)."""

    controller: str
    limit: str
    used: str
    cached: str


_VERSIONS = (
    _Version("", "memory.max", "memory.current", "inactive_file"),
    _Version("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


def _around(root: Path, own: str) -> list[Path]:
    parts = [part for part in own.split("/") if part]
    return [root.joinpath(*parts[:count]) for count in range(len(parts) + 1)]


def _left_bytes(group: Path, version: _Version) -> int | None:
    try:
        limit = (group / version.limit).read_text("utf-8").strip()
        if limit == "max":
            return None
        used = int((group / version.used).read_text("utf-8"))
        statistics = dict(line.split() for line in (group / "memory.stat").read_text("utf-8").splitlines())
        # What was read from files long ago makes room for whoever needs it.
        return int(limit) - used + int(statistics[version.cached])
    except (OSError, ValueError, KeyError):
        return None
