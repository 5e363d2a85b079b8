"""The newest lines of log files, read as they grow, such that they command no terminal."""

import os
import re
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from benchbot.core.text import one_line, visible
from benchbot.plugins.watching.views import LogLine

KEPT_LINES = 1000
MOST_AT_ONCE_BYTES = 64 * 1024
LONGEST_LINE = 1000
# The format of the log of `benchbot.supervisor.backend`.
_SUPERVISOR = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d),(\d{3}) ([A-Z]+) \S+: (.*)")
_LEVEL = re.compile(r"\b(DEBUG|INFO|WARN|WARNING|ERROR|CRITICAL|FATAL)\b", re.IGNORECASE)
_LEVELS = {"warn": "warning", "critical": "error", "fatal": "error"}


class Logs:
    """The newest lines of several log files, at most `kept`; not thread-safe."""

    def __init__(self, files: Mapping[str, Path], kept: int = KEPT_LINES) -> None:
        self._tails = {source: _Tail(path) for source, path in files.items()}
        self._lines: deque[LogLine] = deque(maxlen=kept)
        self.dropped = 0
        """The number of lines that were read and are no longer kept."""

    def read(self) -> bool:
        """Read new lines, at most the last 64 KiB of each file; return whether there were any."""
        found = False
        for source, tail in self._tails.items():
            for text in tail.read():
                found = True
                self.dropped += len(self._lines) == self._lines.maxlen
                self._lines.append(line_of(source, text))
        return found

    @property
    def lines(self) -> tuple[LogLine, ...]:
        """The newest lines, oldest first."""
        return tuple(self._lines)


def line_of(source: str, text: str) -> LogLine:
    """Return a line of a log, with its own time and level, else with the present time and a guessed level."""
    found = _SUPERVISOR.match(text) if source == "supervisor" else None
    if found is not None:
        written_s = time.mktime(time.strptime(found[1], "%Y-%m-%d %H:%M:%S")) + int(found[2]) / 1000
        return LogLine(written_s, source, _level(found[3]), harmless(found[4]))
    named = _LEVEL.search(text[:80])
    return LogLine(time.time(), source, _level(named[1]) if named else "info", harmless(text))


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

    def read(self) -> Iterable[str]:
        try:
            with self._path.open("rb") as file:
                end = file.seek(0, 2)
                if end == self._offset:
                    return
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
