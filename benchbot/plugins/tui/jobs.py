"""Live runs and batches of this user, and jobs: commands that the screens start and that go on without them.

A job has a folder, and needs no terminal:

job.json       the fields of `Job`
log.txt        its stderr; locked for as long as it lives
outcome.json   its stdout, which of a submission is a JSON document
code.txt       its exit code, if the process that has started it saw its end
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
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import msgspec

from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.emergency_stop import is_locked
from benchbot.plugins.screens.child_command import as_typed
from benchbot.plugins.tui import result_rows
from benchbot.plugins.watching.batch_list import BatchList
from benchbot.plugins.watching.logs import end_of
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState

KEPT_JOBS = 30
CONFIDENTIAL = ("--token", "--secret", "--password")
"""Options whose values no screen shows."""
QUOTED_BYTES = 20_000
INTERRUPTED = (-signal.SIGINT, ExitCode.INTERRUPTED)
REAPING_S = 1.0
RUNNING, WELL, BADLY = "running", "well", "badly"


@dataclass(frozen=True)
class Job:
    """A `benchbot` command that was started: its folder, words, process, and start (seconds since the epoch)."""

    folder: Path
    words: tuple[str, ...]
    pid: int
    started_s: float
    result: Path | None
    """The file of its result, of a submission."""

    @property
    def is_submission(self) -> bool:
        """Whether it submits a solution."""
        return self.words[0] == "submit"

    @property
    def log(self) -> Path:
        """The file of its stderr."""
        return self.folder / "log.txt"

    @property
    def outcome(self) -> Path:
        """The file of its stdout."""
        return self.folder / "outcome.json"

    @property
    def alive(self) -> bool:
        """Whether it still runs: its log is locked as long as it does."""
        return is_locked(self.log)

    @property
    def title(self) -> str:
        """The solution or command, the environment and the robot."""
        options = dict(word.removeprefix("--").split("=", 1) for word in self.words if "=" in word)
        command = " ".join(takewhile(lambda word: not word.startswith("-"), self.words))
        solution = options.get("example") or options.get("native") or command
        return "  ".join(filter(None, [solution, options.get("env"), options.get("robot")]))

    @property
    def command(self) -> str:
        """The command, as it can be typed; what is confidential is left out."""
        return as_typed([_shown(word) for word in self.words])


@dataclass(frozen=True)
class JobStatus:
    """A job, its state (`running`, ended `well` or `badly`), and its outcome in a few words."""

    job: Job
    state: str
    summary: str


@dataclass(frozen=True)
class Alive:
    """Live runs, batches and jobs at one moment; the newest first."""

    runs: tuple[RunState, ...] = ()
    batches: tuple[BatchEntry, ...] = ()
    jobs: tuple[JobStatus, ...] = ()


def look() -> Alive:
    """Return what is alive now; who looks again and again calls one `looker`."""
    return looker()()


def looker(*, remembers: bool = False) -> Callable[[], Alive]:
    """Return what looks for what is alive, and reads what does not change once.

    If it `remembers`, the first look takes counts of batches from the last one of this user.
    """
    known = BatchList(remembers=remembers)

    def look_again() -> Alive:
        listed = tuple(status_of(job) for job in jobs() if _is_listed(job))
        return Alive(tuple(run_state.live()), tuple(known.look()), listed)

    return look_again


def start(words: Sequence[str], *, result: Path | None = None) -> Job:
    """Start `benchbot WORDS…` in a session of its own, which no terminal ends; raises BenchbotError."""
    try:
        folder = _jobs_dir() / f"{time.strftime('%Y%m%d-%H%M%S')}-{secrets.token_hex(3)}"
        folder.mkdir(mode=0o700)
        with (folder / "log.txt").open("wb") as log, (folder / "outcome.json").open("wb") as outcome:
            # The lock belongs to the open file, which the process inherits: it is released when that has ended.
            fcntl.flock(log, fcntl.LOCK_EX)
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "benchbot", *words],
                stdin=subprocess.DEVNULL,
                stdout=outcome,
                stderr=log,
                env={**os.environ, "NO_COLOR": "1"},
                start_new_session=True,
            )
        job = Job(folder, tuple(words), process.pid, time.time(), result)
        atomic.write(folder / "job.json", msgspec.json.format(msgspec.json.encode(job, enc_hook=str)))
    except OSError as error:
        raise BenchbotError(
            "The command cannot be started.",
            f"{error.filename or 'It'}: {error.strerror or error}.",
            "Free some disk space or memory, or type it yourself: benchbot " + " ".join(words),
            exit_code=ExitCode.INTERNAL,
        ) from error
    # It is a child for as long as this process lives: `jobs` reaps it, so that it does not stay as a zombie.
    _children.append((folder, process))
    return job


def jobs() -> list[Job]:
    """Return the jobs of this user, newest first; of those that have ended, the newest ones only."""
    _reap()
    found = []
    for folder in sorted(_jobs_dir().iterdir(), reverse=True):
        # A folder without job.json is just being made.
        with suppress(OSError, msgspec.DecodeError, UnicodeDecodeError):
            document = (folder / "job.json").read_bytes()
            found.append(msgspec.json.decode(document, type=Job, dec_hook=lambda kind, text: kind(text)))
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
        raise BenchbotError("The job cannot be ended.", str(error), f"End its process: {job.pid}") from error


def run_of(job: Job) -> RunState | None:
    """Return the run that a job has started, as soon as it can be watched: its own, or that of its back end."""
    for state in run_state.live():
        if state.started_s >= job.started_s - 1 and job.pid in (state.pid, _parent(state.pid)):
            return state
    return None


def wait_for_run(job: Job, timeout_s: float, period_s: float) -> RunState | None:
    """Return the run that a job starts; None when the job has ended before, or after the timeout."""
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        alive = job.alive
        state = run_of(job)
        if state is not None or not alive:
            return state
        time.sleep(period_s)
    return None


def status_of(job: Job) -> JobStatus:
    """Return the state of a job, and its outcome in a few words."""
    if job.alive:
        return JobStatus(job, RUNNING, "running")
    outcome = outcome_of(job)
    error = outcome.get("error")
    if error:
        return JobStatus(job, BADLY, str(error["title"]))
    if "scores_path" in outcome:
        return JobStatus(job, WELL, result_rows.headline_of(Path(outcome["scores_path"])) or "scored")
    if outcome.get("result_path"):
        return JobStatus(job, WELL, "not scored")
    code = _code_of(job)
    if code == 0:
        return JobStatus(job, WELL, "ended well")
    log = log_of(job)
    if "Error: " not in log and code in INTERRUPTED:
        return JobStatus(job, BADLY, "it was ended")
    if "Error: " not in log and code is None and not job.is_submission:
        return JobStatus(job, BADLY, "ended; its log tells whether well")
    return JobStatus(job, BADLY, last_error(log))


def log_of(job: Job) -> str:
    """Return the end of a job's log."""
    try:
        return end_of(job.log, QUOTED_BYTES).strip()
    except OSError as error:
        return f"Its log cannot be read: {error.strerror}."


