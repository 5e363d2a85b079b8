"""One change of an environment at a time: a lock that the kernel gives back whatever becomes of its holder."""

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.environment import Environment


@contextmanager
def exclusive(environment: Environment, what: str, note: Callable[[str], None]) -> Iterator[int]:
    """Hold the environment's lock and yield its file; waits for whoever holds it, after a note that says who.

    A program that inherits the file holds the lock, too, for as long as it runs.
    """
    path = environment.own / "lock"
    try:
        path.parent.mkdir(exist_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise BenchbotError(
            "This environment cannot be locked.",
            f"{path}: {error.strerror}.",
            "Make it writable for you, or use another environment.",
        ) from error
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(file, 500, 0).decode("utf-8", "replace").strip() or "another process"
            note(f"Waiting for another change of this environment to end: {holder}.")
            fcntl.flock(file, fcntl.LOCK_EX)
        os.ftruncate(file, 0)
        os.pwrite(file, f"{what} (process {os.getpid()})\n".encode(), 0)
        yield file
    finally:
        os.close(file)
