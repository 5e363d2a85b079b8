"""A control group for one solution: limits on all of its processes together (cgroups(7), versions 1 and 2).

It is made here where this user may, and else by the user's systemd.
"""

import os
import secrets
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from benchbot.plugins.sandbox.user_scope import user_scope
from benchbot.submission.modes import ProcessLimits

MOUNTED = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")
PREFIX = "benchbot-"
CONTROLLERS = ("memory", "pids", "cpu")
CPU_FILES = ("cpuacct.usage", "cpu.stat")
REMOVING_TIMEOUT_S = 5.0
ENTER = 'until [ "$1" = -- ]; do echo 0 > "$1" || exit 125; shift; done; shift; exec "$@"'


@dataclass(frozen=True)
class ControlGroup:
    """The folders of the group: one in version 2, one per controller in version 1.

    `entering` are the words before a command that joins the group and stays inside, with its whole process tree.
    """

    folders: Mapping[str, Path]
    entering: Sequence[str] = ()

    def killed_for_memory(self) -> bool:
        """Return whether the kernel has killed one of its processes because the group used too much memory."""
        folder = self.folders["memory"]
        return any(_count(folder / name, "oom_kill") for name in ("memory.oom_control", "memory.events"))

    def refused_processes(self) -> bool:
        """Return whether the group has been refused a process because it had too many."""
        return _count(self.folders["pids"] / "pids.events", "max") > 0

    def cpu_time_s(self) -> float:
        """Return the CPU time that all of its processes have used, those that have ended, too."""
        with suppress(OSError):
            return int((self.folders["cpu"] / CPU_FILES[0]).read_text()) / 1e9
        return _count(self.folders["cpu"] / CPU_FILES[1], "usage_usec") / 1e6


@contextmanager
def control_group(limits: ProcessLimits, mounted: Path = MOUNTED, own: Path = OWN) -> Iterator[ControlGroup | None]:
    """Make a group with limits on memory and processes; yields None where this user can have none.

    It is removed in the end, when all of its processes have ended.
    """
    name = f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}"
    made: list[Path] = []
    try:
        group = _make(name, limits, mounted, own, made)
        if group is not None:
            yield group
            return
        with user_scope(name, limits, mounted, own) as scope:
            yield None if scope is None else ControlGroup(dict.fromkeys(CONTROLLERS, scope[1]), scope[0])
    finally:
        for folder in made:
            _remove(folder)


def of_process(process: int, mounted: Path = MOUNTED) -> ControlGroup | None:
    """Return the group that a process is in, to look at; None where its CPU time cannot be seen."""
    groups = _groups_of(Path(f"/proc/{process}/cgroup"))
    for folder in (
        mounted / "cpuacct" / groups.get("cpuacct", "/").strip("/"),
        mounted / groups.get("", "/").strip("/"),
    ):
        if folder not in (mounted, mounted / "cpuacct") and any((folder / name).exists() for name in CPU_FILES):
            return ControlGroup({"cpu": folder})
    return None


def _groups_of(file: Path) -> dict[str, str]:
    """Return the paths of the groups of a process by controller; that of version 2 by an empty name."""
    try:
        lines = [line.split(":", 2) for line in file.read_text().splitlines()]
    except OSError:
        return {}
    return {name: path for _, names, path in lines for name in names.split(",")}


def _make(name: str, limits: ProcessLimits, mounted: Path, own: Path, made: list[Path]) -> ControlGroup | None:
    groups = _groups_of(own)
    if not groups:
        return None
    if (mounted / "cgroup.controllers").exists():
        folder = _folder(mounted, groups.get("", "/"), name, ("memory.max", "pids.max"), made)
        folders = {} if folder is None else dict.fromkeys(CONTROLLERS, folder)
    else:
        folders = {}
        for key, controller, file in (
            ("memory", "memory", "memory.limit_in_bytes"),
            ("pids", "pids", "pids.max"),
            ("cpu", "cpuacct", CPU_FILES[0]),
        ):
            made_here = _folder(mounted / controller, groups.get(controller, "/"), name, (file,), made)
            if made_here is not None:
                folders[key] = made_here
    if len(folders) < len(CONTROLLERS):
        return None
    try:
        for knob, value in _values(folders, limits):
            knob.write_text(value)
    except OSError:
        return None
    joined = [str(folder / "cgroup.procs") for folder in dict.fromkeys(folders.values())]
    return ControlGroup(folders, ["/bin/sh", "-c", ENTER, "sh", *joined, "--"])


def _folder(mounted: Path, path: str, name: str, files: tuple[str, ...], made: list[Path]) -> Path | None:
    """Make the group below our own, or below the nearest ancestor that permits it and has the controllers."""
    inner = mounted / path.strip("/")
    for above in (inner, *inner.parents):
        folder = above / name
        _sweep(above)
        with suppress(OSError):
            folder.mkdir()
            if all((folder / file).exists() for file in files):
                made.append(folder)
                return folder
            folder.rmdir()
        if above == mounted:
            return None
    return None


def _sweep(above: Path) -> None:
    """Remove the groups of processes that were killed before they could: nothing is in them any more."""
    for folder in above.glob(f"{PREFIX}*-*"):
        owner = folder.name.removeprefix(PREFIX).partition("-")[0]
        if owner.isdecimal() and not Path("/proc", owner).exists():
            with suppress(OSError):
                folder.rmdir()


def _values(folders: Mapping[str, Path], limits: ProcessLimits) -> Iterator[tuple[Path, str]]:
    memory, pids = folders["memory"], folders["pids"]
    if limits.memory_bytes is not None:
        if (memory / "memory.max").exists():
            yield memory / "memory.max", str(limits.memory_bytes)
        else:
            yield memory / "memory.limit_in_bytes", str(limits.memory_bytes)
        # With memory on disk: the kernel may not account for that.
        for name, value in (("memory.memsw.limit_in_bytes", str(limits.memory_bytes)), ("memory.swap.max", "0")):
            if (memory / name).exists():
                yield memory / name, value
    if limits.processes is not None:
        yield pids / "pids.max", str(limits.processes)


def _count(file: Path, key: str) -> int:
    with suppress(OSError, ValueError):
        for line in file.read_text().splitlines():
            words = line.split()
            if len(words) == 2 and words[0] == key:
                return int(words[1])
    return 0


def _remove(folder: Path) -> None:
    """Remove a group; its last processes may still be on their way out."""
    until_s = time.monotonic() + REMOVING_TIMEOUT_S
    while folder.exists() and time.monotonic() < until_s:
        with suppress(OSError):
            folder.rmdir()
            return
        time.sleep(0.01)
