"""Commands in a child process: a driver, a library or a program may crash or hang the process that uses it."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

PATIENCE_S = 20.0
"""How long a command may take on a machine that is busy with other things; milliseconds are usual."""


@dataclass(frozen=True)
class Answer:
    """The stdout of a child process, and why it failed; `problem` is empty when it did not."""

    output: str
    problem: str = ""


def ask(command: Sequence[str], variables: Mapping[str, str] | None = None, timeout_s: float = PATIENCE_S) -> Answer:
    """Run a command to its end, or kill it when it takes too long."""
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
            env={**os.environ, **(variables or {})},
        )
    except subprocess.TimeoutExpired:
        return Answer("", f"no answer within {timeout_s:g} s")
    except OSError as error:
        return Answer("", error.strerror or str(error))
    if done.returncode == 0:
        return Answer(done.stdout)
    last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
    ended = f"signal {-done.returncode}" if done.returncode < 0 else f"exit code {done.returncode}"
    return Answer(done.stdout, last[0] if last else ended)


def ask_python(code: str, *words: str, bare: bool = False, timeout_s: float = PATIENCE_S) -> Answer:
    """Run Python code in a child; a `bare` one has the standard library alone, and starts in no time."""
    options = ["-I", "-S"] if bare else ["-P"]
    return ask([sys.executable, *options, "-c", code, *words], timeout_s=timeout_s)
