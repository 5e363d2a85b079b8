"""The live status of a run: one line at the bottom of a terminal, or lines elsewhere, as the display says."""

import json
import math
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import Any, Literal, Self

from benchbot.cli.kit.outlet import Outlet

Display = Literal["auto", "rich", "plain", "json", "none"]
"""How a status is shown on stderr: a line that is rewritten, lines, JSON lines, or not; `auto` is what fits stderr."""

PLAIN_PERIOD_S = 2.0
REMINDER_PERIOD_S = 15.0
JSON_PERIOD_S = 0.1


def fitting(display: Display) -> Display:
    """Return what `auto` is here, and `plain` for a line that stderr could not rewrite."""
    if display not in ("auto", "rich"):
        return display
    return "rich" if sys.stderr.isatty() and os.environ.get("TERM") != "dumb" else "plain"


class StatusLine:
    """A status that is kept up to date, and what others print beside it. It never waits for a terminal.

    `rich` rewrites it in place, below whatever is printed through `write`. `plain` is a line at most every two seconds,
    and only when there is news, without control characters. `json` is an object a line, at most ten a second. With
    `none`, only what a person must do is said.
    """

    def __init__(self, display: Display = "auto") -> None:
        self.display = fitting(display)
        self._lock = threading.Lock()
        self._news: object = None
        self._printed_s = -math.inf
        self._dim = "NO_COLOR" not in os.environ
        try:
            sys.stderr.flush()
            handle = sys.stderr.fileno()
        except (OSError, ValueError):  # it is no file, or closed
            handle = None
        self._outlet = Outlet(handle, keep=not sys.stderr.isatty())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._outlet.close()

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
            news = (progress["state"], progress["frames"], progress["paused"])
        document = {"kind": "progress", "scene_count": scene_count, **progress}
        self.show(progress_text(progress, scene_count), news, urgent=urgent, document=lambda: document)

    def show(
        self,
        text: str,
        news: object,
        *,
        urgent: bool = False,
        document: Callable[[], Mapping[str, Any]] | None = None,
    ) -> None:
        """Show `text` as the status from now on; `news` is what makes it worth another line when it changes.

        Urgent news is a line of its own at once, on a terminal too, and elsewhere again and again. `document` makes
        what is shown as JSON instead.
        """
        with self._lock:
            changed, age_s = news != self._news, time.monotonic() - self._printed_s
            if self.display == "json":
                if changed and (urgent or age_s >= JSON_PERIOD_S):
                    self._news = news
                    self._printed_s = time.monotonic()
                    self._outlet.say(_json({"kind": "status", "text": text} if document is None else document()))
            elif self.display == "rich":
                if urgent and changed:
                    self._say(text)
                self._news = news
                width = shutil.get_terminal_size().columns - 1
                shown = text[:width].encode()
                self._outlet.show(b"\x1b[2m%s\x1b[0m" % shown if self._dim else shown)
            elif (self._is_due(age_s, urgent=urgent) and changed) or (urgent and age_s >= REMINDER_PERIOD_S):
                self._news = news
                self._say(text)

    def write(self, chunk: bytes) -> None:
        """Print what somebody else wrote, untouched but as JSON, where that is the display."""
        if self.display == "json":
            self._outlet.write(_json({"kind": "output", "text": chunk.decode("utf-8", "replace")}) + b"\n")
        else:
            self._outlet.write(chunk)

    def note(self, text: str, document: Mapping[str, Any] | None = None) -> None:
        """Print a line of ours that stays, unless nothing is displayed."""
        if self.display == "json":
            self._outlet.say(_json({"kind": "note", "text": text} if document is None else document))
        elif self.display != "none":
            self._outlet.say(text.encode())

    def _is_due(self, age_s: float, *, urgent: bool) -> bool:
        return urgent or (self.display == "plain" and age_s >= PLAIN_PERIOD_S)

    def _say(self, text: str) -> None:
        self._printed_s = time.monotonic()
        self._outlet.say(text.encode())


def _json(document: Mapping[str, Any]) -> bytes:
    return json.dumps(document, ensure_ascii=False, default=str).encode("utf-8", "replace")


def progress_text(progress: Mapping[str, Any], scene_count: int) -> str:
    """Return one line that says where an episode stands; `progress` is as the supervisor tells it (docs/wire.md)."""
    if progress["waiting_for"]:
        return f"WAITING FOR YOU: {_one_line(progress['waiting_for'])} When it is done, type elsewhere: benchbot ready"
    if progress["ends_run"]:
        return f"STOPPED FOR SAFETY, the run is over: {_one_line(progress['failure_why'])}"
    if not progress["frames"]:
        return "PAUSED · nothing observed yet" if progress["paused"] else "nothing observed yet"
    steps = f"step {progress['steps']}"
    if progress["trajectory_index"]:
        steps += f" · pose {progress['trajectory_index']}/{progress['trajectory_length']}"
    wall_s = progress["wall_time_s"]
    frames_per_s = progress["frames"] / wall_s if wall_s > 0 else 0.0
    parts = [
        *(["PAUSED"] if progress["paused"] else ()),
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
