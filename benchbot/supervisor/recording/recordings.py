"""The recordings of a run: those that it began with, and those that joined it later."""

import json
import logging
import threading
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from benchbot.core.session import Session
from benchbot.supervisor.recording.host import RecorderHost

LIST_FILE = "recordings.json"
"""A file in a run's folder: the folders of all recordings that it has begun, one in a line, as JSON."""

log = logging.getLogger("benchbot.supervisor")


def listed(run_folder: Path) -> list[Path]:
    """Return the folders that a run has been recorded into, which may hold what solutions must not know."""
    try:
        return [Path(json.loads(line)) for line in (run_folder / LIST_FILE).read_text("utf-8").splitlines()]
    except (OSError, ValueError):
        return []


class Recordings:
    """Begins and finishes recordings of a session. Methods block; they may be called from several threads."""

    def __init__(self, session: Session, publish: Callable[[str, dict[str, Any]], None], folder: Path) -> None:
        self._session = session
        self._list = folder / LIST_FILE
        self._publish = publish
        self._lock = threading.Lock()
        self._hosts: list[RecorderHost] = []

    def begin(self, folders: Mapping[str, Path]) -> None:
        """Have recorders, by name, write into folders from the next observation on.

        Raises BenchbotError when one cannot begin; then none of them does.
        """
        if not folders:
            return
        folders = {name: folder.absolute() for name, folder in folders.items()}
        # First of all: what starts from now on must not be shown them.
        _note(self._list, folders.values())
        host = RecorderHost(folders, self._ended)
        host.reset()
        with self._lock:
            self._hosts.append(host)
        self._session.join(host)
        log.info("recording: %s", ", ".join(f"{name} into {folder}" for name, folder in folders.items()))

    def result(self, document: Mapping[str, Any]) -> None:
        """Tell recorders that show results of one."""
        shown = {key: value for key, value in document.items() if key not in ("track", "actions")}
        for host in list(self._hosts):
            host.result(shown)

    def finish(self, folders: Collection[Path]) -> None:
        """Finish the recordings in these folders, and those that were begun with them; return when they are written."""
        with self._lock:
            finished = [host for host in self._hosts if not {*host.folders.values()}.isdisjoint(folders)]
            self._hosts = [host for host in self._hosts if host not in finished]
        for host in finished:
            self._session.leave(host)
            host.close()

    def as_list(self) -> list[dict[str, Any]]:
        """Return what is being recorded where, as JSON."""
        return [
            {"recorder": name, "folder": str(folder), "dropped": host.dropped, "ended": host.ended}
            for host in list(self._hosts)
            for name, folder in host.folders.items()
        ]

    def _ended(self, why: str) -> None:
        log.warning("%s", why)
        self._publish("recording", {"ended": why})


def _note(path: Path, folders: Iterable[Path]) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.writelines(f"{json.dumps(str(folder))}\n" for folder in folders)
