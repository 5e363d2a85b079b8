"""The live status of a run: one line at the bottom of a terminal, or a plain line now and then elsewhere."""

import math
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

PLAIN_PERIOD_S = 2.0
REMINDER_PERIOD_S = 15.0


def progress_text(progress: Mapping[str, Any], scene_count: int) -> str:
    """Return one line that says where an episode stands; `progress` is as the supervisor tells it (docs/wire.md)."""
    if progress["waiting_for"]:
        return f"WAITING FOR YOU: {_one_line(progress['waiting_for'])} When it is done, type elsewhere: benchbot ready"
    if progress["ends_run"]:
        return f"STOPPED FOR SAFETY, the run is over: {_one_line(progress['failure_why'])}"
    if not progress["frames"]:
        return "nothing observed yet"
    steps = f"step {progress['steps']}"
    if progress["trajectory_index"]:
        steps += f" · pose {progress['trajectory_index']}/{progress['trajectory_length']}"
    wall_s = progress["wall_time_s"]
    frames_per_s = progress["frames"] / wall_s if wall_s > 0 else 0.0
    parts = [
        progress["state"],
        f"scene {progress['scene_number'] + 1}/{scene_count}",
        steps,
        *_place(progress["pose_xyyaw"]),
        f"{progress['simulated_time_s']:.1f} s simulated",
        f"{wall_s:.1f} s",
        f"{frames_per_s:.1f} frames/s",
    ]
    if progress["failure"]:
        parts.append(f"failure: {progress['failure']}")
    return " · ".join(parts)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _place(pose_xyyaw: Sequence[float] | None) -> Iterator[str]:
    if pose_xyyaw is not None:  # a task with noisy localisation hides it
        x, y, yaw_rad = pose_xyyaw
        yield f"at ({x:.2f}, {y:.2f}) m {math.degrees(yaw_rad):.0f}°"


class StatusLine:
    """A status that is rewritten in place on a terminal, below whatever else is printed through `write`.

    Elsewhere it is a plain line, at most every two seconds and only when there is news.
    """

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._lock = threading.Lock()
        self._text = ""
        self._news: object = None
        self._at_line_start = True
        self._printed_s = -math.inf

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._erase()
            self._text = ""

    def started(self, process: int) -> None:
        """Learn the number of a solution's process: nobody needs it here."""

    def look(self, progress: Mapping[str, Any], scene_count: int) -> None:
        """Show where an episode stands; it is for the solution to end it."""
        self.show_progress(progress, scene_count)

    def show_progress(self, progress: Mapping[str, Any], scene_count: int) -> None:
        """Show where an episode stands; what a person must know or do is urgent."""
        urgent = bool(progress["waiting_for"] or progress["ends_run"])
        news: tuple[Any, ...] = (progress["waiting_for"], progress["ends_run"])
        if not urgent:
            news = (progress["state"], progress["frames"])
        self.show(progress_text(progress, scene_count), news, urgent=urgent)

    def show(self, text: str, news: object, *, urgent: bool = False) -> None:
        """Show `text` as the status from now on; `news` is what makes it worth another plain line when it changes.

        Urgent news is a line of its own at once, on a terminal too, and elsewhere again and again.
        """
        with self._lock:
            changed, age_s = news != self._news, time.monotonic() - self._printed_s
            if self._terminal:
                self._erase()
                if urgent and changed:
                    self._print(text)
                self._news, self._text = news, text
                self._draw()
            elif (changed and (urgent or age_s >= PLAIN_PERIOD_S)) or (urgent and age_s >= REMINDER_PERIOD_S):
                self._news = news
                self._print(text)

    def write(self, chunk: bytes) -> None:
        """Print what somebody else wrote, untouched, above the status."""
        with self._lock:
            self._erase()
            self._put(chunk)
            self._at_line_start = chunk.endswith((b"\n", b"\r"))
            self._draw()

    def _print(self, text: str) -> None:
        self._printed_s = time.monotonic()
        line_end = "" if self._at_line_start else "\n"
        self._at_line_start = True
        self._put(f"{line_end}{text}\n".encode())

    def _draw(self) -> None:
        # Below half a line, such as a question that a solution asks, there is no room for a status.
        if self._terminal and self._text and self._at_line_start:
            width = shutil.get_terminal_size().columns - 1
            self._put(f"\x1b[2m{self._text[:width]}\x1b[0m".encode())

    def _erase(self) -> None:
        if self._terminal and self._text and self._at_line_start:
            self._put(b"\r\x1b[K")

    def _put(self, data: bytes) -> None:
        # Nobody may be reading any more; that must not end the episode.
        with suppress(OSError):
            sys.stderr.flush()
            while data:
                data = data[os.write(sys.stderr.fileno(), data) :]
