"""Journals: files of one JSON object per line, which stay readable when their writer is killed at any moment."""

import json
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any


def append(path: Path, entry: dict[str, Any], *, sync: bool = False) -> None:
    """Add a line, in one write; raises OSError. With `sync`, it is on the disk when this returns."""
    line = json.dumps(entry, sort_keys=True, separators=(",", ":")) + "\n"
    handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    try:
        if _ends_torn(path):
            line = f"\n{line}"
        os.write(handle, line.encode())
        if sync:
            os.fsync(handle)
    finally:
        os.close(handle)


def read(path: Path) -> list[dict[str, Any]]:
    """Return the entries, without lines that are torn; none for a file that is not there."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return []
    return list(_entries(content))


def sizes(folder: Path) -> list[tuple[str, int]]:
    """Return name and size of each journal in a folder, by name; none for one that is not there."""
    with suppress(OSError), os.scandir(folder) as entries:
        return sorted((each.name, each.stat().st_size) for each in entries if each.name.endswith(".jsonl"))
    return []


class Tail:
    """Reads a journal as it grows."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offset = 0

    def read(self) -> list[dict[str, Any]]:
        """Return the entries since the last call; a line that is still being written comes with the next one."""
        try:
            with self._path.open("rb") as file:
                file.seek(self._offset)
                content = file.read()
        except OSError:
            return []
        whole = content[: content.rfind(b"\n") + 1]
        self._offset += len(whole)
        return list(_entries(whole))


class EventLog:
    """Appends to `events/NAME.jsonl`: `{"time_s": seconds since the epoch, "who": NAME, "what": …, …}`.

    Nothing depends on it: on a full disk, events are lost and the work goes on.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self._path = folder / f"{name}.jsonl"
        self._name = name

    def tell(self, what: str, **said: Any) -> None:
        """Add an event."""
        with suppress(OSError):
            append(self._path, {"time_s": round(time.time(), 3), "who": self._name, "what": what, **said})


def _entries(content: bytes) -> Iterator[dict[str, Any]]:
    for line in content.split(b"\n"):
        with suppress(ValueError, RecursionError):
            entry = json.loads(line)
            if isinstance(entry, dict):
                yield entry


def _ends_torn(path: Path) -> bool:
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) == 0:
            return False
        file.seek(-1, os.SEEK_END)
        return file.read(1) != b"\n"
