"""A solution as a process under an init process, which starts it and ends its whole process tree."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Self

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.process import LastWords, signal_name
from benchbot.submission.init.process import GRACE_S, descendants

MARGIN_S = 1.0
"""The time that the init process has, beyond what it grants, to end all that is left."""
KILLING_S = 1.0
"""The time in which this process ends it instead: at most 5 seconds in all, whatever a solution does."""
CODE = Path(__file__).parents[2]
"""The folder that `benchbot` is in."""
START = "import sys; sys.path.insert(0, sys.argv[1]); from benchbot.submission.init import process; process.main({})"


@dataclass(frozen=True)
class InitOptions:
    """The options of an init process; the defaults are those of a native solution.

    `wrapper` is a command that runs it, such as a sandbox's, `code` the folder that `benchbot` is in for it, and
    `environment` its own. It inherits the open files `handles`. `job` are further keys of its job: see
    `init.process.main`.
    """

    wrapper: Sequence[str] = ()
    code: Path = CODE
    environment: Mapping[str, str] | None = None
    handles: Sequence[int] = ()
    job: Mapping[str, Any] = field(default_factory=dict)


NATIVE_INIT = InitOptions()


class Solution:
    """The running process of a solution.

    Its output goes to `output`, chunk by chunk and untouched. Leaving the context ends it and whatever it has started:
    asked by SIGTERM, then killed. That happens as well when this process dies.
    """

    def __init__(
        self,
        command: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        output: Callable[[bytes], object],
        init: InitOptions = NATIVE_INIT,
    ) -> None:
        self.command = list(command)
        self._folder = folder
        self._environment = environment
        self._output = output
        self._init = init
        self._last_words = LastWords()
        self._reports = b""
        self._ended: dict[str, Any] = {}

    def __enter__(self) -> Self:
        if not self._folder.is_dir():
            raise cannot_start(self.command, f"its folder {self._folder} is not there")
        report, reported = os.pipe()
        controlled, self._control = os.pipe()
        try:
            self._process = self._start_init(controlled, reported)
        except BaseException:
            os.close(report)
            os.close(self._control)
            raise
        finally:
            os.close(reported)
            os.close(controlled)
        self._report = os.fdopen(report, "rb", buffering=0)
        self._reader = threading.Thread(target=self._pass_on, args=(self._process.stdout,), daemon=True)
        self._reader.start()
        try:
            self._check_start()
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_error: object) -> None:
        self.end()

    @property
    def process(self) -> int:
        """The number of the init process, and of its group."""
        return self._process.pid

    @property
    def refused(self) -> str | None:
        """The reason why its result was not taken out of its sandbox; None when there is none."""
        refused: str | None = self._ended.get("refused")
        return refused

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""
        try:
            status = self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None
        if not self._ended:
            # An init process that was killed reports no status. Bubblewrap adds 128 to signals, as shells do.
            killed = 128 - status if status > 128 else status or -signal.SIGKILL
            self._ended = {"status": killed, **self._next_report()}
        told: int = self._ended["status"]
        return told

    def explain(self, status: int) -> BenchbotError | None:
        """Return None: a native solution has no limits."""
        return None

    def end(self) -> None:
        """End the process and everything that it has started; asks first, and never waits longer than 5 seconds."""
        if self._control >= 0:
            os.close(self._control)
            self._control = -1
        try:
            self._process.wait(GRACE_S + MARGIN_S)
        except subprocess.TimeoutExpired:
            # The init process may have been stopped. It is killed last: what it has adopted would have no parent.
            self._kill_descendants()
        # It may have been killed before the others.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._reader.join(KILLING_S)
        self._report.close()

    @property
    def last_words(self) -> str:
        """The last lines of its output."""
        return str(self._last_words)

    def _kill_descendants(self) -> None:
        until_s = time.monotonic() + KILLING_S
        while (left := descendants(self._process.pid)) and time.monotonic() < until_s:
            for process in left:
                with suppress(ProcessLookupError, PermissionError):
                    os.kill(process, signal.SIGKILL)

    def _start_init(self, control: int, report: int) -> "subprocess.Popen[bytes]":
        job = {
            "command": self.command,
            "folder": str(self._folder),
            "environment": dict(self._environment),
            "control": control,
            "report": report,
            "alone": False,
            "confinement": None,
            "handover": None,
            **self._init.job,
        }
        with tempfile.TemporaryFile() as job_file:
            job_file.write(json.dumps(job).encode())
            job_file.seek(0)
            python = [str(Path(sys.executable).resolve()), "-I", "-S", "-c", START.format(job_file.fileno())]
            try:
                # A session of its own, so that Ctrl-C reaches it through us only. The terminal stays readable for one
                # that nothing holds: whatever can read a terminal can write to it, too.
                return subprocess.Popen(
                    [*self._init.wrapper, *python, str(self._init.code)],
                    env=self._init.environment,
                    pass_fds=(job_file.fileno(), control, report, *self._init.handles),
                    stdin=None if self._init == NATIVE_INIT else subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
            except OSError as error:
                raise cannot_start(self.command, error.strerror or str(error)) from error

    def _check_start(self) -> None:
        """Wait for the report that the solution has started; raises BenchbotError when it has not."""
        init_runs = bool(self._next_report())
        told = self._next_report() if init_runs else {}
        if "started" in told:
            return
        status = self._process.wait()
        self._reader.join(GRACE_S)
        if not init_runs and status < 0:  # later, it might be the solution's doing
            raise BenchbotError(
                f"The solution '{' '.join(self.command)}' was not started.",
                f"What starts it was killed before. {describe_exit(status)}",
                "Run it again; if it happens again, see whether the machine runs out of memory.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )
        raise cannot_start(self.command, told.get("cannot_start") or self.last_words or "it ended before it began")

    def _next_report(self) -> dict[str, Any]:
        """Return the next report of the init process; an empty one when it ended without."""
        while b"\n" not in self._reports:
            chunk = self._report.read(4096)
            if not chunk:
                return {}
            self._reports += chunk
        line, _, self._reports = self._reports.partition(b"\n")
        document: dict[str, Any] = json.loads(line)
        return document

    def _pass_on(self, pipe: IO[bytes]) -> None:
        with pipe:
            while chunk := os.read(pipe.fileno(), 65536):
                self._last_words.add(chunk)
                self._output(chunk)


def cannot_start(command: Sequence[str], why: str) -> BenchbotError:
    """Return the error of a command that does not start."""
    return BenchbotError(
        f"The solution '{' '.join(command)}' cannot be started.",
        f"{command[0]}: {why}.",
        "Check the command: it runs in the current folder, without a shell.",
        exit_code=ExitCode.USAGE,
        failure=FailureClass.AGENT,
    )


def describe_exit(status: int) -> str:
    """Return a sentence about the exit status of a process (negative: a signal)."""
    if status >= 0:
        return f"It ended with exit status {status}."
    return f"It was ended by {signal_name(-status)}."


def python_first() -> dict[str, str]:
    """Return the PATH by which `python` is the interpreter that runs BenchBot, as examples expect."""
    return {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])}
