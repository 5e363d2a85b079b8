"""A solution as a child process: started in a group of its own, its output passed on, and always ended."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

GRACE_S = 2.0
TAIL_BYTES = 4000
TAIL_LINES = 5


class Solution:
    """The running process of a solution.

    Its output goes to `output`, chunk by chunk and untouched. Leaving the context ends whatever is left of its process
    group: asked by SIGTERM, then killed.
    """

    def __init__(
        self, command: Sequence[str], folder: Path, variables: Mapping[str, str], output: Callable[[bytes], object]
    ) -> None:
        self.command = list(command)
        self._folder = folder
        self._variables = variables
        self._output = output
        self._tail = b""

    def __enter__(self) -> Self:
        try:
            # A session of its own, so that Ctrl-C reaches it through us only. The terminal stays readable for it.
            self._process = subprocess.Popen(
                self.command,
                cwd=self._folder,
                env={**_environment(), "PYTHONUNBUFFERED": "1", **self._variables},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            raise cannot_start(self.command, error.strerror or str(error)) from error
        self._reader = threading.Thread(target=self._pass_on, args=(self._process.stdout,), daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    @property
    def process(self) -> int:
        """The number of the process, and of its group."""
        return self._process.pid

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""
        with suppress(subprocess.TimeoutExpired):
            return self._process.wait(timeout_s)
        return None

    def end(self) -> None:
        """End the process and everything that it has started in its group."""
        if self._process.poll() is None:
            self._signal(signal.SIGTERM)
            self.wait(GRACE_S)
        self._signal(signal.SIGKILL)
        self._process.wait()
        self._reader.join(GRACE_S)

    @property
    def last_words(self) -> str:
        """The last lines of its output."""
        lines = [line.strip() for line in self._tail.decode("utf-8", "replace").splitlines()]
        return "\n".join([line for line in lines if line][-TAIL_LINES:])

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, number)

    def _pass_on(self, pipe: IO[bytes]) -> None:
        with pipe:
            while chunk := os.read(pipe.fileno(), 65536):
                self._tail = (self._tail + chunk)[-TAIL_BYTES:]
                self._output(chunk)


def _environment() -> dict[str, str]:
    """Return this process's environment without the folders of add-ons: ground truths are in them."""
    return {name: value for name, value in os.environ.items() if name != "BENCHBOT_ADDONS"}


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
    """Return how a process ended, in words."""
    if status >= 0:
        return f"It ended with exit status {status}."
    return f"It was ended by {signal.Signals(-status).name}."


def python_first() -> dict[str, str]:
    """Return the variable that lets `python` be the interpreter that runs BenchBot, as examples expect."""
    return {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])}
