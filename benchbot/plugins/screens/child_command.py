"""A command of BenchBot in a child process: what it says meanwhile, what it prints at its end, and ending it."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

from benchbot.core.errors import BenchbotError, ExitCode

COLUMNS = "10000"
"""The width for which the child writes: its lines are folded by the screen that shows them."""
KEPT_LINES = 400


@dataclass(frozen=True)
class Outcome:
    """The end of a command: its exit code, what it printed on stdout, and the last lines that it said on stderr."""

    code: int
    output: str
    said: tuple[str, ...]

    @property
    def document(self) -> Any:
        """The JSON document on stdout; raises BenchbotError where there is none."""
        try:
            return json.loads(self.output)
        except ValueError as error:
            raise BenchbotError(
                "The command printed no document.", " ".join(self.output.split())[:200] or "Nothing.", "Run it by hand."
            ) from error

    def error(self) -> BenchbotError:
        """Return the error that it ended with, in its own words."""
        return error_in(self.said, self.code)


class ChildCommand:
    """A command that is running; `tell` is called, in another thread, with each line that it says on stderr.

    It has no terminal: nothing that it prints reaches the screens, and it asks no questions.
    """

    def __init__(self, words: Sequence[str], tell: Callable[[str], object], folder: Path | None = None) -> None:
        self.words = tuple(words)
        self._tell = tell
        self._said: list[str] = []
        self.is_cancelled = False
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "benchbot", *words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                cwd=folder,
                env={**os.environ, "NO_COLOR": "1", "COLUMNS": COLUMNS},
                start_new_session=True,
            )
        except OSError as error:
            raise BenchbotError(
                "The command cannot be started.",
                f"{error.filename or 'It'}: {error.strerror or error}.",
                f"Free some memory, or type it yourself: {as_typed(words)}",
                exit_code=ExitCode.INTERNAL,
            ) from error

    def wait(self, allowed: Collection[int] = (0,)) -> Outcome:
        """Return how it ended; raises BenchbotError, in its words, when its exit code is not one of the allowed."""
        out, err = self._process.stdout, self._process.stderr
        reader = Thread(target=self._listen, args=(err,), daemon=True, name="benchbot-command")
        reader.start()
        output = b"" if out is None else out.read()
        code = self._process.wait()
        reader.join()
        outcome = Outcome(code, output.decode("utf-8", "replace"), tuple(self._said))
        if code not in allowed:
            raise outcome.error()
        return outcome

    def cancel(self) -> None:
        """End it as Ctrl-C in its terminal would: it undoes what it has begun."""
        self.is_cancelled = True
        with suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGINT)

    def _listen(self, lines: Iterable[bytes]) -> None:
        for raw in lines:
            line = raw.decode("utf-8", "replace").rstrip()
            self._said.append(line)
            del self._said[:-KEPT_LINES]
            if line.strip():
                self._tell(line)


def as_typed(words: Sequence[str]) -> str:
    """Return a command as it can be typed into a shell."""
    return shlex.join(["benchbot", *words])


def error_in(said: Sequence[str], code: int) -> BenchbotError:
    """Return the last error that a command printed on stderr (see `console.error`), else what it said last."""
    at = next((place for place in reversed(range(len(said))) if said[place].startswith("Error: ")), None)
    if at is None:
        last = next((line for line in reversed(said) if line.strip()), "It said nothing.")
        if code == ExitCode.INTERRUPTED:
            return BenchbotError("It was ended.", last, "Start it again.", exit_code=ExitCode.INTERRUPTED)
        return BenchbotError(f"The command ended with exit status {code}.", last, "Run it by hand.")
    why: list[str] = []
    fix: list[str] = []
    for line in said[at + 1 :]:
        told = re.match(r" {2}Fix: (.*)", line)
        if told is not None:
            fix.append(told[1])
        elif fix and line.startswith(" " * 7):
            fix.append(line[7:])
        elif not fix and line.strip():
            why.append(line.removeprefix("  | ").removeprefix("  "))
    return BenchbotError(said[at].removeprefix("Error: "), "\n".join(why), "\n".join(fix), exit_code=ExitCode.USAGE)
