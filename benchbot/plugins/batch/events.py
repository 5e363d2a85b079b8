"""The log of events of one worker or driver: what happened when, line by line, and safe from kill -9."""

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import journal


class EventLog:
    """Appends to `events/NAME.jsonl`: `{"time_s": seconds since the epoch, "who": NAME, "what": …, …}`.

    Nothing depends on it: on a full disk, events are lost and the work goes on.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self._path = folder / f"{name}.jsonl"
        self._name = name

    def tell(self, what: str, **said: Any) -> None:
        """Add an event."""
        entry = {"time_s": round(time.time(), 3), "who": self._name, "what": what, **said}
        with suppress(OSError):
            journal.append(self._path, entry)


def check_writable(folder: Path) -> None:
    """Raise BenchbotError when nothing can be written to a folder that a batch needs; makes it if it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
    except OSError as error:
        raise BenchbotError(
            f"The batch cannot use the folder {folder}.",
            f"{error.strerror}.",
            "Name one that you may write to, and that all workers can reach: --output-location FOLDER",
        ) from error
