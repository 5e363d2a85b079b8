"""The leader's children, and theirs: asked to end, and killed until none is left."""

import ctypes
import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

PR_SET_CHILD_SUBREAPER = 36
KILLING_TIMEOUT_S = 10.0


def adopt() -> None:
    """Become the parent of every descendant whose own parent dies (Linux; elsewhere they go to init)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def ask(*, alone: bool) -> None:
    """Ask them to end, with SIGTERM."""
    for process in [-1] if alone else _descendants(os.getpid()):
        _signal(process, signal.SIGTERM)


def kill(*, alone: bool) -> None:
    """Kill them all, those too that are made meanwhile, and reap them."""
    until_s = time.monotonic() + KILLING_TIMEOUT_S
    while _some_left() and time.monotonic() < until_s:
        for process in [-1] if alone else _descendants(os.getpid()):
            _signal(process, signal.SIGKILL)
        time.sleep(0.001)


def _some_left() -> bool:
    """Reap those that have ended; say whether there are others."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return False
    return True


def _signal(process: int, number: signal.Signals) -> None:
    # Some are gone meanwhile; a set-user-ID program is not ours to end.
    with suppress(ProcessLookupError, PermissionError):
        os.kill(process, number)


def _descendants(process: int) -> list[int]:
    """Return the numbers of all processes below one, as far as /proc tells."""
    parents: dict[int, list[int]] = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            # The name of the program, in brackets, may hold anything.
            fields = (entry / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        except OSError:
            continue
        parents.setdefault(int(fields[1]), []).append(int(entry.name))
    found, left = [], [process]
    while left:
        children = parents.get(left.pop(), [])
        found += children
        left += children
    return found
