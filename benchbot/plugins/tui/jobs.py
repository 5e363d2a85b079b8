"""Commands that the screens start and that go on without them: each has a folder with its log, and needs no terminal.

job.json       what it is (schema: the fields of Job)
log.txt        what it says to people (stderr); locked for as long as it lives
outcome.json   what it prints as data (stdout)
"""

import fcntl
import json
import os
import secrets
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState

KEPT_JOBS = 30
QUOTED_BYTES = 20_000


@dataclass(frozen=True)
class Job:
    """A `benchbot` command that was started: its folder, its words, its process, and when (seconds since the epoch)."""

    folder: Path
    words: tuple[str, ...]
    pid: int
    started_s: float
    result: Path | None
    """Where its result will be, of a submission."""

    @property
    def log(self) -> Path:
        """What it has said."""
        return self.folder / "log.txt"

    @property
    def outcome(self) -> Path:
        """What it has printed as data."""
        return self.folder / "outcome.json"

    @property
    def alive(self) -> bool:
        """Whether it still runs: its log is locked as long as it does."""
        return run_state.is_locked(self.log)


def start(words: Sequence[str], *, result: Path | None = None, variables: Mapping[str, str] | None = None) -> Job:
    """Start `benchbot WORDS…` in a session of its own, which no terminal ends; raises BenchbotError."""
    try:
        folder = _jobs_dir() / f"{time.strftime('%Y%m%d-%H%M%S')}-{secrets.token_hex(3)}"
        folder.mkdir(mode=0o700)
        with (folder / "log.txt").open("wb") as log, (folder / "outcome.json").open("wb") as outcome:
            # The lock belongs to the open file, which the process inherits: it is there until that has ended.
            fcntl.flock(log, fcntl.LOCK_EX)
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "benchbot", *words],
                stdin=subprocess.DEVNULL,
                stdout=outcome,
                stderr=log,
                env={**os.environ, "NO_COLOR": "1", **(variables or {})},
                start_new_session=True,
            )
        job = Job(folder, tuple(words), process.pid, time.time(), result)
        atomic.write(folder / "job.json", json.dumps(_as_dict(job), indent=1).encode())
    except OSError as error:
        raise BenchbotError(
            "The command cannot be started.",
            f"{error.filename or 'It'}: {error.strerror or error}.",
            "Free some disk space or memory, or type it yourself: benchbot " + " ".join(words),
            exit_code=ExitCode.INTERNAL,
        ) from error
    # It is a child as long as these screens are there; nobody needs its exit status, but it must not stay as a zombie.
    _children.append(process)
    return job


def jobs() -> list[Job]:
    """Return the jobs of this user, newest first; of those that have ended, the newest ones only."""
    _children[:] = [process for process in _children if process.poll() is None]
    found = []
    for folder in sorted(_jobs_dir().iterdir(), reverse=True):
        # A folder without it is just being made.
        with suppress(OSError, ValueError, KeyError, TypeError):
            found.append(_from_dict(json.loads((folder / "job.json").read_text("utf-8"))))
    for job in [job for job in found if not job.alive][KEPT_JOBS:]:
        shutil.rmtree(job.folder, ignore_errors=True)
        found.remove(job)
    return found


def end(job: Job) -> None:
    """End a job as Ctrl-C in its terminal would; raises BenchbotError when that is not allowed."""
    if not job.alive:
        return
    try:
        os.kill(job.pid, signal.SIGINT)
    except ProcessLookupError:
        return
    except PermissionError as error:
        raise BenchbotError("The submission cannot be ended.", str(error), f"End its process: {job.pid}") from error


def run_of(job: Job) -> RunState | None:
    """Return the run that a job has started, as soon as it can be watched: its own, or that of its back end."""
    for state in run_state.live():
        if state.started_s >= job.started_s - 1 and job.pid in (state.pid, _parent(state.pid)):
            return state
    return None


def wait_for_run(job: Job, timeout_s: float, period_s: float) -> RunState | None:
    """Return the run that a job starts as soon as it is there; None when the job has ended before, or in time."""
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        alive = job.alive
        state = run_of(job)
        if state is not None or not alive:
            return state
        time.sleep(period_s)
    return None


def log_of(job: Job) -> str:
    """Return the end of what a job has said."""
    try:
        with job.log.open("rb") as log:
            size = log.seek(0, os.SEEK_END)
            log.seek(max(0, size - QUOTED_BYTES))
            return log.read().decode("utf-8", "replace").strip()
    except OSError as error:
        return f"Its log cannot be read: {error.strerror}."


def outcome_of(job: Job) -> dict[str, Any]:
    """Return what a submission has printed at its end (`benchbot submit --json`), empty where it has not."""
    with suppress(OSError, ValueError):
        document = json.loads(job.outcome.read_text("utf-8"))
        if isinstance(document, dict):
            return document
    return {}


_children: list["subprocess.Popen[bytes]"] = []


def _jobs_dir() -> Path:
    folder = resources.state_dir() / "jobs"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def _parent(pid: int) -> int | None:
    found = subprocess.run(["ps", "-o", "ppid=", "-p", str(pid)], capture_output=True, text=True, check=False)  # noqa: S607
    return int(found.stdout) if found.stdout.strip().isdigit() else None


def _as_dict(job: Job) -> dict[str, Any]:
    return {**asdict(job), "folder": str(job.folder), "result": None if job.result is None else str(job.result)}


def _from_dict(document: dict[str, Any]) -> Job:
    result = document["result"]
    return Job(
        **{
            **document,
            "folder": Path(document["folder"]),
            "words": tuple(document["words"]),
            "result": None if result is None else Path(result),
        }
    )
