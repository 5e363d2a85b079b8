"""The virtual environment that is installed into, which is the one of this Python, and the lock on it."""

import fcntl
import os
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

_VENV = "python3 -m venv ~/benchbot && ~/benchbot/bin/pip install benchbot, then use ~/benchbot/bin/benchbot"


@dataclass(frozen=True)
class Environment:
    """A virtual environment: its folder, its Python, and the folders that distributions are installed into."""

    prefix: Path
    python: Path
    sites: tuple[Path, ...]

    @property
    def site(self) -> Path:
        """The folder of pure Python."""
        return self.sites[0]

    @property
    def own(self) -> Path:
        """The folder of BenchBot's lock and journal."""
        return self.prefix / ".benchbot"


def current() -> Environment:
    """Return the environment of this process; raises BenchbotError where nothing should or can be installed."""
    prefix = Path(sys.prefix)
    if sys.prefix == sys.base_prefix and not (prefix / "conda-meta").is_dir():
        managed = (Path(sysconfig.get_path("stdlib")) / "EXTERNALLY-MANAGED").is_file()
        raise BenchbotError(
            "BenchBot does not run in a virtual environment.",
            f"{prefix} belongs to the system"
            f"{', whose package manager looks after it (PEP 668)' if managed else ''}: "
            "what is installed there may break other programs.",
            f"Make one of its own: {_VENV}",
        )
    sites = dict.fromkeys(Path(sysconfig.get_path(name)) for name in ("purelib", "platlib"))
    found = Environment(prefix, Path(sys.executable), tuple(sites))
    for folder in (prefix, *found.sites):
        if not os.access(folder, os.W_OK | os.X_OK):
            raise BenchbotError(
                "Nothing can be installed here: no permission to write.",
                f"{folder} is not yours to write, or is on a disk that is mounted read-only.",
                f"Ask whom it belongs to, or make an environment of your own: {_VENV}",
            )
    return found


@contextmanager
def locked(environment: Environment, command: str) -> Iterator[int]:
    """Hold the environment's lock and yield its file descriptor; waits for its holder, after a note that names it.

    The kernel releases the lock when the last process that has inherited the descriptor ends, whatever ends it.
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
            console.note(f"Waiting for another change of this environment to end: {holder}.")
            fcntl.flock(file, fcntl.LOCK_EX)
        os.ftruncate(file, 0)
        os.pwrite(file, f"{command} (process {os.getpid()})\n".encode(), 0)
        yield file
    finally:
        os.close(file)
