"""The live status of a run: one line at the bottom of a terminal, or lines elsewhere, as the display says."""

import json
import math
import os
import shutil
import sys
import threading
import time
from codecs import getincrementaldecoder
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Literal, Self

from benchbot.cli.kit.solution_output import ERASE, MarkedOutput, folded
from benchbot.core.text import one_line, visible

Display = Literal["auto", "rich", "plain", "json", "none"]
"""The form of a status on stderr: a line that is rewritten, lines, JSON lines, or nothing; `auto` is what fits."""

PLAIN_PERIOD_S = 2.0
REMINDER_PERIOD_S = 15.0
JSON_PERIOD_S = 0.1
PENDING_BYTES = 2**20
"""Size of the output kept for a terminal that takes nothing, as after Ctrl-S; the rest is not shown."""
WRITE_PERIOD_S = 0.1
PATIENCE_S = 2.0


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
        self._writer = StderrWriter(handle, keep=not sys.stderr.isatty(), rewrites=self.display == "rich")
        self._decoded = getincrementaldecoder("utf-8")("replace").decode

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._writer.close()

    def started(self, process: int) -> None:
        """Ignore the number of a solution's process: it is not shown."""

    def look(self, progress: Mapping[str, Any], scene_count: int) -> None:
        """Show where an episode stands; it is for the solution to end it."""
        self.show_progress(progress, scene_count)

    def show_progress(self, progress: Mapping[str, Any], scene_count: int) -> None:
        """Show where an episode stands; what a person must know or do is urgent."""
        urgent = bool(progress["waiting_for"] or progress["ends_run"])
        news: tuple[Any, ...] = (progress["waiting_for"], progress["ends_run"])
        if not urgent:
            news = (progress["state"], progress["frames"], progress["paused"], progress.get("preparing"))
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
        text = one_line(text)
        with self._lock:
            changed, age_s = news != self._news, time.monotonic() - self._printed_s
            if self.display == "json":
                if changed and (urgent or age_s >= JSON_PERIOD_S):
                    self._news = news
                    self._printed_s = time.monotonic()
                    self._writer.say(_json({"kind": "status", "text": text} if document is None else document()))
            elif self.display == "rich":
                if urgent and changed:
                    self._say(text)
                self._news = news
                shown = next(folded(text, shutil.get_terminal_size().columns)).encode()
                self._writer.show(b"\x1b[2m%s\x1b[0m" % shown if self._dim else shown)
            elif (urgent and (changed or age_s >= REMINDER_PERIOD_S)) or (
                changed and self.display == "plain" and age_s >= PLAIN_PERIOD_S
            ):
                self._news = news
                self._say(text)

    def write(self, chunk: bytes) -> None:
        """Print the output of a solution, marked as such, or as JSON, where that is the display."""
        if self.display == "json":
            self._writer.write(_json({"kind": "output", "text": self._decoded(chunk)}) + b"\n", ours=True)
        else:
            self._writer.write(chunk)

    def note(self, text: str, document: Mapping[str, Any] | None = None) -> None:
        """Print a line of ours that stays, unless nothing is displayed."""
        if self.display == "json":
            self._writer.say(_json({"kind": "note", "text": text} if document is None else document))
        elif self.display != "none":
            self._writer.say(one_line(text).encode())

    def _say(self, text: str) -> None:
        self._printed_s = time.monotonic()
        self._writer.say(text.encode())


