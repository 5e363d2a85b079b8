"""Recordings of a session while it runs, and the notes that say how complete they are."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.documents import Result
    from benchbot.core.progress import Progress, Step

NOTE = "recording.json"
NOTE_BYTES = 2048
"""A note is as long as this from the start, so that it can still be changed when the disk is full."""


class Recording(Protocol):
    """One recording in progress; what it writes goes into the folder that its recorder's `create` was given.

    A run writes its recordings in a process of their own, which is given copies of what was observed: they may be kept.
    Where a recording raises BenchbotError, it ends there; the run goes on without it.
    """

    def reset(self) -> None:
        """Start over: the session begins again in the first scene, and what was recorded is void."""

    def step(self, action: str | None, arguments: Mapping[str, float], step: "Step", progress: "Progress") -> None:
        """Take note of one observation; `action` is what led to it, None after a reset or a plain look.

        `progress.frames` is its number since the reset, from 1. Some may be missing: those before a recording joined a
        run that was under way, and those that a slow disk had no time for.
        """

    def close(self) -> None:
        """Finish the recording. Safe to call twice."""


class ShowsResults(Protocol):
    """A recording that is also told of the result that a solution hands in."""

    def result(self, document: "Result") -> None:
        """Take note of a result document, without `track` and `actions`; there may be more steps, and other results."""


class KnowsRun(Protocol):
    """A recording that is also told of the run that it is of."""

    def run(self, document: Mapping[str, Any]) -> None:
        """Take note of the run, before its first step: what solutions are told of it (GET /api/v1/session).

        Its seed is there, too, unless there is a secret: then nobody may know either before the result.
        """


class RecordingState(StrEnum):
    """The state of a recording: being written, finished, or given up because something failed."""

    RECORDING = "recording"
    FINISHED = "finished"
    ENDED_EARLY = "ended early"


@dataclass(frozen=True)
class RecordingNote:
    """The note `recording.json` in a recording's folder: how many observations are in it, and how many are not.

    `dropped` are those that were made while it was written and are not in it; `why` says what ended it early.
    """

    recorder: str
    state: RecordingState = RecordingState.RECORDING
    recorded: int = 0
    dropped: int = 0
    why: str | None = None
    version: int = 1

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Return the note of the recording in a folder; None when there is none that can be read."""
        try:
            document = json.loads((folder / NOTE).read_text("utf-8"))
            return cls(**{**document, "state": RecordingState(document["state"])})
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def write(self, folder: Path) -> None:
        """Write it, over the one before in the same place; raises OSError."""
        text = json.dumps(asdict(self), indent=1)
        if len(text) >= NOTE_BYTES and self.why is not None:
            text = json.dumps(asdict(replace(self, why=self.why[: NOTE_BYTES // 12])), indent=1)
        handle = os.open(folder / NOTE, os.O_WRONLY | os.O_CREAT, 0o666)
        try:
            os.pwrite(handle, f"{text:<{NOTE_BYTES - 1}}\n".encode(), 0)
        finally:
            os.close(handle)

    def problem(self, folder: Path) -> str | None:
        """Return in a sentence what is missing from the recording, None when nothing is."""
        if self.state is RecordingState.ENDED_EARLY:
            return f"The recording in {folder} ended early, the run did not: {self.why}"
        if self.state is RecordingState.RECORDING:
            return f"The recording in {folder} was not finished: it may lack its end."
        if self.dropped:
            total = self.recorded + self.dropped
            return f"{self.dropped} of {total} steps were not recorded in {folder}: the disk is slower than the run."
        return None


def problems(folders: Mapping[str, Path]) -> list[str]:
    """Return what is missing from recordings, by the folders that recorders wrote into, in sentences."""
    found = []
    for folder in folders.values():
        note = RecordingNote.read(folder)
        why = f"There is no whole recording in {folder}: its {NOTE} cannot be read."
        found.append(why if note is None else note.problem(folder))
    return [problem for problem in found if problem is not None]


class Noted:
    """A recording with its note: it counts what is in it, ends itself when it fails, and never raises."""

    def __init__(self, recorder: str, recording: Recording, folder: Path) -> None:
        self._recording = recording
        self._folder = folder
        self.note = RecordingNote(recorder)
        self._write()

    @property
    def ended(self) -> bool:
        """True when the recording takes nothing more."""
        return self.note.state is not RecordingState.RECORDING

    def reset(self) -> BenchbotError | None:
        """Start over; return why it has ended, if it has just now."""
        if self.ended:
            return None
        self.note = RecordingNote(self.note.recorder)
        return self._guarded(self._recording.reset)

    def step(
        self, action: str | None, arguments: Mapping[str, float], step: "Step", progress: "Progress", dropped: int
    ) -> BenchbotError | None:
        """Take note of one observation, before which `dropped` were lost in all; return why it has ended, if so."""
        self.note = replace(self.note, dropped=dropped)
        if self.ended:
            return None
        error = self._guarded(lambda: self._recording.step(action, arguments, step, progress))
        if error is None:
            self.note = replace(self.note, recorded=self.note.recorded + 1)
        return error

    def told(self, what: str, document: Mapping[str, Any]) -> BenchbotError | None:
        """Take note of the `run` or a `result`, if the recorder does; return why it has ended, if it has just now."""
        tell = getattr(self._recording, what, None)
        return None if tell is None or self.ended else self._guarded(lambda: tell(document))

    def close(self, dropped: int) -> BenchbotError | None:
        """Finish it; return what failed, if something did."""
        if self.ended:
            return None
        self.note = replace(self.note, dropped=dropped)
        error = self._guarded(self._recording.close)
        if error is None:
            self.note = replace(self.note, state=RecordingState.FINISHED)
        self._write()
        return error

    def _guarded(self, act: Any) -> BenchbotError | None:
        try:
            act()
        except BenchbotError as error:
            why = f"{error.title} {error.why}"
            self.note = replace(self.note, state=RecordingState.ENDED_EARLY, why=why)
            with suppress(BenchbotError):  # the first error is the one that says why
                self._recording.close()
            self._write()
            return error
        return None

    def _write(self) -> None:
        # The note is not essential: what a recording lacks is also in the run's log.
        with suppress(OSError):
            self.note.write(self._folder)
