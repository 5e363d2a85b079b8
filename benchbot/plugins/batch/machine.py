"""This machine: the identity of its processes, and the processor cores, memory and disk space that are free on it."""

import errno
import math
import os
import shutil
import signal
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self, TypeVar

import psutil

from benchbot.core.errors import BenchbotError
from benchbot.process import control_groups, processors

T = TypeVar("T")
MEMORY_PER_WORKER_BYTES = 2 * 2**30
"""A simulator with a furnished place, its supervisor and a modest solution; solutions with networks need more."""
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
POLL_S = 1.0
SAMPLE_PERIOD_S = 1.0
REMEMBERED_EPISODES = 5
MEMORY_TIMEOUT_S = 600.0
"""The longest wait for memory: an episode that is killed for want of it is tried again, a wait may never end."""

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PROC = Path("/proc")


@dataclass(frozen=True)
class ProcessId:
    """A process, distinct from all others: its machine (until the next boot), its number, and its start.

    `started` is in clock ticks since the boot. `machine` is empty, and a process never known to be dead, where the
    system does not tell (without /proc).
    """

    machine: str
    pid: int
    started: int

    @classmethod
    def of(cls, pid: int) -> Self:
        """Return the identity of a running process."""
        return cls(this_machine(), pid, _started(pid) or 0)

    @classmethod
    def from_dict(cls, document: Any) -> Self:
        """Return the inverse of `as_dict`; raises TypeError, KeyError or ValueError for anything else."""
        return cls(str(document["machine"]), int(document["pid"]), int(document["started"]))

    def as_dict(self) -> dict[str, str | int]:
        """Return it as JSON."""
        return {"machine": self.machine, "pid": self.pid, "started": self.started}

    @property
    def is_dead(self) -> bool:
        """Whether it is known to have ended; never true of a process of another machine."""
        return bool(self.machine) and self.machine == this_machine() and _started(self.pid) != self.started

    def signal_group(self, number: signal.Signals) -> None:
        """Send a signal to the process group that it leads, if it may still be there."""
        if self.machine == this_machine() and not self.is_dead:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)


@cache
def this_machine() -> str:
    """Return a text that no other machine, boot or container has: containers of one machine number processes apart."""
    try:
        boot = (_PROC / "sys/kernel/random/boot_id").read_text("utf-8").strip()
        return f"{boot}:{(_PROC / 'self/ns/pid').readlink()}"
    except OSError:
        return ""


def _started(pid: int) -> int | None:
    """Return the start of a process, in clock ticks since the boot; None for one that has ended."""
    try:
        # psutil counts from the epoch, by a clock that may be set. The boot is counted by the same clock: the
        # difference stays. It is read first, since psutil 6 adds the one that was read last.
        boot_s = psutil.boot_time()
        process = psutil.Process(pid)
        if process.status() in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
            return None
        started_s: float = process.create_time() - boot_s
        return round(started_s * _TICKS_PER_S)
    except (psutil.Error, OSError):
        return None


@dataclass(frozen=True)
class Capacity:
    """The part of a machine that a process may use; `memory_bytes` is None where that cannot be told."""

    cpus: int
    memory_bytes: int | None

    def jobs(self, memory_per_job_bytes: int = MEMORY_PER_WORKER_BYTES) -> int:
        """Return how many workers there is room for, one at least."""
        by_memory = self.cpus if self.memory_bytes is None else self.memory_bytes // memory_per_job_bytes
        return max(1, min(self.cpus, by_memory))


def free_capacity() -> Capacity:
    """Return the processor cores that this process may run on, and the memory that is free without swapping."""
    return Capacity(processors(), free_memory_bytes())


def free_memory_bytes() -> int | None:
    """Return how much memory this process may still take, of the machine's and within its limits; None: not known."""
    limits = []
    with suppress(OSError):
        limits.append(int(psutil.virtual_memory().available))
    group = group_bytes()
    return min([*limits, *([] if group is None else [group])], default=None)


