"""The driver of a batch: a lock lets one process at a time drive it, and a register lists the batches of a user.

A detached driver lets go of the lock for another one. The register is a small file for each batch in the state folder.
It is a convenience: where it cannot be written, the batch goes on without.
"""

import fcntl
import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.folder import Folder, check_writable
from benchbot.plugins.batch.machine import ProcessId
from benchbot.plugins.batch.worker_pool import WorkerPool

HAND_OVER_TIMEOUT_S = 60.0
"""A detached driver may take so long to notice that it is to let go: it may be talking with a cluster."""
POLL_S = 0.05
REGISTER_LIMIT = 200


@dataclass(frozen=True)
class RegisteredBatch:
    """A batch's folder, when it was last begun to be driven (seconds since the epoch), and its driver now."""

    folder: Path
    begun_s: float
    driver: ProcessId | None

    @property
    def is_driven(self) -> bool:
        """Whether it has a driver, as far as is known."""
        return self.driver is not None and not self.driver.is_dead


@contextmanager
def driver_lock(folder: Folder, *, detached: bool = False) -> Iterator[None]:
    """Be the only driver of a batch on this machine; raises BenchbotError when there is one already.

    A driver that is `detached` gets SIGTERM from the next one, and has to let go of the batch without ending it.
    """
    check_writable(folder.path)
    handle = os.open(folder.driver_lock, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _locked(handle) and (detached or not _handed_over(handle, folder)):
            raise BenchbotError(
                f"Somebody drives the batch in {folder.path} already.",
                "Another benchbot batch of this folder is running.",
                f"Look on: benchbot batch status {folder.path}   End it: benchbot batch cancel {folder.path}",
            )
        me = ProcessId.of(os.getpid())
        os.ftruncate(handle, 0)
        if detached:
            os.pwrite(handle, json.dumps(me.as_dict()).encode(), 0)
        _register(RegisteredBatch(folder.path.absolute(), time.time(), me))
        _forget_the_oldest()
        try:
            yield
        finally:
            entry = registered(folder.path)
            if entry is not None and entry.driver == me:  # else the next driver has registered already
                _register(RegisteredBatch(entry.folder, entry.begun_s, None))
    finally:
        os.close(handle)


def registered(folder: Path) -> RegisteredBatch | None:
    """Return a batch's entry in the register."""
    try:
        return _read(_entry_path(folder))
    except BenchbotError:
        return None


def registered_batches() -> list[RegisteredBatch]:
    """Return the batches whose folders are still there, the one that was driven last first; forget the others."""
    found = []
    for path in _entry_paths():
        entry = _read(path)
        if entry is not None and Folder(entry.folder).plan.is_file():
            found.append(entry)
        else:
            with suppress(OSError):
                path.unlink()
    return sorted(found, key=lambda entry: entry.begun_s, reverse=True)


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _handed_over(handle: int, folder: Folder) -> bool:
    """Ask a detached driver, if the lock's holder is one, to let go; return whether this process has the lock now."""
    asked = None
    deadline_s = time.monotonic() + HAND_OVER_TIMEOUT_S
    while WorkerPool.read(folder).detached and time.monotonic() < deadline_s:
        # A detached driver that has just begun may not have written its identity yet.
        with suppress(ValueError, TypeError, KeyError):
            holder = ProcessId.from_dict(json.loads(os.pread(handle, 4096, 0)))
            if holder != asked:
                holder.signal_group(signal.SIGTERM)
                asked = holder
        time.sleep(POLL_S)
        if _locked(handle):
            return True
    return False


def _register(entry: RegisteredBatch) -> None:
    driver = None if entry.driver is None else entry.driver.as_dict()
    document = {"folder": str(entry.folder), "begun_s": entry.begun_s, "driver": driver}
    with suppress(OSError, BenchbotError):
        path = _entry_path(entry.folder)
        path.parent.mkdir(mode=0o700, exist_ok=True)
        atomic.write(path, json.dumps(document).encode())


def _read(path: Path) -> RegisteredBatch | None:
    try:
        document = json.loads(path.read_bytes())
        driver = None if document["driver"] is None else ProcessId.from_dict(document["driver"])
        return RegisteredBatch(Path(document["folder"]), float(document["begun_s"]), driver)
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _entry_path(folder: Path) -> Path:
    return resources.state_dir() / "batches" / f"{sha256(str(folder.absolute()).encode()).hexdigest()[:16]}.json"


def _entry_paths() -> list[Path]:
    return list((resources.state_dir() / "batches").glob("*.json"))


def _forget_the_oldest() -> None:
    with suppress(OSError, BenchbotError):
        for path in sorted(_entry_paths(), key=lambda path: path.stat().st_mtime)[:-REGISTER_LIMIT]:
            path.unlink()