class StderrWriter:
    """A thread that writes to a file descriptor (None: nowhere), so that no other thread waits for a terminal.

    Safe to use from any thread. What is printed is written in order, with the current status below it, at most ten
    times a second. With `keep`, for files and pipes, printing waits and nothing is lost. The thread is a daemon: one
    that a terminal blocks ends with the process. With `rewrites`, for terminals, carriage returns of a solution do so.
    """

    def __init__(self, handle: int | None, *, keep: bool, rewrites: bool) -> None:
        self._handle = handle
        self._keep = keep
        self._changed = threading.Condition()
        self._printed: list[tuple[bytes, bool]] = []
        self._pending_bytes = 0
        self._lost_bytes = 0
        self._status = b""
        self._shown = b""
        self._output = MarkedOutput(handle, rewrites=rewrites)
        self._closing = False
        self._reader_gone = handle is None
        self._thread: threading.Thread | None = None

    def write(self, data: bytes, *, ours: bool = False) -> None:
        """Print the output of a solution, marked as such, or lines of `ours` about it."""
        with self._changed:
            while self._keep and self._is_full and not self._reader_gone:
                self._changed.wait()
            if self._is_full:
                self._lost_bytes += len(data)
            else:
                self._add(data, ours=ours)

    def say(self, line: bytes) -> None:
        """Print a line of ours; never waits."""
        with self._changed:
            if not self._is_full:
                self._add(line + b"\n", ours=True)

    def show(self, status: bytes) -> None:
        """Show a status below what is printed from now on; empty for none."""
        with self._changed:
            self._status = status
            self._wake()

    def close(self) -> None:
        """Remove the status, and write what is left; a terminal that takes nothing is waited for a moment only."""
        with self._changed:
            self._status, self._closing = b"", True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join(None if self._keep else PATIENCE_S)

    @property
    def _is_full(self) -> bool:
        return self._pending_bytes > PENDING_BYTES

    def _add(self, data: bytes, *, ours: bool) -> None:
        self._printed.append((data, ours))
        self._pending_bytes += len(data)
        self._wake()

    def _wake(self) -> None:
        if self._thread is None and not self._reader_gone:
            self._thread = threading.Thread(target=self._write_all, name="benchbot-stderr", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _write_all(self) -> None:
        drew_s = float("-inf")
        while True:
            with self._changed:
                while not self._printed and not self._closing:
                    left_s = drew_s + WRITE_PERIOD_S - time.monotonic() if self._status != self._shown else None
                    if left_s is not None and left_s <= 0:
                        break
                    self._changed.wait(left_s)
                if self._closing and not self._printed and not self._shown and self._output.at_line_start:
                    return
                data, taken_bytes = self._composed()
            drew_s = time.monotonic()
            gone = not self._put(data)
            with self._changed:
                self._pending_bytes -= taken_bytes
                self._reader_gone |= gone
                self._changed.notify_all()
            if gone:
                return

    def _composed(self) -> tuple[bytes, int]:
        """Return what is to be written now, and how much of it was pending."""
        output = self._output
        parts = [ERASE.encode()] if self._shown else []
        for data, ours in self._printed:
            parts.append(output.line_end().encode() + data if ours else output.shown(data).encode())
        taken_bytes = sum(len(data) for data, _ in self._printed)
        if self._lost_bytes:
            lost = f"[{self._lost_bytes} bytes are not shown: the terminal did not take them]\n"
            parts.append(f"{output.line_end()}{lost}".encode())
            self._lost_bytes = 0
        if self._closing:
            parts.append(output.line_end().encode())
        self._printed = []
        # Below half a line, such as a question that a solution asks, there is no room for a status.
        self._shown = self._status if output.at_line_start else b""
        return b"".join([*parts, self._shown]), taken_bytes

    def _put(self, data: bytes) -> bool:
        """Write data; return False when the reader is gone, which must not end the episode."""
        with suppress(OSError):
            while data:
                data = data[os.write(self._handle or 0, data) :]
        return not data


def _json(document: Mapping[str, Any]) -> bytes:
    return visible(json.dumps(document, ensure_ascii=False, default=str)).encode()


def progress_text(progress: Mapping[str, Any], scene_count: int) -> str:
    """Return one line that says where an episode stands; `progress` is as the supervisor tells it (docs/wire.md)."""
    if progress["waiting_for"]:
        return f"WAITING FOR YOU: {one_line(progress['waiting_for'])} When it is done, type elsewhere: benchbot ready"
    if progress["ends_run"]:
        return f"STOPPED FOR SAFETY, the run is over: {one_line(progress['failure_why'])}"
    if not progress["frames"]:
        paused = "PAUSED" if progress["paused"] else ""
        return " · ".join(filter(None, (paused, "nothing observed yet", progress.get("preparing") or "")))
    steps, spent = f"step {progress['steps']}", progress["spent"]
    if spent["restarts"]:
        steps += f" ({spent['steps']} in {spent['restarts'] + 1} attempts)"
    if progress["trajectory_index"]:
        steps += f" · pose {progress['trajectory_index']}/{progress['trajectory_length']}"
    # A task with noisy localisation hides the true pose, and the time that tells how far the robot has driven.
    pose, simulated_s, robot_s = (progress.get(key) for key in ("pose_xyyaw", "simulated_time_s", "robot_time_s"))
    where = [] if pose is None else [f"at ({pose[0]:.2f}, {pose[1]:.2f}) m {math.degrees(pose[2]):.0f}°"]
    wall_s = progress["wall_time_s"]
    frames_per_s = progress["frames"] / wall_s if wall_s > 0 else 0.0
    parts = [
        *(["PAUSED"] if progress["paused"] else ()),
        progress["state"],
        f"scene {progress['scene_number'] + 1}/{scene_count}",
        steps,
        *where,
        *([] if simulated_s is None else [f"{simulated_s:.1f} s simulated"]),
        *([] if robot_s is None else [f"{robot_s:.1f} s by the robot's clock"]),
        f"{wall_s:.1f} s",
        f"{frames_per_s:.1f} frames/s",
    ]
    if progress["failure"]:
        parts.append(f"failure: {progress['failure']}")
    return " · ".join(parts)
