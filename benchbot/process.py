"""How a child process ended and what it said last, in words."""

import os
import signal
from typing import IO

QUOTED_LINES = 15
QUOTED_BYTES = 3000


def how_it_ended(code: int) -> str:
    """Return what an exit code of `subprocess` says, as the end of a sentence."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:  # most real-time signals have no name
        name = f"signal {-code}"
    if -code == signal.SIGKILL:
        return f"was ended by {name} (somebody killed it, or the machine ran out of memory)"
    return f"was ended by {name}"


def last_words(log: IO[bytes], start: int = 0) -> str:
    """Return the last lines of a log, from byte `start` on, as sentences that follow a description of its end."""
    size = log.seek(0, os.SEEK_END)
    log.seek(max(start, size - QUOTED_BYTES))
    lines = log.read().decode("utf-8", "replace").strip().splitlines()
    return "\n".join(["Its last words:", *lines[-QUOTED_LINES:]]) if lines else "It left no last words."
