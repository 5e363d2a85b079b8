"""The attempts at one episode: each in a folder of its own, noted in a journal, and one of them published.

Nothing is ever deleted: what failed stays in `attempt-N`. A result is published by renaming it, last of all, into the
episode's folder; its hash is in the journal before, so that whoever comes after a crash can finish the publication.
"""

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchbot.core.errors import FailureClass
from benchbot.plugins.batch import journal

RESULT, JOURNAL, PROCESS = "result.json", "attempts.jsonl", "process.json"
LOST_LIMIT = 20
"""How often an episode's worker may vanish before the episode itself is under suspicion."""
RETRIED = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)


@dataclass(frozen=True)
class Finished:
    """What is known of a finished episode: how it failed, if it did, and how many seconds its last attempt took."""

    failure: FailureClass | None
    duration_s: float
    worker: str
    ended_s: float


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
        """Return what is known of the result, or None when there is none, or none that is what was published."""
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
        )

    def begin(self, worker: str) -> "Attempt":
        """Make the folder of the next attempt, and note that it begins; raises OSError."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._sweep()
        attempt = Attempt(self, self._new_folder(), worker)
        self.note(attempt, began=True)
        return attempt

    def recover(self) -> bool:
        """Finish what a worker that died had nearly published; say whether there is a good result now."""
        if self.finished() is not None:
            return True
        receipt = next(iter(reversed(self.entries())), None)
        if receipt is None or receipt.get("ended") != "done":
            return False
        folder = self.folder / f"attempt-{receipt['attempt']}"
        if not (folder / RESULT).is_file() or _digest(folder / RESULT) != receipt.get("sha256"):
            return False
        self._publish(folder)
        return True

    def failures(self) -> list[FailureClass]:
        """Return the classes of the attempts that failed since the episode was last begun anew."""
        return [FailureClass(entry["failure"]) for entry in self._recent() if entry.get("ended") == "failed"]

    def lost(self) -> int:
        """Return how many attempts vanished with their worker. Call it while nobody else works here."""
        recent = list(self._recent())
        began = {entry["attempt"] for entry in recent if entry.get("began")}
        return len(began - {entry["attempt"] for entry in recent if "ended" in entry})

    def begin_anew(self) -> None:
        """Set the result aside, if there is one, and forget how often the episode has failed."""
        self._sweep()
        journal.append(self.folder / JOURNAL, {"anew": True, "time_s": time.time()}, sync=True)

    def note(self, attempt: "Attempt", *, sync: bool = False, **said: Any) -> None:
        """Add an entry to the journal; raises OSError."""
        entry = {"attempt": attempt.number, "worker": attempt.worker, "time_s": round(time.time(), 3), **said}
        journal.append(self.folder / JOURNAL, entry, sync=sync)

    def publish(self, attempt: "Attempt", failure: FailureClass | None) -> None:
        """Make an attempt's result that of the episode; raises OSError, and may be called again then."""
        self.note(
            attempt,
            ended="done",
            failure=failure,
            duration_s=round(time.monotonic() - attempt.began_s, 3),
            sha256=_digest(attempt.folder / RESULT),
            sync=True,
        )
        self._publish(attempt.folder)

    def fail(self, attempt: "Attempt", failure: FailureClass) -> None:
        """Note that an attempt failed, and may be made again."""
        duration_s = round(time.monotonic() - attempt.began_s, 3)
        self.note(attempt, ended="failed", failure=failure, duration_s=duration_s)

    def _publish(self, folder: Path) -> None:
        for path in sorted(folder.iterdir()):
            if path.name not in (RESULT, PROCESS):
                path.replace(self.folder / path.name)
        (folder / RESULT).replace(self.result)
        (folder / PROCESS).unlink(missing_ok=True)
        with suppress(OSError):
            folder.rmdir()

    def _sweep(self) -> None:
        """Move what a torn publication, a broken result or one that is void has left into an attempt's own folder."""
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


class Attempt:
    """One attempt, in its folder."""

    def __init__(self, attempts: Attempts, folder: Path, worker: str) -> None:
        self.attempts = attempts
        self.folder = folder
        self.worker = worker
        self.began_s = time.monotonic()

    @property
    def number(self) -> int:
        """Its place among the attempts at the episode, from 1."""
        return _number(self.folder)


def _number(folder: Path) -> int:
    text = folder.name.removeprefix("attempt-")
    return int(text) if text.isdigit() else 0


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