_GROUP_FILES = {
    "": ("memory.max", "memory.current", "inactive_file"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
}
"""The files of limit and use, and the key of the cache in `memory.stat`, by controller: of version 2 and 1 of control
groups (Linux, cgroup-v2.rst and cgroup-v1/memory.rst)."""


def group_bytes(root: Path = Path("/sys/fs/cgroup"), membership: Path = _PROC / "self/cgroup") -> int | None:
    """Return the memory left to this process's control groups; None when none of them has a limit."""
    groups = control_groups(root, membership)
    left = [_left_bytes(group, *_GROUP_FILES[names]) for names, group in groups if names in _GROUP_FILES]
    return min((free for free in left if free is not None), default=None)


def _left_bytes(group: Path, limit_name: str, used_name: str, cached_key: str) -> int | None:
    try:
        limit = (group / limit_name).read_text("utf-8").strip()
        if limit == "max":
            return None
        used = int((group / used_name).read_text("utf-8"))
        statistics = dict(line.split() for line in (group / "memory.stat").read_text("utf-8").splitlines())
        # Pages of files that were not read lately are given up when memory is needed.
        return int(limit) - used + int(statistics[cached_key])
    except (OSError, ValueError, KeyError):
        return None


class MemoryWatch:
    """The memory of a worker's process tree: the worker, the simulator that it keeps, and the solution."""

    def __init__(self, root: int) -> None:
        self._root = root
        self._peaks: deque[int] = deque(maxlen=REMEMBERED_EPISODES)
        self._sampled_s = float("-inf")

    def begin(self) -> None:
        """Begin a new episode; those before it are remembered apart."""
        self._peaks.append(0)

    def sample(self) -> None:
        """Measure the tree, at most once in `SAMPLE_PERIOD_S`."""
        now_s = time.monotonic()
        if now_s - self._sampled_s >= SAMPLE_PERIOD_S:
            self._sampled_s = now_s
            self._peaks[-1] = max(self._peaks[-1], tree_bytes(self._root))

    @property
    def needed_bytes(self) -> int:
        """The memory that the next episode adds to the tree's, if it is like the last ones; 0: not known."""
        return max(0, max(self._peaks, default=0) - tree_bytes(self._root))

    def wait_for_room(self, is_wanted: Callable[[], bool], tell: Callable[[int, int], None]) -> None:
        """Return when the next episode fits, nothing is wanted any more, or `MEMORY_TIMEOUT_S` has passed."""
        wait_for_room(free_memory_bytes, lambda: self.needed_bytes, is_wanted, tell, MEMORY_TIMEOUT_S)


def tree_bytes(pid: int) -> int:
    """Return the memory that a process and its descendants do not share: resident, not mapped from files."""
    total = 0
    with suppress(psutil.Error, OSError):
        root = psutil.Process(pid)
        for process in (root, *root.children(recursive=True)):
            with suppress(psutil.Error):
                memory = process.memory_info()
                total += memory.rss - getattr(memory, "shared", 0)
    return total


def wait_for_disk(
    folder: Path, minimum_bytes: int, is_wanted: Callable[[], bool], tell: Callable[[int, int], None]
) -> None:
    """Return when so much is free where a folder is, or nothing is wanted any more."""
    wait_for_room(lambda: shutil.disk_usage(folder).free, lambda: minimum_bytes, is_wanted, tell)


def wait_for_room(
    free_bytes: Callable[[], int | None],
    needed_bytes: Callable[[], int],
    is_wanted: Callable[[], bool],
    tell: Callable[[int, int], None],
    timeout_s: float = math.inf,
) -> None:
    """Return when enough is free (None: not known), nothing is wanted any more, or the time is over.

    `tell` is called with free and needed bytes once, if it waits at all. It polls: room can be made by anything.
    """
    deadline_s = time.monotonic() + timeout_s
    told = False
    while is_wanted() and time.monotonic() < deadline_s:
        free, needed = free_bytes(), needed_bytes()
        if free is None or free >= needed:
            return
        if not told:
            tell(free, needed)
            told = True
        time.sleep(POLL_S)


def shortage(folder: Path, minimum_bytes: int) -> str | None:
    """Return why nothing may begin where a folder is, in words; None when enough is free, or that cannot be told."""
    with suppress(OSError):
        free = shutil.disk_usage(folder).free
        if free < minimum_bytes:
            return f"{folder}: {free >> 20} MiB are free, {minimum_bytes >> 20} MiB are needed"
    return None


def is_disk_full(error: Exception) -> bool:
    """Say whether an error, or what it comes of, is about room on the disk, a quota or a limit of a file's size."""
    cause = error.__cause__ if isinstance(error, BenchbotError) else error
    return isinstance(cause, OSError) and cause.errno in DISK_FULL


def when_there_is_room(act: Callable[[], T], is_wanted: Callable[[], bool], tell: Callable[[Exception], None]) -> T:
    """Return the value of something that writes; on a full disk, try again until it succeeds or is wanted no more.

    `tell` is called with the first error of a full disk. All others, and that of the last try, are raised.
    """
    told = False
    while True:
        try:
            return act()
        except (OSError, BenchbotError) as error:
            if not is_disk_full(error):
                raise
            if not told:
                tell(error)
                told = True
            time.sleep(POLL_S)
            if not is_wanted():
                raise
