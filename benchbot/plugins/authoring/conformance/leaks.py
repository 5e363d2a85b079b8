"""Nothing is left of a platform that was closed: no process, no thread, no open file."""

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchbot.plugins.authoring.conformance.properties import Wrong, unchecked

ROUNDS = 3


@dataclass(frozen=True)
class Holdings:
    """What this process has open."""

    processes: int
    threads: int
    files: int

    @classmethod
    def now(cls) -> "Holdings":
        """Count, on a system with /proc."""
        children = Path(f"/proc/{os.getpid()}/task").glob("*/children")
        return cls(
            sum(len(path.read_text("utf-8").split()) for path in children),
            threading.active_count(),
            len(list(Path("/proc/self/fd").iterdir())),
        )


def leaves_nothing(use: Callable[[], None]) -> str:
    """Use something again and again; what stays open may not grow. The first time may fill caches."""
    if not Path("/proc/self/fd").is_dir():
        raise unchecked("this system does not tell what is open.", "Check it on Linux.")
    use()
    before = Holdings.now()
    for _ in range(ROUNDS):
        use()
    after = Holdings.now()
    grown = [
        f"{getattr(after, what) - getattr(before, what)} {what}"
        for what in ("processes", "threads", "files")
        # All rounds leak alike; one more or less may be somebody else's.
        if getattr(after, what) - getattr(before, what) >= ROUNDS
    ]
    if grown:
        raise Wrong(f"{ROUNDS} rounds left {' and '.join(grown)} open.", "End and close in close() what was started.")
    return f"no process, thread or file after {ROUNDS} rounds"
