"""Use of processors, memory and GPUs, and rates of growth.

/proc is read directly: for a process and its descendants that is 15 times faster than psutil, which reads the entry of
every process of the machine to find the children of one.
"""

import os
import shutil
import subprocess
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

GPU_PERIOD_S = 2
WINDOW_S = 3.0

_MIB = 2**20
_PROC = Path("/proc")
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_GPU_QUERY = ("--query-gpu=index,utilization.gpu,memory.used", "--format=csv,noheader,nounits")


@dataclass(frozen=True)
class ProcessUsage:
    """Processor time since the processes began, in seconds, and the memory that they hold (resident set)."""

    cpu_s: float
    memory_bytes: int


@dataclass(frozen=True)
class GpuUsage:
    """The share of time in which the busiest GPU was in use, and the memory that is in use on all of them."""

    percent: float
    memory_bytes: int


class GpuMeter:
    """Reads `nvidia-smi` in a process that ends with this one; `usage` stays None where that tool is missing.

    https://docs.nvidia.com/deploy/nvidia-smi/index.html
    """

    def __init__(self) -> None:
        self.usage: GpuUsage | None = None
        self._process: subprocess.Popen[str] | None = None
        tool = shutil.which("nvidia-smi")
        if tool is not None:
            command = [tool, *_GPU_QUERY, f"--loop={GPU_PERIOD_S}"]
            try:
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
                )
            except OSError:  # a file of that name that cannot be executed
                return
            threading.Thread(target=self._read, args=(self._process,), name="benchbot-gpu", daemon=True).start()

    def close(self) -> None:
        """End the tool."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _read(self, process: "subprocess.Popen[str]") -> None:
        by_index: dict[str, str] = {}
        for line in process.stdout or ():
            index, _, rest = line.partition(",")
            by_index[index] = rest
            self.usage = gpu_usage(by_index)


class Rates:
    """Growth per second of some counts over the last few seconds; it restarts when a count shrinks."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        self._samples: deque[tuple[float, tuple[float, ...]]] = deque()

    def note(self, now_s: float, *counts: float) -> tuple[float, ...]:
        """Add the present counts, and return by how much each grows per second."""
        samples = self._samples
        if samples and any(now < before for now, before in zip(counts, samples[-1][1], strict=True)):
            samples.clear()
        if not samples or now_s > samples[-1][0]:
            samples.append((now_s, counts))
        while len(samples) > 2 and now_s - samples[1][0] >= self._window_s:
            samples.popleft()
        (first_s, first), (last_s, last) = samples[0], samples[-1]
        if last_s <= first_s:
            return (0.0,) * len(counts)
        return tuple((now - before) / (last_s - first_s) for now, before in zip(last, first, strict=True))


def process_tree_usage(root: int) -> ProcessUsage | None:
    """Return the use of a process and its descendants; None where the system does not tell (without /proc)."""
    waiting, seen = [root], {root}
    used: list[ProcessUsage] = []
    while waiting:
        pid = waiting.pop()
        usage = _process_usage(pid)
        if usage is not None:
            used.append(usage)
        children = [child for child in _children(pid) if child not in seen]
        seen.update(children)
        waiting += children
    return ProcessUsage(sum(each.cpu_s for each in used), sum(each.memory_bytes for each in used)) if used else None


def gpu_usage(by_index: Mapping[str, str]) -> GpuUsage | None:
    """Return the use of GPUs from `share, MiB` of each, by its index. A divided GPU (MIG) has no share."""
    shares, memory_bytes = [], 0
    for rest in by_index.values():
        share, _, memory = (part.strip() for part in rest.partition(","))
        if memory.isdecimal():
            memory_bytes += int(memory) * _MIB
            shares.append(float(share) if share.isdecimal() else 0.0)
    return GpuUsage(max(shares), memory_bytes) if shares else None


def _children(pid: int) -> list[int]:
    # Children belong to the thread that started them.
    try:
        tasks = list((_PROC / str(pid) / "task").iterdir())
        return [int(child) for task in tasks for child in (task / "children").read_text("ascii").split()]
    except OSError:  # a thread has ended meanwhile, or the kernel does not list children
        return []


def _process_usage(pid: int) -> ProcessUsage | None:
    try:
        fields = (_PROC / str(pid) / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return None
    # proc_pid_stat(5): utime and stime are fields 14 and 15, rss is field 24; the first two are cut off here.
    return ProcessUsage((int(fields[11]) + int(fields[12])) / _TICKS_PER_S, int(fields[21]) * _PAGE_BYTES)
