"""Journals: files of one JSON object per line that survive whoever writes them, at any moment."""

import json
import os
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
    """Return the entries; what was torn by the death of a writer is passed over, and so is a file that is not there."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return []
    return list(_entries(content))


class Tail:
    """What is added to a journal from look to look."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offset = 0

    def read(self) -> list[dict[str, Any]]:
        """Return the entries that came since the last time; a line that is still being written comes next time."""
        try:
            with self._path.open("rb") as file:
                file.seek(self._offset)
                content = file.read()
        except OSError:
            return []
        whole = content[: content.rfind(b"\n") + 1]
        self._offset += len(whole)
        return list(_entries(whole))


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
