"""The batches of this user: what is registered, and how far each is; what does not change is read once."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from benchbot.core import atomic, resources
from benchbot.plugins.batch import journal
from benchbot.plugins.batch.counting import BatchCounter, Count
from benchbot.plugins.batch.driver_lock import RegisteredBatch, registered_batches
from benchbot.plugins.batch.status import Score
from benchbot.plugins.watching.views import BatchEntry

AUDIT_S = 0.002
"""The time of each look for results that changed although no event has told of it, all batches together."""


class BatchList:
    """The batches of this user, looked at again and again: what does not change is read once. Not thread-safe."""

    def __init__(self, *, remembers: bool = False) -> None:
        self._remembers = remembers
        self._counters: dict[Path, BatchCounter] = {}
        self._counted: dict[str, _Counted] | None = None
        self._scores: dict[Path, tuple[tuple[int, int], Score | None]] = {}

    def look(self) -> list[BatchEntry]:
        """Return the batches whose folders still exist, the one that was driven last first.

        If it `remembers`, the first look tells what the last list of this user counted, of batches of which no event
        has come since: to ask for all results of many long batches takes seconds. Every later look counts.
        """
        entries = registered_batches()
        stamps = {entry.folder: _stamp(entry.folder) for entry in entries}
        if self._counted is None:
            self._counted = _remembered() if self._remembers else {}
            known = {folder: self._counted.get(str(folder)) for folder in stamps}
            if entries and all(each is not None and each.stamp == stamps[folder] for folder, each in known.items()):
                return [
                    self._entry(entry, each.count) for entry in entries if (each := known[entry.folder]) is not None
                ]
        self._counters = {each.folder: self._counters.get(each.folder) or BatchCounter(each.folder) for each in entries}
        audit_s = AUDIT_S / max(len(entries), 1)
        counts = [(entry, self._counters[entry.folder].look(audit_s)) for entry in entries]
        found = {
            str(entry.folder): _Counted(stamps[entry.folder], count) for entry, count in counts if count is not None
        }
        if found != self._counted:
            self._counted = found
            with suppress(OSError):  # the next list counts again
                atomic.write(_counts_path(), msgspec.json.encode(found))
        return [self._entry(entry, count) for entry, count in counts if count is not None]

    def _entry(self, entry: RegisteredBatch, count: Count) -> BatchEntry:
        score = self._score(entry.folder) if count.finished == count.episodes else None
        return BatchEntry(
            entry.folder, entry.is_driven, entry.begun_s, count.episodes, count.finished, count.failures, score
        )

    def _score(self, folder: Path) -> Score | None:
        """Return the main score of a batch's scores document, read when that changes, without its rows."""
        path = folder / "scores.json"
        try:
            about = path.stat()
            version = about.st_mtime_ns, about.st_size
            known = self._scores.get(folder)
            if known is None or known[0] != version:
                document = msgspec.json.decode(path.read_bytes(), type=_Headline)
                name = document.method["headline"]
                value = document.scores.get(name)
                score = None if value is None else Score(name, value, 0)
                known = self._scores[folder] = version, score
        except (OSError, KeyError, TypeError, msgspec.DecodeError):
            return None
        return known[1]


def batches() -> list[BatchEntry]:
    """Return the batches of this user whose folders still exist, the one that was driven last first."""
    return BatchList().look()


class _Counted(msgspec.Struct):
    """What was counted of a batch, and what its plan and events looked like then."""

    stamp: list[str]
    count: Count


def _stamp(folder: Path) -> list[str]:
    """Return what changes whenever a plan is written anew, or an event comes."""
    plan = plan_stamp(folder)
    return [plan, *(f"{name} {size}" for name, size in journal.sizes(folder / "events"))] if plan else []


def plan_stamp(folder: Path) -> str:
    """Return what changes whenever a plan is written anew; empty where there is none."""
    with suppress(OSError):
        about = (folder / "plan.json").stat()
        return f"{about.st_ino} {about.st_size} {about.st_mtime_ns}"
    return ""


def _counts_path() -> Path:
    return resources.state_dir() / "batch-counts.json"


def _remembered() -> dict[str, _Counted]:
    try:
        return msgspec.json.decode(_counts_path().read_bytes(), type=dict[str, _Counted])
    except (OSError, msgspec.DecodeError):
        return {}


class _Headline(msgspec.Struct):
    """What the list of batches needs of a scores document."""

    method: dict[str, Any]
    scores: dict[str, float | None]
