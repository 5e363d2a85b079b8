"""Joining a run: which one is meant, and the lease by which one solution at a time acts in it.

A solution that was not given an address joins a run of `benchbot run`, never one that something else has started. It
leases the robot: it locks a file in the run's folder and writes a token into it, and while the lock is held the
supervisor lets nobody act who has another token. The kernel drops the lock, however the process ends.
"""

import fcntl
import json
import os
import secrets
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.emergency_stop import called, is_locked
from benchbot.wire.run_state import LEASE_FILE, RUN, Connection, RunState, live, runs_dir

PROBES, PROBE_PERIOD_S = 10, 0.02
"""Whoever looks whether a file is locked holds its lock for an instant."""

STARTING_FILE = "starting"
"""Locked by a run that has not got as far as its state file."""

_leases: dict[str, tuple[int, Connection]] = {}
"""The leases of this process, by the folder of the run: the open file, and the connection."""


@dataclass(frozen=True)
class Lease:
    """The process that acts in a run, since when (seconds since the epoch), and the token of its solution.

    `by_command` says that the process is not the solution itself, but has started it.
    """

    pid: int
    since_s: float
    token: str
    by_command: bool = False


def given() -> Connection | None:
    """Return the address that BENCHBOT_URL, BENCHBOT_SOCKET and BENCHBOT_TOKEN name; None without the first two."""
    url, path = os.environ.get("BENCHBOT_URL") or None, os.environ.get("BENCHBOT_SOCKET") or None
    return Connection(url, path, os.environ.get("BENCHBOT_TOKEN", "")) if url or path else None


def find(address: str | None = None) -> Connection:
    """Return how to reach the run that this process belongs to (`given`), or else the one to join.

    That one may be addressed by another URL, `address`. Raises BenchbotError when there is no run, or several and
    BENCHBOT_RUN names none of them, or another solution acts in it.
    """
    if address is None:
        return given() or join(chosen())
    token = os.environ.get("BENCHBOT_TOKEN") or join(chosen()).token
    return Connection(address, None, token)


@contextmanager
def starting() -> Iterator[None]:
    """Have submissions wait for a run meanwhile; where that cannot be said, or is said already, nothing is done."""
    handle = None
    with suppress(OSError):
        handle = os.open(runs_dir() / STARTING_FILE, os.O_RDONLY | os.O_CREAT, 0o600)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    try:
        yield
    finally:
        if handle is not None:
            os.close(handle)


def is_starting() -> bool:
    """Say whether a run is starting, and none is there yet."""
    return is_locked(runs_dir() / STARTING_FILE) and all(state.owner != RUN for state in live())


def chosen(name: str | None = None) -> RunState:
    """Return the run of `benchbot run` with `name` (or BENCHBOT_RUN) in its name, or the only one.

    Raises BenchbotError when there is none, or it is not clear which.
    """
    alive = live()
    name = name or os.environ.get("BENCHBOT_RUN")
    runs = [state for state in alive if state.owner == RUN] if name is None else [named(name, alive)]
    if len(runs) > 1:
        raise _refused(
            f"It is not clear which run is meant: {len(runs)} are there.",
            f"They are {'; '.join(state.about for state in runs)}.",
            f"Name one: --run {runs[0].name}; for a program that you start yourself: BENCHBOT_RUN={runs[0].name}",
        )
    if not runs or runs[0].owner != RUN:
        others = "; ".join(state.about for state in runs or alive)
        raise _refused(
            "No BenchBot run is there to connect to.",
            f"No benchbot run of this user is alive, and {others} lets in its own solutions only."
            if others
            else "Neither BENCHBOT_URL nor BENCHBOT_SOCKET is set, and no run of this user is alive.",
            "Start one in another terminal: benchbot run --task TASK --robot ROBOT --env ENVIRONMENT",
        )
    return runs[0]


def named(name: str, states: Sequence[RunState]) -> RunState:
    """Return the run with `name` in its name, or as its robot; raises BenchbotError unless it is exactly one."""
    found = called(name, [(state.name, state.robot) for state in states])
    if isinstance(found, tuple):
        raise BenchbotError(*found)
    return states[found]


def join(state: RunState, *, by_command: bool = False) -> Connection:
    """Lease the robot of a run until this process ends; return the connection of its solution.

    A process that has the lease already gets the same again. Raises BenchbotError when another one has it.
    """
    if state.folder in _leases:
        return _leases[state.folder][1]
    try:
        handle = os.open(Path(state.folder, LEASE_FILE), os.O_RDWR)
    except FileNotFoundError as error:
        raise _refused("The run has ended.", f"It was {state.about}.", "Start another: benchbot run …") from error
    for _ in range(PROBES):
        with suppress(BlockingIOError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        time.sleep(PROBE_PERIOD_S)
    else:
        os.close(handle)
        raise taken(lease_of(Path(state.folder)))
    lease = Lease(os.getpid(), time.time(), secrets.token_urlsafe(32), by_command)
    os.ftruncate(handle, 0)
    os.write(handle, json.dumps(asdict(lease)).encode())
    _leases[state.folder] = handle, replace(state.connection, token=lease.token)
    return _leases[state.folder][1]


def lease_of(folder: Path) -> Lease | None:
    """Return the lease of the run in a folder; None while nobody has it."""
    if not is_locked(folder / LEASE_FILE):
        return None
    with suppress(OSError, ValueError, TypeError):
        return Lease(**json.loads((folder / LEASE_FILE).read_text("utf-8")))
    return Lease(0, 0.0, secrets.token_urlsafe(32))  # it is just being written


def taken(lease: Lease | None) -> BenchbotError:
    """Return the error of who would act where another solution does."""
    who = "Another process"
    if lease is not None and lease.pid:
        who = f"Process {lease.pid}, since {time.strftime('%H:%M:%S', time.localtime(lease.since_s))},"
    return _refused(
        "The robot is taken: a solution is connected to this run.",
        f"{who} acts in it, and there is one robot.",
        "Wait until it has ended, or end it; or start a run beside it: benchbot run --port 0 …; "
        "submit starts a back end of its own with --task, --robot and --env.",
    )


def _refused(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, exit_code=ExitCode.USAGE, failure=FailureClass.INFRASTRUCTURE)
