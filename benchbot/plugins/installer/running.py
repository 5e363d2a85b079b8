"""Programs that do the work, such as pip, uv and git: run quietly, ended with us, what they said kept."""

import os
import shutil
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import public


@dataclass(frozen=True)
class Done:
    """How a program ended: its exit status (negative: a signal; None: it took too long) and what it said."""

    code: int | None
    out: str
    err: str


@dataclass(frozen=True)
class Runner:
    """Starts programs in sessions of their own: Ctrl-C reaches them through us alone, and none asks at the terminal.

    `lock` is inherited by them: should this process be killed, the lock is held until they have ended, too.
    """

    lock: int | None = None

    def run(
        self,
        words: Sequence[str],
        variables: Mapping[str, str] | None = None,
        *,
        folder: Path | None = None,
        timeout_s: float | None = None,
        lifeline: int = subprocess.DEVNULL,
    ) -> Done:
        """Run a program to its end; one that is interrupted or takes too long is killed with what it has started.

        `lifeline` is its stdin, which ends when this process does.
        """
        try:
            process = subprocess.Popen(
                words,
                stdin=lifeline,
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
            except subprocess.TimeoutExpired:
                _kill(process)
                return Done(None, "", "")
            except BaseException:
                _kill(process)
                raise
        return Done(process.returncode, public(out), public(err))


def _kill(process: "subprocess.Popen[str]") -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def program(name: str, needed_for: str, fix: str) -> str:
    """Return the path of a program; raises BenchbotError when it is not installed."""
    found = shutil.which(name)
    if found is None:
        raise BenchbotError(f"{name} is not installed.", f"It is needed to {needed_for}.", fix)
    return found
