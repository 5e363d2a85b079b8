"""Child processes that do the work, such as pip, uv and git: run quietly, killed with this one, their output kept."""

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import without_credentials


@dataclass(frozen=True)
class ProcessResult:
    """Exit status (negative: a signal; None: it took too long) and output of a program, without credentials."""

    code: int | None
    out: str
    err: str


@dataclass(frozen=True)
class Runner:
    """Runs programs in sessions of their own: Ctrl-C does not reach them directly, and they cannot ask at the terminal.

    They inherit the file descriptor `lock`: if this process is killed, the lock is held until they have ended, too.
    """

    lock: int | None = None

    def run(
        self,
        words: Sequence[str],
        variables: Mapping[str, str] | None = None,
        *,
        folder: Path | None = None,
        timeout_s: float | None = None,
        stdin: int = subprocess.DEVNULL,
    ) -> ProcessResult:
        """Run a program to its end; one that is interrupted or takes too long is killed with its child processes.

        `variables` are added to the environment variables of this process.
        """
        try:
            process = subprocess.Popen(
                words,
                stdin=stdin,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                cwd=folder,
                env={**os.environ, **(variables or {})},
                pass_fds=() if self.lock is None else (self.lock,),
                start_new_session=True,
            )
        except OSError as error:
            raise BenchbotError(
                f"{words[0]} cannot be started.", f"{error.strerror or error}.", f"Install it, or mend it: {words[0]}"
            ) from error
        with process:
            try:
                out, err = process.communicate(timeout=timeout_s)
            except BaseException as error:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                if isinstance(error, subprocess.TimeoutExpired):
                    return ProcessResult(None, "", "")
                raise
        return ProcessResult(process.returncode, without_credentials(out), without_credentials(err))
