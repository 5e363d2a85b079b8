"""What the leader does: it starts one command, waits for it, and ends everything that came of it.

The solution may start processes that leave its group (a double fork); those become children of the leader, which ends
them. It ends them too when the other end of its control pipe is closed, which is so however BenchBot itself ends.
"""

import json
import os
import select
import signal
import time
from contextlib import suppress
from typing import Any

from benchbot.submission.init import confinement, handover, tree

GRACE_S = 2.0
POLITE = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
FAILED = 127


def main(orders: int) -> None:
    """Lead the solution that the JSON document in the file `orders` describes; exits as it ends.

    Its keys: `command`, `folder`, `environment`; `control` and `report`, two pipes by their numbers; `alone`, whether
    this process is in a process namespace with the solution alone; `confinement` (see there); `handover` (see there).
    """
    with os.fdopen(orders, "rb") as file:
        order = json.load(file)
    for number in (order["control"], order["report"]):
        os.set_inheritable(number, False)
    _tell(order["report"], {"leading": os.getpid()})
    for number in POLITE:
        signal.signal(number, signal.SIG_IGN)
    confinement.of_leader(order["confinement"])
    if not order["alone"]:
        tree.adopt()
    handing_over = handover.Handover.of(order["handover"])
    woken, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.set_wakeup_fd(waker, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    solution = _start(order)
    status = _wait(solution, order, woken)
    tree.kill(alone=order["alone"])
    report: dict[str, Any] = {"status": status}
    if handing_over is not None and status == 0:
        report["refused"] = handing_over.hand_over()
    _tell(order["report"], report)
    os._exit(0)


def _start(order: dict[str, Any]) -> int:
    """Start the solution and return its number; tells why when it cannot be started, and exits."""
    failing, failed = os.pipe()
    solution = os.fork()
    if solution == 0:
        try:
            os.close(failing)
            _become(order)
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
        _tell(order["report"], {"cannot_start": why.decode("utf-8", "replace")})
        os._exit(FAILED)
    _tell(order["report"], {"started": solution})
    return solution


def _become(order: dict[str, Any]) -> None:
    signal.set_wakeup_fd(-1)
    for number in (*POLITE, signal.SIGCHLD, signal.SIGPIPE, signal.SIGXFSZ):
        signal.signal(number, signal.SIG_DFL)
    os.chdir(order["folder"])
    environment, command = order["environment"], order["command"]
    confinement.of_solution(order["confinement"])
    os.execvpe(command[0], command, environment)  # noqa: S606


def _wait(solution: int, order: dict[str, Any], woken: int) -> int:
    """Return the solution's exit status (negative: a signal), when it has ended, or been ended as we were told to."""
    control, kill_at_s = order["control"], None
    watched = [woken, control]
    while True:
        left_s = None if kill_at_s is None else max(0.0, kill_at_s - time.monotonic())
        ready, _, _ = select.select(watched, [], [], left_s)
        if woken in ready:
            os.read(woken, 4096)
        while (ended := _reaped()) is not None:
            if ended[0] == solution:
                return os.waitstatus_to_exitcode(ended[1])
        if control in ready:
            watched.remove(control)
            kill_at_s = time.monotonic() + GRACE_S
            tree.ask(alone=order["alone"])
        elif kill_at_s is not None and time.monotonic() >= kill_at_s:
            return -signal.SIGKILL


def _reaped() -> tuple[int, int] | None:
    try:
        process, status = os.waitpid(-1, os.WNOHANG)
    except ChildProcessError:
        return None
    return (process, status) if process else None


def _tell(report: int, document: dict[str, Any]) -> None:
    # Perhaps nobody is there to read it any more.
    with suppress(BrokenPipeError):
        os.write(report, json.dumps(document).encode() + b"\n")
