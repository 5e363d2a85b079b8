"""What processes use, as /proc tells it: their processor time and memory, and that of their children."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

_PROC = Path("/proc")
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Use:
    """Processor time since the processes began, in seconds, and the memory that they hold (resident set)."""

    cpu_s: float
    memory_bytes: int


def of(pids: Iterable[int]) -> Use | None:
    """Return what processes and their descendants use; None where the system does not tell (without /proc)."""
    found = [use for pid in _with_children(pids) if (use := _of_one(pid)) is not None]
    return Use(sum(use.cpu_s for use in found), sum(use.memory_bytes for use in found)) if found else None


def _with_children(pids: Iterable[int]) -> set[int]:
    found, left = set[int](), set(pids)
    while left:
        pid = left.pop()
        found.add(pid)
        left |= set(_children(pid)) - found
    return found


def _children(pid: int) -> list[int]:
    # Children belong to the thread that started them.
    try:
        tasks = list((_PROC / str(pid) / "task").iterdir())
        return [int(child) for task in tasks for child in (task / "children").read_text("ascii").split()]
    except OSError:  # a thread has ended meanwhile, or the kernel does not list children
        return []


def _of_one(pid: int) -> Use | None:
    try:
        fields = (_PROC / str(pid) / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return None
    # proc_pid_stat(5): utime and stime are fields 14 and 15, rss is field 24; the first two are cut off here.
    return Use((int(fields[11]) + int(fields[12])) / _TICKS_PER_S, int(fields[21]) * _PAGE_BYTES)
