"""Processes: starting a module of ours, its last words, how it ended, whether it is stopped, its processors."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

QUOTED_LINES = 15
QUOTED_BYTES = 3000
TAIL_LINES = 5
TAIL_BYTES = 4000


def start_module(
    module: str, *arguments: str, output: IO[bytes], stdin: int = subprocess.DEVNULL, pass_fds: Sequence[int] = ()
) -> "subprocess.Popen[bytes]":
    """Start `python -m module` in a session of its own: Ctrl-C in the terminal is for this process alone.

    Its stdout and stderr go to `output`. No module in the working folder, as of a solution, shadows one of ours.
    """
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments],
        stdin=stdin,
        stdout=output,
        stderr=output,
        pass_fds=pass_fds,
        start_new_session=True,
    )


def processors(root: Path = Path("/sys/fs/cgroup"), membership: Path = Path("/proc/self/cgroup")) -> int:
    """Return how many processors this process may use: by its affinity, and by the quotas of its control groups.

    A quota counts in whole processors, one at least (Linux, cgroup-v2.rst `cpu.max`; sched-bwc.rst for version 1).
    """
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    groups = control_groups(root, membership)
    quotas = [_quota(group) for names, group in groups if not names or "cpu" in names.split(",")]
    return max(1, min([count, *(quota for quota in quotas if quota is not None)]))


def control_groups(root: Path, membership: Path) -> Iterator[tuple[str, Path]]:
    """Yield the folders of a process's control groups, with the names of their controllers (none in version 2).

    A limit may be that of a group around its own, such as a container's, or a cluster's job around its step: those are
    yielded as well. `membership` is the process's file in /proc.
    """
    try:
        lines = membership.read_text("utf-8").splitlines()
    except OSError:
        return
    for _, names, own in (line.split(":", 2) for line in lines):
        parts = [part for part in own.split("/") if part]
        yield from ((names, root.joinpath(names, *parts[:depth])) for depth in range(len(parts) + 1))


def _quota(group: Path) -> int | None:
    """Return the whole processors that a control group may use; None for any number."""
    try:
        if (group / "cpu.max").exists():
            quota, period = (group / "cpu.max").read_text("utf-8").split()
        else:
            quota, period = ((group / f"cpu.cfs_{name}_us").read_text("utf-8") for name in ("quota", "period"))
        return None if quota == "max" or int(quota) < 0 else int(quota) // int(period)
    except (OSError, ValueError, ZeroDivisionError):
        return None


def how_it_ended(code: int) -> str:
    """Return what an exit code of `subprocess` says, as the end of a sentence."""
    if code >= 0:
        return f"ended with exit code {code}"
    name = signal_name(-code)
    if -code == signal.SIGKILL:
        return f"was ended by {name} (somebody killed it, or the machine ran out of memory)"
    return f"was ended by {name}"


def signal_name(number: int) -> str:
    """Return the name of a signal; most real-time signals have none, and are named by their number."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def last_words(log: IO[bytes], start: int = 0, most_lines: int = QUOTED_LINES) -> str:
    """Return the last lines of a log, from byte `start` on, as sentences that follow a description of its end."""
    size = log.seek(0, os.SEEK_END)
    log.seek(max(start, size - QUOTED_BYTES * most_lines // QUOTED_LINES))
    lines = log.read().decode("utf-8", "replace").strip().splitlines()
    return "\n".join(["Its last words:", *lines[-most_lines:]]) if lines else "It left no last words."


def is_stopped(pid: int) -> bool:
    """Return whether SIGSTOP, or Ctrl-Z in its terminal, has stopped a process; False without /proc."""
    return _state(pid) == "T"


def is_running(pid: int) -> bool:
    """Return whether a process is there, and not one that has ended and nobody has asked about; False without /proc."""
    return _state(pid) not in {"", "Z", "X"}


def _state(pid: int) -> str:
    with suppress(OSError):
        # The name of the program, in brackets, may hold anything.
        return Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()[0]
    return ""


def tree(pid: int) -> Iterator[int]:
    """Yield a process and all that it has started, but for this process and what it has started; as /proc tells."""
    if pid == os.getpid():
        return
    yield pid
    with suppress(OSError):  # it has ended meanwhile
        for thread in os.scandir(f"/proc/{pid}/task"):
            for child in Path(thread.path, "children").read_text("ascii").split():
                yield from tree(int(child))


class LastWords:
    """The last lines of a program's output, taken in chunk by chunk; `str` returns them."""

    def __init__(self) -> None:
        self._end = b""

    def add(self, chunk: bytes) -> None:
        """Take in what the program prints."""
        self._end = (self._end + chunk)[-TAIL_BYTES:]

    def __str__(self) -> str:
        lines = [line.strip() for line in self._end.decode("utf-8", "replace").splitlines()]
        return "\n".join([line for line in lines if line][-TAIL_LINES:])
