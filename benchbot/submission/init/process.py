"""The init process: it starts one command, waits for it, and ends its whole process tree.

The solution may start processes that leave its group (a double fork); those become children of the init process, which
ends them. It also ends them when the other end of its control pipe is closed, as it is however BenchBot itself ends.
"""

import ctypes
import json
import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchbot.submission.init import confinement
from benchbot.submission.init.handover import hand_over

GRACE_S = 2.0
KILLING_TIMEOUT_S = 10.0
POLITE = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
FAILED = 127
PR_SET_CHILD_SUBREAPER = 36


def main(job_file: int) -> None:
    """Run the solution that the JSON document in the open file `job_file` describes; exits when it has ended.

    Its keys: `command`, `folder`, `environment`; `control` and `report`, two pipes by their numbers; `alone`, whether
    this process is in a process namespace with the solution alone; `confinement` (see there); `handover` (see there).
    """
    with os.fdopen(job_file, "rb") as file:
        job = json.load(file)
    handover = job["handover"]
    for number in (job["control"], job["report"], *([] if handover is None else [handover["target"]])):
        os.set_inheritable(number, False)
    _report(job, {"init": os.getpid()})
    for number in POLITE:
        signal.signal(number, signal.SIG_IGN)
    confinement.of_init_process(job["confinement"])
    if not job["alone"]:
        adopt()
    woken, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.set_wakeup_fd(waker, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    solution = _start(job)
    status = _wait(solution, job, woken)
    _kill_all(alone=job["alone"])
    report: dict[str, Any] = {"status": status}
    if handover is not None and status == 0:
        report["refused"] = hand_over(**handover)
    _report(job, report)
    os._exit(0)


def adopt() -> None:
    """Become the parent of every descendant whose own parent dies (Linux; elsewhere they go to the system's init)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def _start(job: dict[str, Any]) -> int:
    """Start the solution and return its number; reports why when it cannot be started, and exits."""
    failing, failed = os.pipe()
    solution = os.fork()
    if solution == 0:
        try:
            os.close(failing)
            _become(job)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            os.write(failed, why.encode("utf-8", "replace"))
        finally:
            os._exit(FAILED)
    os.close(failed)
    why = b""
    while chunk := os.read(failing, 4096):
        why += chunk
    os.close(failing)
    if why:
        os.waitpid(solution, 0)
        _report(job, {"cannot_start": why.decode("utf-8", "replace")})
        os._exit(FAILED)
    _report(job, {"started": solution})
    return solution


def _become(job: dict[str, Any]) -> None:
    signal.set_wakeup_fd(-1)
    for number in (*POLITE, signal.SIGCHLD, signal.SIGPIPE, signal.SIGXFSZ):
        signal.signal(number, signal.SIG_DFL)
    os.chdir(job["folder"])
    environment, command = job["environment"], job["command"]
    confinement.of_solution(job["confinement"])
    os.execvpe(command[0], command, environment)  # noqa: S606


def _wait(solution: int, job: dict[str, Any], woken: int) -> int:
    """Return the exit status (negative: a signal) of the solution, when it has ended or was ended on request."""
    control, kill_at_s = job["control"], None
    watched = [woken, control]
    while True:
        left_s = None if kill_at_s is None else max(0.0, kill_at_s - time.monotonic())
        ready, _, _ = select.select(watched, [], [], left_s)
        if woken in ready:
            os.read(woken, 4096)
        with suppress(ChildProcessError):
            while True:
                process, status = os.waitpid(-1, os.WNOHANG)
                if process == solution:
                    return os.waitstatus_to_exitcode(status)
                if not process:
                    break
        if control in ready:
            watched.remove(control)
            kill_at_s = time.monotonic() + GRACE_S
            _signal_all(signal.SIGTERM, alone=job["alone"])
        elif kill_at_s is not None and time.monotonic() >= kill_at_s:
            return -signal.SIGKILL


def _kill_all(*, alone: bool) -> None:
    """Kill and reap the process tree, those too that are started meanwhile."""
    until_s = time.monotonic() + KILLING_TIMEOUT_S
    while _some_left() and time.monotonic() < until_s:
        _signal_all(signal.SIGKILL, alone=alone)
        time.sleep(0.001)


def _some_left() -> bool:
    """Reap the children that have ended; return whether there are others."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return False
    return True


def _signal_all(number: signal.Signals, *, alone: bool) -> None:
    for process in [-1] if alone else descendants(os.getpid()):
        # Some have ended meanwhile; a set-user-ID program may not be signalled.
        with suppress(ProcessLookupError, PermissionError):
            os.kill(process, number)


def descendants(process: int) -> list[int]:
    """Return the numbers of all living processes below one in the process tree, as far as /proc tells."""
    parents: dict[int, list[int]] = {}
    ended = set()
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            # The name of the program, in brackets, may hold anything.
            fields = (entry / "stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        except OSError:
            continue
        parents.setdefault(int(fields[1]), []).append(int(entry.name))
        if fields[0] == "Z":
            ended.add(int(entry.name))
    found, left = [], [process]
    while left:
        children = parents.get(left.pop(), [])
        found += children
        left += children
    return [each for each in found if each not in ended]


def _report(job: dict[str, Any], document: dict[str, Any]) -> None:
    # The reader may have ended already.
    with suppress(BrokenPipeError):
        os.write(job["report"], json.dumps(document).encode() + b"\n")
