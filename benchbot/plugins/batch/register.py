"""The register of a user's batches: which folders have been driven, and by whom, so that they are found again.

A small file for each, in the state folder. It is a convenience: where it cannot be written, the batch goes on without.
"""

import json
import os
import time
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.processes import ProcessId

KEPT = 200


@dataclass(frozen=True)
class Entry:
    """A batch's folder, when somebody last began to drive it (seconds since the epoch), and who does so now."""

    folder: Path
    begun_s: float
    driver: ProcessId | None

    @property
    def is_driven(self) -> bool:
        """Whether somebody drives it, as far as is known."""
        return self.driver is not None and not self.driver.is_dead


def begun(folder: Path) -> None:
    """Note that this process drives a batch from now on."""
    _write(folder, ProcessId.of(os.getpid()))
    _forget_the_oldest()


def ended(folder: Path) -> None:
    """Note that this process does not drive it any more; whoever has taken it over keeps it."""
    entry = find(folder)
    if entry is not None and entry.driver == ProcessId.of(os.getpid()):
        _write(folder, None, entry.begun_s)


def find(folder: Path) -> Entry | None:
    """Return what is noted of a batch."""
    try:
        return _read(_place(folder))
    except BenchbotError:
        return None


def entries() -> list[Entry]:
    """Return the batches whose folders are still there, the one that was driven last first; forget the others."""
    found = []
    for path in _files():
        entry = _read(path)
        if entry is not None and Folder(entry.folder).plan.is_file():
            found.append(entry)
        else:
            with suppress(OSError):
                path.unlink()
    return sorted(found, key=lambda entry: entry.begun_s, reverse=True)


def _write(folder: Path, driver: ProcessId | None, begun_s: float | None = None) -> None:
    document = {
        "folder": str(folder.absolute()),
        "begun_s": time.time() if begun_s is None else begun_s,
        "driver": None if driver is None else driver.as_dict(),
    }
    with suppress(OSError, BenchbotError):
        place = _place(folder)
        place.parent.mkdir(mode=0o700, exist_ok=True)
        atomic.write(place, json.dumps(document).encode())


def _read(path: Path) -> Entry | None:
    try:
        document = json.loads(path.read_bytes())
        driver = document["driver"]
        return Entry(
            Path(document["folder"]),
            float(document["begun_s"]),
            None if driver is None else ProcessId.from_dict(driver),
        )
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _place(folder: Path) -> Path:
    return resources.state_dir() / "batches" / f"{sha256(str(folder.absolute()).encode()).hexdigest()[:16]}.json"


def _files() -> list[Path]:
    return list((resources.state_dir() / "batches").glob("*.json"))


def _forget_the_oldest() -> None:
    with suppress(OSError, BenchbotError):
        for path in sorted(_files(), key=lambda path: path.stat().st_mtime)[:-KEPT]:
            path.unlink()
