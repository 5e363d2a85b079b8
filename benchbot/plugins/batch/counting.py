"""Counts of a batch's finished and failed episodes for lists of batches: current, at almost no cost at rest.

The first look asks for every result; later ones only for what the events name. Events can be lost (a full disk), and
people edit and delete results: a few results are looked at in turn each time, whatever the events say, so that a count
is never wrong for good. Results are compared by the change time that their own disk gave them, never with a clock.
"""

import os
import time
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from benchbot.plugins.batch import journal
from benchbot.plugins.batch.attempts import JOURNAL, RESULT, Attempts
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import KEY_DIGITS

PENDING, DONE = "pending", "done"
_OLDEST_VERSION = 2
"""Plans before that are of batches that cannot be watched."""


@dataclass(frozen=True)
class Count:
    """The number of a batch's episodes, of those that are finished, and of those that failed, by class of failure."""

    episodes: int
    finished: int
    failures: Mapping[str, int] = field(default_factory=dict)


class _Episode(msgspec.Struct):
    key: str
    label: str


class _Plan(msgspec.Struct):
    """The part of a plan that counting needs: checking all of it takes a hundred times as long."""

    version: int
    episodes: list[_Episode]


class BatchCounter:
    """Counts the episodes of one batch, again and again; not thread-safe."""

    def __init__(self, path: Path) -> None:
        self._folder = Folder(path)
        self._plan_stamp: tuple[int, ...] | None = None
        self._empty()

    def look(self, audit_s: float) -> Count | None:
        """Return the count of this moment; None where there is no plan that can be read.

        `audit_s` is the time for looking at results that no event has named; at least one of them is looked at.
        """
        try:
            about = self._folder.plan.stat()
            stamp = about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns
            if stamp != self._plan_stamp:
                self._plan_stamp = None
                self._read_plan()
                self._plan_stamp = stamp
        except (OSError, msgspec.DecodeError):
            return None
        if self._plan_stamp is None or not self._names:
            return None
        for place in self._told():
            self._check(place)
        self._audit(audit_s)
        finished = len(self._states) - self._counts[PENDING]
        failures = {state: n for state, n in sorted(self._counts.items()) if n and state not in (PENDING, DONE)}
        return Count(len(self._states), finished, failures)

    @property
    def states(self) -> Sequence[str]:
        """The state of each episode at the last look, in the order of the plan."""
        return self._states

    def _empty(self) -> None:
        self._names: list[str] = []
        self._keys: list[str] = []
        self._places: dict[str, int] = {}
        self._states: list[str] = []
        self._changed_ns = array("q")
        """The change time of each result; 0 where there is none."""
        self._failures: dict[str, str | None] = {}
        """The failures that events told, by key; None where events cannot say which of several attempts counts."""
        self._tails: dict[str, tuple[journal.Tail, int]] = {}
        self._counts: Counter[str] = Counter()
        self._next = 0

    def _read_plan(self) -> None:
        self._empty()
        plan = msgspec.json.decode(self._folder.plan.read_bytes(), type=_Plan)
        if plan.version < _OLDEST_VERSION:
            return
        self._names = [f"{each.label}-{each.key[:KEY_DIGITS]}" for each in plan.episodes]
        self._places = {each.key: place for place, each in enumerate(plan.episodes)}
        self._states = [PENDING] * len(self._names)
        self._changed_ns = array("q", bytes(8 * len(self._names)))
        self._counts[PENDING] = len(self._names)
        self._keys = [each.key for each in plan.episodes]
        self._told()
        for place in range(len(self._names)):
            self._check(place)

    def _told(self) -> set[int]:
        """Read new events; return the places of the episodes that they name."""
        places = set()
        for name, size in journal.sizes(self._folder.events):
            tail, seen = self._tails.get(name) or (journal.Tail(self._folder.events / name), 0)
            if size == seen:
                continue
            self._tails[name] = tail, size
            for event in tail.read():
                key = str(event.get("key"))
                if key not in self._places:
                    continue
                places.add(self._places[key])
                if event.get("what") == "finished":
                    self._failures[key] = None if key in self._failures else str(event.get("failure") or DONE)
                elif event.get("what") in ("retried", "failed"):
                    self._failures[key] = None
        return places

    def _check(self, place: int, *, hashed: bool = False) -> None:
        """Ask for one result; `hashed` reads it, too, and takes one that its receipt does not fit for none."""
        changed_ns = self._change(place)
        state = PENDING
        if changed_ns:
            told = self._failures.get(self._keys[place])
            if hashed:
                finished = Attempts(self._folder.episode(self._names[place])).finished()
                state = PENDING if finished is None else str(finished.failure or DONE)
            else:
                state = told or self._receipt(place)
        self._changed_ns[place] = changed_ns
        self._counts[self._states[place]] -= 1
        self._counts[state] += 1
        self._states[place] = state

    def _receipt(self, place: int) -> str:
        """Return the end of the attempt that was published last, as the episode's own journal has it."""
        entries = journal.read(self._folder.episode(self._names[place]) / JOURNAL)
        last: dict[str, object] = next((entry for entry in reversed(entries) if entry.get("ended") == "done"), {})
        return str(last.get("failure") or DONE)

    def _change(self, place: int) -> int:
        try:
            return os.stat(f"{self._folder.episodes}/{self._names[place]}/{RESULT}").st_ctime_ns  # noqa: PTH116 - quicker
        except OSError:
            return 0

    def _audit(self, audit_s: float) -> None:
        end_s = time.monotonic() + audit_s
        for _ in self._names:
            place, self._next = self._next, (self._next + 1) % len(self._names)
            if self._change(place) != self._changed_ns[place]:
                with suppress(OSError):
                    self._check(place, hashed=True)
            if time.monotonic() >= end_s:
                return
