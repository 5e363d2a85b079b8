"""What was read of results and worked out of them, kept in the user's cache by path, modification time and size."""

import os
import sqlite3
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import cache_dir

VERSION = 2
MOST = 200_000
"""The number of results that are kept, the newest."""
BUSY_S = 5.0


class Memory:
    """A cache in SQLite; safe to use from several threads. Without one that can be used, all is read anew."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._new: dict[str, tuple[str, bytes]] = {}
        self._known: dict[str, tuple[str, bytes]] | None = None
        self._path = cache_dir() / f"view-{VERSION}.sqlite"

    def find(self, path: str | Path, about: os.stat_result, kind: str = "row", type_: Any = Any) -> tuple[bool, Any]:
        """Return whether something is known of a file as it is, and what that is."""
        key = f"{kind} {path}"
        with self._lock:
            if self._known is None:
                self._known = self._read()
            found = self._new.get(key) or self._known.get(key)
        if found is None or found[0] != _stamp(about):
            return False, None
        try:
            return True, msgspec.json.decode(found[1], type=type_)
        except msgspec.DecodeError:
            return False, None

    def put(self, path: str | Path, about: os.stat_result, content: Any, kind: str = "row") -> None:
        """Keep what is known of a file."""
        with self._lock:
            self._new[f"{kind} {path}"] = _stamp(about), msgspec.json.encode(content)

    def save(self) -> None:
        """Write what is new."""
        with self._lock:
            self._known = {}  # it is read once, for the first look
            if not self._new:
                return
            new, self._new = self._new, {}
            with suppress(sqlite3.Error), self._connection() as connection:
                items = [(key, *value) for key, value in new.items()]
                connection.executemany("INSERT OR REPLACE INTO known VALUES (?, ?, ?)", items)
                connection.execute("DELETE FROM known WHERE rowid <= (SELECT max(rowid) FROM known) - ?", (MOST,))

    def _read(self) -> dict[str, tuple[str, bytes]]:
        with suppress(sqlite3.Error), self._connection() as connection:
            found = connection.execute("SELECT key, stamp, content FROM known")
            return {key: (stamp, content) for key, stamp, content in found}
        return {}

    def _connection(self) -> "_Closing":
        return _Closing(self._path)


class _Closing:
    """A connection for one use: it is committed and closed."""

    def __init__(self, path: Path) -> None:
        self._connection = sqlite3.connect(path, timeout=BUSY_S)
        self._connection.execute("CREATE TABLE IF NOT EXISTS known (key TEXT PRIMARY KEY, stamp TEXT, content BLOB)")

    def __enter__(self) -> sqlite3.Connection:
        return self._connection

    def __exit__(self, *_: object) -> None:
        self._connection.commit()
        self._connection.close()


def _stamp(about: os.stat_result) -> str:
    return f"{about.st_mtime_ns} {about.st_size}"
