"""Weak limits: those that a machine does not hold for all processes of a solution together.

One that was asked for is refused then, unless weak ones are allowed; a default is kept as far as it goes, and said to
be weak. A result tells which were.
"""

from collections.abc import Sequence
from functools import cache

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.plugins.sandbox.control_group import control_group
from benchbot.submission.limits import DEFAULTS
from benchbot.submission.modes import ProcessLimits

MEMORY, CPU_TIME, DISK = "memory", "CPU time", "disk"
NO_GROUP = "This user can have no control group here, so they would hold for each process by itself."


def weak_limits(asked: ProcessLimits, *, allowed: bool) -> tuple[str, ...]:
    """Return the limits of a sandbox that are weak on this machine.

    Raises BenchbotError for one of them that was asked for, unless that is `allowed`.
    """
    if _has_groups():
        return ()
    wanted = [name for name, limit in ((MEMORY, asked.memory_bytes), (CPU_TIME, asked.cpu_time_s)) if limit is not None]
    if wanted and not allowed:
        raise refused(wanted, NO_GROUP)
    return (MEMORY, *([CPU_TIME] if asked.cpu_time_s is not None else []))


def refused(limits: Sequence[str], why: str) -> BenchbotError:
    """Return the error of limits that were asked for and would not hold."""
    return BenchbotError(
        f"The solution's limits would not hold: {', '.join(limits)}.",
        why,
        "Run it as root, or where systemd runs for the user (systemctl --user status) on control groups of version 2. "
        "If you trust the solution: --weak-limits",
        failure=FailureClass.INFRASTRUCTURE,
    )


@cache
def _has_groups() -> bool:
    """Return whether this user can have control groups, found out once."""
    with control_group(DEFAULTS) as group:
        return group is not None
