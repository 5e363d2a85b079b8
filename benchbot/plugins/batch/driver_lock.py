"""Who drives a batch: one process at a time on a machine. A detached driver makes room for a person's."""

import fcntl
import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import register
from benchbot.plugins.batch.events import check_writable
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.processes import ProcessId
from benchbot.plugins.batch.worker_pool import Crew

PATIENCE_S = 60.0
"""So long a detached driver may take to notice that somebody wants its place: it may be talking with a cluster."""
POLL_S = 0.05


@contextmanager
def driving(folder: Folder, *, detached: bool = False) -> Iterator[None]:
    """Be the only driver of a batch on this machine; raises BenchbotError when there is one already.

    A driver that is `detached` is sent SIGTERM by whoever comes after it, and has to let go of the batch, not end it.
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
        os.ftruncate(handle, 0)
        if detached:
            os.pwrite(handle, json.dumps(ProcessId.of(os.getpid()).as_dict()).encode(), 0)
        register.begun(folder.path)
        try:
            yield
        finally:
            register.ended(folder.path)
    finally:
        os.close(handle)


def _locked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _handed_over(handle: int, folder: Folder) -> bool:
    """Ask the driver that there is to let go, if it is a detached one; say whether this process has its place now."""
    asked = None
    deadline_s = time.monotonic() + PATIENCE_S
    while Crew.read(folder).detached and time.monotonic() < deadline_s:
        holder = _holder(handle)
        if holder is not None and holder != asked:
            holder.signal_group(signal.SIGTERM)
            asked = holder
        time.sleep(POLL_S)
        if _locked(handle):
            return True
    return False


def _holder(handle: int) -> ProcessId | None:
    """Return which detached driver has the lock; None for one that has just begun."""
    try:
        return ProcessId.from_dict(json.loads(os.pread(handle, 4096, 0)))
    except (ValueError, TypeError, KeyError):
        return None
