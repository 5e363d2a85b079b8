"""The newest lines of log files, read as they grow, such that they command no terminal."""

import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import accumulate
from pathlib import Path

from benchbot.core.text import one_line, visible
from benchbot.plugins.watching.views import LogLine

KEPT_LINES = 1000
MOST_AT_ONCE_BYTES = 64 * 1024
LONGEST_LINE = 1000
# The format of Python's logging, which that of `benchbot.supervisor.serve` has, too.
_TIMED = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d),(\d{3}) ([A-Z]+) \S+: (.*)")
# An event of `benchbot.supervisor.run`.
_EVENT = re.compile(
    r"(?P<kind>\w+): scene_number (?P<scene>\d+), steps (?P<steps>\d+), last_action (?P<action>\S+), "
    r"state (?P<state>[^,]+), (?:simulated|robot)_time_s (?P<time_s>\S+), failure (?P<failure>[^,]+), "
    r"waiting_for (?P<request>.*)"
)
_LONG_NUMBER = re.compile(r"-?\d+\.\d{4,}(?:e[+-]?\d+)?\b")
_LEVEL = re.compile(r"\b(DEBUG|INFO|WARN|WARNING|ERROR|CRITICAL|FATAL)\b", re.IGNORECASE)
_LEVELS = {"warn": "warning", "critical": "error", "fatal": "error"}


class Logs:
    """The newest lines of several log files, at most `kept`, in the order of their times; not thread-safe.

    A line that tells no time has that of the line before in a file whose lines do, else the one at which it was read.
    Of what stood there before the first look, nothing tells when it was written, only when the file was begun
    (`began_s`, of the run) and written last: its lines share out the time between, and are not `exact`.
    """

    def __init__(self, files: Mapping[str, Path], kept: int = KEPT_LINES, began_s: float | None = None) -> None:
        self._tails = {source: _Tail(path) for source, path in files.items()}
        self._last: dict[str, LogLine] = {}
        """The last line of each source that told its time."""
        self._began_s = began_s
        self._lines: list[LogLine] = []
        self._kept = kept
        self._read = 0

    @property
    def dropped(self) -> int:
        """The number of lines that were read and are no longer kept."""
        return self._read - len(self._lines)

    def read(self) -> bool:
        """Read new lines, at most the last 64 KiB of each file; return whether there were any."""
        found: list[LogLine] = []
        for source, tail in self._tails.items():
            first = tail.is_unread
            texts = list(tail.read())
            lines = [self._line(source, text) for text in texts]
            if first and not any(line.is_exact for line in lines):
                lines = _shared_out(lines, self._began_s, tail.written_s)
            found += lines
        self._lines += [replace(line, number=self._read + place) for place, line in enumerate(found)]
        self._read += len(found)
        if found:
            self._lines.sort(key=lambda line: (line.time_s, line.number))
            del self._lines[: max(0, len(self._lines) - self._kept)]
        return bool(found)

    @property
    def lines(self) -> tuple[LogLine, ...]:
        """The newest lines, oldest first."""
        return tuple(self._lines)

    def _line(self, source: str, text: str) -> LogLine:
        line = line_of(source, text)
        before = self._last.get(source)
        if line.is_exact:
            self._last[source] = line
        elif before is not None:
            # A line of a record before it, such as one of a traceback.
            level = before.level if text.startswith(" ") else line.level
            return replace(line, time_s=before.time_s, level=level, is_exact=True)
        return line


def line_of(source: str, text: str) -> LogLine:
    """Return a line of a log, with its own time and level, else with the present time and a guessed level."""
    found = _TIMED.match(text)
    if found is not None:
        written_s = time.mktime(time.strptime(found[1], "%Y-%m-%d %H:%M:%S")) + int(found[2]) / 1000
        said = in_words(found[4]) if source == "supervisor" else found[4]
        return LogLine(written_s, source, _level(found[3]), harmless(said))
    named = _LEVEL.search(text[:80])
    return LogLine(time.time(), source, _level(named[1]) if named else "info", harmless(text), is_exact=False)


def in_words(text: str) -> str:
    """Return what the supervisor has logged as one would say it: no raw names, no digits that mean nothing."""
    found = _EVENT.fullmatch(text)
    if found is None:
        return _LONG_NUMBER.sub(lambda number: f"{float(number[0]):.4g}", text)
    kind, scene = found["kind"], f"scene {int(found['scene']) + 1}"
    if kind == "operator":
        asked = found["request"]
        return f"{scene}, the operator is done" if asked == "None" else f"{scene}, asks the operator: {asked}"
    parts = [
        {"step": f"step {found['steps']}: {found['action']}", "scene": f"{scene} begins"}.get(kind, f"{kind}, {scene}")
    ]
    parts += [f"failed: {found['failure']}"] if found["failure"] != "None" else []
    parts.append(found["state"])
    if found["time_s"] != "None":
        parts.append(f"at {float(found['time_s']):.2f} s")
    return " · ".join(parts)


def _shared_out(lines: list[LogLine], began_s: float | None, written_s: float) -> list[LogLine]:
    """Return lines with times between the beginning and the last writing of their file, by their place in it."""
    since_s = min(written_s if began_s is None else began_s, written_s)
    sizes = list(accumulate(len(line.text) + 1 for line in lines))
    return [
        replace(line, time_s=since_s + (written_s - since_s) * size / sizes[-1])
        for line, size in zip(lines, sizes, strict=True)
    ]


def harmless(text: str) -> str:
    """Return a line as it may be shown, cut at `LONGEST_LINE`."""
    shown = one_line(text[: 4 * LONGEST_LINE].expandtabs(4))
    return shown if len(shown) <= LONGEST_LINE else f"{shown[: LONGEST_LINE - 1]}…"


def end_of(path: Path, most_bytes: int) -> str:
    """Return the text at the end of a file as it may be shown, each state of a progress bar a line; raises OSError."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - most_bytes))
        text = file.read().decode("utf-8", "replace")
    return visible(text.replace("\r\n", "\n").replace("\r", "\n"))


def _level(name: str) -> str:
    name = name.lower()
    return _LEVELS.get(name, name)


class _Tail:
    """Reads the lines that are added to a text file; of a large addition only the end."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offset = 0
        self._rest = b""
        self.is_unread = True
        """Whether nothing of it has been read yet."""
        self.written_s = 0.0
        """When it had been written to last when it was read last, in seconds since the epoch."""

    def read(self) -> Iterable[str]:
        try:
            with self._path.open("rb") as file:
                end = file.seek(0, 2)
                if end == self._offset:
                    return
                self.written_s = os.fstat(file.fileno()).st_mtime
                self.is_unread = False
                if end < self._offset or end - self._offset > MOST_AT_ONCE_BYTES:
                    self._offset, self._rest = max(0, end - MOST_AT_ONCE_BYTES), b""
                file.seek(self._offset)
                content = self._rest + file.read(MOST_AT_ONCE_BYTES)
                self._offset = file.tell()
        except OSError:
            return
        yield from self._whole_lines(content)

    def _whole_lines(self, content: bytes) -> Iterator[str]:
        *lines, self._rest = content.split(b"\n")
        if len(self._rest) > MOST_AT_ONCE_BYTES:
            self._rest = b""
        for line in lines:
            # A progress bar that was rewritten in place is one line: its last state.
            text = line.rstrip(b"\r").rpartition(b"\r")[2].decode("utf-8", "replace")
            if text.strip():
                yield text
