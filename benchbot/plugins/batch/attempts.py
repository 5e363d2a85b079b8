"""The attempts at one episode: each in a folder of its own, noted in a journal, and one of them published.

Nothing is ever deleted: what failed stays in `attempt-N`. A result is published by renaming it, last of all, into the
episode's folder; its hash is in the journal before, so that another worker can finish the publication after a crash.
"""

import json
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.plugins.batch import journal
from benchbot.plugins.batch.machine import MemoryWatch, ProcessId
from benchbot.plugins.batch.plan import Policy
from benchbot.submission.output import CappedLog

RESULT, JOURNAL, PROCESS = "result.json", "attempts.jsonl", "process.json"
LOST_LIMIT = 20
"""How often an episode's worker may vanish before the episode is taken for the reason."""
RETRIED = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)


@dataclass(frozen=True)
class Finished:
    """A finished episode: its failure, if it failed, its worker, the last attempt's duration and end, its SHA-256."""

    failure: FailureClass | None
    duration_s: float
    worker: str
    ended_s: float
    sha256: str
    error: str = ""
    """What went wrong, in one line."""
    attempts: int = 1
    restarts: int | None = None
    """How often the solution began anew within its last attempt; None where the receipt does not tell."""


@dataclass(frozen=True)
class Attempt:
    """One attempt, in its folder; its number counts from 1, its beginning by the monotonic clock."""

    folder: Path
    number: int
    worker: str
    began_s: float

    @property
    def duration_s(self) -> float:
        """The seconds since its beginning."""
        return round(time.monotonic() - self.began_s, 3)


class Attempts:
    """The folder of one episode. Only the holder of the episode's claim may change anything in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def result(self) -> Path:
        """The published result."""
        return self.folder / RESULT

    def entries(self) -> list[dict[str, Any]]:
        """Return the journal."""
        return journal.read(self.folder / JOURNAL)

    def finished(self) -> Finished | None:
        """Return the record of the published result; None when there is none, or the file is another one."""
        if not self.result.is_file():
            return None
        receipt = next((entry for entry in reversed(self.entries()) if entry.get("ended") == "done"), None)
        if receipt is None or _digest(self.result) != receipt.get("sha256"):
            return None
        failure = receipt.get("failure")
        return Finished(
            None if failure is None else FailureClass(failure),
            float(receipt["duration_s"]),
            str(receipt["worker"]),
            float(receipt["time_s"]),
            str(receipt["sha256"]),
            str(receipt.get("error", "")),
            int(receipt.get("attempt", 1)),
            receipt.get("restarts"),
        )

    def begin(self, worker: str) -> Attempt:
        """Make the folder of the next attempt, and note that it begins; raises OSError."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._sweep()
        folder = self._new_folder()
        attempt = Attempt(folder, _number(folder), worker, time.monotonic())
        self.note(attempt, began=True)
        return attempt

    def recover(self) -> bool:
        """Finish a publication that was cut short by a worker's death; say whether there is a good result now."""
        if self.finished() is not None:
            return True
        entries = self.entries()
        if not entries or entries[-1].get("ended") != "done":
            return False
        receipt = entries[-1]
        folder = self.folder / f"attempt-{receipt['attempt']}"
        if not (folder / RESULT).is_file() or _digest(folder / RESULT) != receipt.get("sha256"):
            return False
        self._publish(folder)
        return True

    def failures(self) -> list[FailureClass]:
        """Return the failures of attempts since the episode was last begun anew."""
        return [FailureClass(entry["failure"]) for entry in self._recent() if entry.get("ended") == "failed"]

    def lost(self) -> int:
        """Return how many attempts vanished with their worker. Only the holder of the claim can tell."""
        recent = list(self._recent())
        began = {entry["attempt"] for entry in recent if entry.get("began")}
        return len(began - {entry["attempt"] for entry in recent if "ended" in entry})

    def begin_anew(self) -> None:
        """Set the result aside, if there is one, and forget how often the episode has failed."""
        self._sweep()
        journal.append(self.folder / JOURNAL, {"anew": True, "time_s": time.time()}, sync=True)

    def note(self, attempt: Attempt, *, sync: bool = False, **said: Any) -> None:
        """Add an entry to the journal; raises OSError."""
        entry = {"attempt": attempt.number, "worker": attempt.worker, "time_s": round(time.time(), 3), **said}
        journal.append(self.folder / JOURNAL, entry, sync=sync)

    def publish(self, attempt: Attempt, failure: FailureClass | None, **said: Any) -> None:
        """Make an attempt's result that of the episode; raises OSError, and may be called again then.

        What is `said` beside goes into its receipt.
        """
        receipt = {"failure": failure, "duration_s": attempt.duration_s, "sha256": _digest(attempt.folder / RESULT)}
        receipt |= said
        self.note(attempt, ended="done", **receipt, sync=True)
        self._publish(attempt.folder)

    def fail(self, attempt: Attempt, failure: FailureClass, **said: Any) -> None:
        """Note that an attempt failed, and may be made again, with what is `said` beside."""
        self.note(attempt, ended="failed", failure=failure, duration_s=attempt.duration_s, **said)

    def end_orphan(self) -> None:
        """End the solution that a dead worker has left running on this machine."""
        for path in self.folder.glob(f"attempt-*/{PROCESS}"):
            with suppress(OSError, ValueError, TypeError, KeyError):
                ProcessId.from_dict(json.loads(path.read_text("utf-8"))).signal_group(signal.SIGKILL)

    def _publish(self, folder: Path) -> None:
        for path in sorted(folder.iterdir()):
            if path.name not in (RESULT, PROCESS):
                path.replace(self.folder / path.name)
        (folder / RESULT).replace(self.result)
        (folder / PROCESS).unlink(missing_ok=True)
        with suppress(OSError):
            folder.rmdir()

    def _sweep(self) -> None:
        """Move the remains of a torn publication, a broken result or a void one into an attempt's own folder."""
        kept = [path for path in self.folder.iterdir() if path.name != JOURNAL and not path.name.startswith("attempt-")]
        if kept:
            folder = self._new_folder()
            for path in kept:
                path.replace(folder / path.name)

    def _new_folder(self) -> Path:
        noted = [entry.get("attempt", 0) for entry in self.entries()]
        number = 1 + max([0, *noted, *(_number(path) for path in self.folder.glob("attempt-*"))])
        while True:
            folder = self.folder / f"attempt-{number}"
            try:
                folder.mkdir()
            except FileExistsError:
                number += 1
            else:
                return folder

    def _recent(self) -> Iterator[dict[str, Any]]:
        entries = self.entries()
        anew = max((place for place, entry in enumerate(entries) if entry.get("anew")), default=-1)
        yield from entries[anew + 1 :]


