"""What a worker sees to while a solution runs: its output, that it gets on, and that it is still wanted."""

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.plugins.batch.attempts import PROCESS
from benchbot.plugins.batch.memory import MemoryWatch
from benchbot.plugins.batch.processes import ProcessId


class NotWantedError(Exception):
    """The worker is to end, or another one has taken its episode: what runs is to be ended, without a verdict."""


class AttemptWatcher:
    """Keeps a solution's output in a folder, and ends a solution that makes no progress for `stall_s` (0: never)."""

    def __init__(self, folder: Path, stall_s: float, is_wanted: Callable[[], bool], memory: MemoryWatch) -> None:
        self._folder = folder
        self._stall_s = stall_s
        self._is_wanted = is_wanted
        self._memory = memory
        self._progress: object = None
        self._moved_s = time.monotonic()

    def __enter__(self) -> Self:
        self._log = (self._folder / "log.txt").open("ab", buffering=0)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._log.close()

    def write(self, chunk: bytes) -> None:
        """Keep what the solution prints. On a full disk it is lost: the solution must not wait for room."""
        with suppress(OSError, ValueError):
            self._log.write(chunk)

    def started(self, process: int) -> None:
        """Note which process is the solution's: should this worker die, somebody else ends it."""
        with suppress(OSError):
            (self._folder / PROCESS).write_text(json.dumps(ProcessId.of(process).as_dict()), "utf-8")

    def look(self, progress: Mapping[str, Any], _scene_count: int) -> BenchbotError | None:
        """Return a reason to end a solution that is stuck; raises NotWantedError when nobody wants its result."""
        if not self._is_wanted():
            raise NotWantedError
        self._memory.sample()
        seen = (progress["state"], progress["frames"], progress["steps"], progress["waiting_for"])
        if seen != self._progress or progress["paused"]:
            self._progress, self._moved_s = seen, time.monotonic()
            return None
        if not self._stall_s or time.monotonic() - self._moved_s < self._stall_s:
            return None
        return BenchbotError(
            "The solution is stuck.",
            f"It took no step and made no observation for {self._stall_s:g} seconds, and was ended.",
            "Look into its log, or give it more time: --stall-after SECONDS (0: for ever).",
            failure=FailureClass.TIMEOUT,
        )
