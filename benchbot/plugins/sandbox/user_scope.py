"""A transient scope of the user's systemd: a control group for those who may make none themselves (systemd-run(1))."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from benchbot.submission.modes import ProcessLimits

PROBE_TIMEOUT_S = 30.0
LOOK = 'cd "$1$(cut -d: -f3- "$2")" && pwd && cat memory.max pids.max'
HOLD = """\
import os, signal, sys, time
if os.fork():
    os.wait()
    os.execv(sys.argv[2], sys.argv[2:])
if os.fork() == 0:
    os.setsid()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.closerange(0, os.sysconf("SC_OPEN_MAX"))
    while os.path.isdir("/proc/" + sys.argv[1]):
        time.sleep(1)
os._exit(0)
"""
"""Executes a command beside a process that stays: with the last one the scope and what it has counted are gone."""


@contextmanager
def user_scope(name: str, limits: ProcessLimits, mounted: Path, own: Path) -> Iterator[tuple[list[str], Path] | None]:
    """Yield the words before a command that is to run in a scope of that name, and the folder of its control group.

    Yields None where there is no systemd of the user, or it may not limit memory and processes: with control groups
    of version 1. Leaving the context kills what is left in the scope.
    """
    parent = _parent_of_scopes(mounted, own)
    if parent is None:
        yield None
        return
    folder = parent / f"{name}.scope"
    try:
        python = str(Path(sys.executable).resolve())
        yield [*_in_scope(name, limits), python, "-I", "-S", "-c", HOLD, str(os.getpid())], folder
    finally:
        with suppress(OSError):
            for process in (folder / "cgroup.procs").read_text().split():
                with suppress(ProcessLookupError):
                    os.kill(int(process), signal.SIGKILL)


@cache
def _parent_of_scopes(mounted: Path, own: Path) -> Path | None:
    """Return the folder in which the groups of scopes are made; None where no scope holds the limits it is given.

    It is found out with a scope that looks at its own group: systemd accepts limits that it cannot set.
    """
    if not (mounted / "cgroup.controllers").exists() or shutil.which("systemd-run") is None:
        return None
    limits = ProcessLimits(memory_bytes=2**30, processes=100)
    name = f"benchbot-{os.getpid()}-probe"
    words = [*_in_scope(name, limits), "/bin/sh", "-c", LOOK, "sh", str(mounted), str(own)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=PROBE_TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    folder, *held = done.stdout.splitlines() or [""]
    found = Path(folder)
    return found.parent if found.name == f"{name}.scope" and held == [str(2**30), "100"] else None


def _in_scope(name: str, limits: ProcessLimits) -> list[str]:
    runtime = os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}"
    wanted = {"MemoryMax": limits.memory_bytes, "TasksMax": limits.processes}
    properties = ["MemorySwapMax=0", *(f"{key}={value}" for key, value in wanted.items() if value is not None)]
    options = [word for each in properties for word in ("-p", each)]
    scope = ["systemd-run", "--user", "--scope", "--quiet", "--collect", f"--unit={name}", *options, "--"]
    # It finds the user's systemd by one variable, which is not for what it starts.
    return ["/usr/bin/env", f"XDG_RUNTIME_DIR={runtime}", *scope, "/usr/bin/env", "-i"]
