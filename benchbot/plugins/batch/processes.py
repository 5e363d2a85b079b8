"""Which process is which, on this machine: so that a dead one is known to be dead, and never taken for another."""

import os
import signal
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

_PROC = Path("/proc")


@dataclass(frozen=True)
class ProcessId:
    """A process among all that ever were: its machine (until it boots anew), its number, and when it was started.

    `machine` is empty, and a process is never known to be dead, where the system does not tell (without /proc).
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
        """Return what `as_dict` has made; raises TypeError, KeyError or ValueError for anything else."""
        return cls(str(document["machine"]), int(document["pid"]), int(document["started"]))

    def as_dict(self) -> dict[str, str | int]:
        """Return it as JSON."""
        return {"machine": self.machine, "pid": self.pid, "started": self.started}

    @property
    def is_dead(self) -> bool:
        """Whether it is known to have ended; never of a process of another machine."""
        return bool(self.machine) and self.machine == this_machine() and _started(self.pid) != self.started

    def signal_group(self, number: signal.Signals) -> None:
        """Send a signal to the process group that it leads, if it may still be there."""
        if self.machine == this_machine() and not self.is_dead:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)


@cache
def this_machine() -> str:
    """Return what no other machine, boot or container has: two containers of one machine number processes apart."""
    try:
        boot = (_PROC / "sys/kernel/random/boot_id").read_text("utf-8").strip()
        return f"{boot}:{(_PROC / 'self/ns/pid').readlink()}"
    except OSError:
        return ""


def _started(pid: int) -> int | None:
    """Return when a process was started, in clock ticks since the boot; None for one that has ended (proc(5))."""
    try:
        fields = (_PROC / str(pid) / "stat").read_text("utf-8").rpartition(")")[2].split()
    except (OSError, UnicodeDecodeError):
        return None
    return None if fields[0] in "ZX" else int(fields[19])