class NotWantedError(Exception):
    """The worker is to end, or another one has taken its episode: the solution is ended, without a verdict."""


class AttemptWatcher:
    """Keeps a solution's output in a folder, and ends a solution that makes no progress for too long.

    It is the `Watcher` of a submission, and measures the worker's memory meanwhile.
    """

    def __init__(self, folder: Path, policy: Policy, is_wanted: Callable[[], bool], memory: MemoryWatch) -> None:
        self._folder = folder
        self._stall_s = policy.stall_s
        self._log_limit_bytes = policy.log_limit_bytes
        self._is_wanted = is_wanted
        self._memory = memory
        self._progress: object = None
        self._moved_s = time.monotonic()

    def __enter__(self) -> Self:
        self._log = CappedLog(self._folder / "log.txt", self._log_limit_bytes)
        return self

    def __exit__(self, *_: object) -> None:
        self._log.__exit__()

    def write(self, chunk: bytes) -> None:
        """Keep the solution's output, up to the log's limit."""
        self._log.write(chunk)

    def started(self, process: int) -> None:
        """Note the solution's process: should this worker die, another one ends it."""
        with suppress(OSError):
            (self._folder / PROCESS).write_text(json.dumps(ProcessId.of(process).as_dict()), "utf-8")

    def look(self, progress: Mapping[str, Any], _scene_count: int) -> BenchbotError | None:
        """Return a reason to end a solution that is stuck; raises NotWantedError when its result is not wanted."""
        if not self._is_wanted():
            raise NotWantedError
        self._memory.sample()
        seen = (progress["state"], progress["frames"], progress["steps"], progress["waiting_for"])
        if seen != self._progress or progress["paused"] or progress.get("preparing"):
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


def _number(folder: Path) -> int:
    text = folder.name.removeprefix("attempt-")
    return int(text) if text.isdigit() else 0


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
