"""The state files of running supervisors: what runs on this machine, and how dead runs are cleaned up."""

import fcntl
import json
import os
import secrets
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from benchbot.core import resources
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.findings import Finding, Level
from benchbot.emergency_stop import OWNERS, is_locked

DEFAULT_PORT = 10000
KEPT_FOLDERS = 20
STATE_FILE = "run.json"
LEASE_FILE = "lease.json"
"""Beside the state file: which process has leased the robot (benchbot.wire.joining)."""
RUN, SUBMIT = OWNERS
"""Owners of back ends: solutions may join those of `benchbot run`, and what others start is for their own solutions."""


@dataclass(frozen=True)
class Connection:
    """The address of a supervisor: a URL on loopback and/or a unix socket, and the run's bearer token."""

    url: str | None
    socket: str | None
    token: str

    def environment(self) -> dict[str, str]:
        """Return the variables that hand this connection to a solution's process."""
        variables = {"BENCHBOT_URL": self.url, "BENCHBOT_SOCKET": self.socket, "BENCHBOT_TOKEN": self.token}
        return {name: value for name, value in variables.items() if value}


@dataclass(frozen=True)
class RunState:
    """The content of a run's state file. Paths are absolute; `started_s` is seconds since the epoch.

    `operator_token` is for the person beside the robot: a solution is not given it. `owner` is what has started the
    back end, such as `benchbot run` or `benchbot batch FOLDER`. `findings` are those of a real robot's diagnosis.
    """

    connection: Connection
    operator_token: str
    pid: int
    task: str
    robot: str
    environment: str
    seed: int
    folder: str
    platform_log: str
    supervisor_log: str
    result: str
    started_s: float
    owner: str = RUN
    secret: str = ""
    findings: list[Finding] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The name of its folder, which no other run has."""
        return Path(self.folder).name

    @property
    def about(self) -> str:
        """Its name and owner, what it is of, where it listens, its process and its start."""
        what = f"{self.name} of {self.owner}: {self.task} on {self.robot} in {self.environment}"
        since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(self.started_s))
        return f"{what}, {self.connection.url or self.connection.socket}, process {self.pid}, since {since}"

    def as_dict(self) -> dict[str, Any]:
        """Return the state as the JSON document that is written."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> Self:
        """Return the state that a JSON document holds; raises TypeError, KeyError or ValueError for any other."""
        told = {"findings": (), **document}
        findings = [Finding(**{**one, "level": Level(one["level"])}) for one in told["findings"]]
        return cls(**{**told, "connection": Connection(**told["connection"]), "findings": findings})


class RunFolder:
    """The private folder (0700) of a run, locked for as long as its process lives.

    The lock, not the process number, says whether a run is alive: the kernel drops it however the process ends.
    """

    def __init__(self) -> None:
        stamp = time.strftime("%Y%m%d-%H%M%S")
        try:
            clean()
            self.path = runs_dir() / f"{stamp}-{secrets.token_hex(4)}"
            self.path.mkdir(mode=0o700)
            self._lock = os.open(self.path, os.O_RDONLY)
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        except OSError as error:
            raise _cannot_write(error) from error

    @property
    def result(self) -> Path:
        """Where the run's result document is written."""
        return self.path / "result.json"

    def publish(self, state: RunState) -> None:
        """Write the state file (0600) atomically: from now on clients find the run."""
        temporary = self.path / f".{STATE_FILE}"
        try:
            handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                json.dump(state.as_dict(), file, indent=1)
            if state.owner == RUN:
                (self.path / LEASE_FILE).touch(0o600)
            temporary.replace(self.path / STATE_FILE)
        except OSError as error:
            raise _cannot_write(error) from error

    def unpublish(self) -> None:
        """Remove the state file: the run has ended, though its process goes on."""
        for name in (STATE_FILE, LEASE_FILE):
            (self.path / name).unlink(missing_ok=True)

    def close(self, *, keep: bool) -> None:
        """Remove the state file, and the whole folder unless its logs or result are worth keeping."""
        self.unpublish()
        if not keep:
            shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


def runs_dir() -> Path:
    """Return the folder of all runs of this user."""
    folder = resources.state_dir() / "runs"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def live() -> list[RunState]:
    """Return the runs of this user that are alive, newest first."""
    states = []
    for folder in _folders():
        if is_locked(folder):
            # A state file that vanishes or is half a document belongs to a run that is just ending.
            with suppress(OSError, ValueError, TypeError, KeyError):
                states.append(RunState.from_dict(json.loads((folder / STATE_FILE).read_text("utf-8"))))
    return sorted(states, key=lambda state: state.started_s, reverse=True)


def is_alive(state: RunState) -> bool:
    """Say whether a run has not ended; its process may go on with another one."""
    folder = Path(state.folder)
    try:
        found = RunState.from_dict(json.loads((folder / STATE_FILE).read_text("utf-8")))
    except (OSError, ValueError, TypeError, KeyError):
        return False
    return found.operator_token == state.operator_token and is_locked(folder)


def clean() -> None:
    """Remove the state files and sockets of this user's dead runs, and all but the newest folders of finished ones."""
    dead = [folder for folder in _folders() if not is_locked(folder)]
    for folder in dead:
        with suppress(OSError, ValueError, TypeError, KeyError):
            state = RunState.from_dict(json.loads((folder / STATE_FILE).read_text("utf-8")))
            if state.connection.socket:
                Path(state.connection.socket).unlink(missing_ok=True)
        for name in (STATE_FILE, LEASE_FILE):
            with suppress(OSError):
                (folder / name).unlink(missing_ok=True)
    for folder in sorted(dead, key=lambda folder: folder.name)[:-KEPT_FOLDERS]:
        shutil.rmtree(folder, ignore_errors=True)


def is_listening(path: Path) -> bool:
    """Return whether the unix socket at a path accepts connections; raises OSError where it may not be tried."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            return False
    return True


def _cannot_write(error: OSError) -> BenchbotError:
    return BenchbotError(
        "The run cannot write its files.",
        f"{error.filename or 'The state folder'}: {error.strerror or error}.",
        "Free some disk space, or name a folder that is yours to write: export BENCHBOT_STATE_DIR=…",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )


def _folders() -> Iterator[Path]:
    """Yield the folders that belong to this user: where users share a state folder, root could read those of others."""
    for entry in os.scandir(runs_dir()):
        try:
            ours = entry.is_dir(follow_symlinks=False) and entry.stat(follow_symlinks=False).st_uid == os.geteuid()
        except FileNotFoundError:  # another run has ended meanwhile, or has cleaned up
            continue
        if ours:
            yield Path(entry)