def outcome_of(job: Job) -> dict[str, Any]:
    """Return the document that a submission prints at its end (`benchbot submit --json`); empty of anything else."""
    if not job.is_submission:
        return {}
    with suppress(OSError, ValueError):
        document = json.loads(job.outcome.read_text("utf-8"))
        if isinstance(document, dict):
            return document
    return {}


def output_of(job: Job) -> str:
    """Return the end of what a job has printed for people to read."""
    with suppress(OSError):
        return "" if outcome_of(job) else end_of(job.outcome, QUOTED_BYTES).strip()
    return ""


def last_error(log: str) -> str:
    """Return the title of the last error in a log, or its last line."""
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    errors = [line.removeprefix("Error: ") for line in lines if line.startswith("Error: ")]
    return (errors or lines or ["it was ended"])[-1]


_children: list[tuple[Path, "subprocess.Popen[bytes]"]] = []


def _is_listed(job: Job) -> bool:
    """Return whether to list a job: any; but a run or batch, which has its own list, if it could not begin."""
    if job.words[0] not in ("run", "batch"):
        return True
    log = log_of(job)
    return not job.alive and ("Error: " in log if job.words[0] == "batch" else "Ready." not in log)


def _reap() -> None:
    """Keep the exit codes of the children that have ended."""
    for child in list(_children):
        folder, process = child
        try:
            # A log is unlocked a moment before its process can be reaped.
            code = process.wait(0 if is_locked(folder / "log.txt") else REAPING_S)
        except subprocess.TimeoutExpired:
            continue
        # The folder may have been removed, and another thread may be at it.
        with suppress(OSError):
            atomic.write(folder / "code.txt", str(code).encode())
        with suppress(ValueError):
            _children.remove(child)


def _code_of(job: Job) -> int | None:
    """Return the exit code of a job that has ended, None where nobody saw its end."""
    _reap()
    with suppress(OSError, ValueError):
        return int((job.folder / "code.txt").read_text())
    return None


def _shown(word: str) -> str:
    option, _, value = word.partition("=")
    return f"{option}=…" if option in CONFIDENTIAL and value not in ("", "random") else word


def _jobs_dir() -> Path:
    folder = resources.state_dir() / "jobs"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def _parent(pid: int) -> int | None:
    found = subprocess.run(["ps", "-o", "ppid=", "-p", str(pid)], capture_output=True, text=True, check=False)  # noqa: S607
    return int(found.stdout) if found.stdout.strip().isdigit() else None
