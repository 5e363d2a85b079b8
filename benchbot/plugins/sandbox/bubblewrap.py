"""Sandboxes of bubblewrap (https://github.com/containers/bubblewrap): their command, and the pipe of the result."""

import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from benchbot.plugins.sandbox.view import View, code_needed
from benchbot.submission.limits import TEMPORARY_BYTES
from benchbot.submission.modes import RESULT, RESULT_MAX_BYTES
from benchbot.submission.solution import CODE

INSIDE = Path("/run/benchbot")
CODE_INSIDE = INSIDE / "code"
SOCKET_INSIDE = INSIDE / "supervisor.sock"
RESULT_INSIDE = INSIDE / "result" / RESULT
FOLDER_BYTES = 2 * RESULT_MAX_BYTES
"""The size of the folder of the result: more than is read of it, to tell too large a result from a full disk."""
PROBE_TIMEOUT_S = 30.0
CHUNK_BYTES = 2**20
PIPE_TIMEOUT_S = 15.0
"""The time to read what is left in the pipe when the sandbox has ended: 64 KiB at most."""


def program() -> str | None:
    """Return the path of bubblewrap; None where it is not installed."""
    return shutil.which("bwrap")


def problem() -> str | None:
    """Return the reason why bubblewrap cannot make a sandbox on this machine; None when it can."""
    bwrap = program()
    if bwrap is None:
        return "bubblewrap is not installed"
    words = [bwrap, *_namespaces(), "--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--", "/bin/true"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=PROBE_TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"bubblewrap does not run: {error}"
    return None if done.returncode == 0 else f"bubblewrap failed: {done.stderr.strip()}"


@contextmanager
def command(view: View, socket: Path) -> Iterator[tuple[list[str], int]]:
    """Yield the command that the init process is run by, with namespaces and a view of the files, and a file it reads.

    The root of the file system is empty but for the view, all of it read-only; /tmp, /dev/shm and the folder of the
    result are in memory, each with a size. The options are in the file, which the command inherits by its number:
    anybody may read a command line, the solution and other users of this machine, and they name what is hidden.
    """
    with tempfile.TemporaryFile() as options:
        options.write(b"".join(os.fsencode(word) + b"\0" for word in (*_namespaces(), *_mounts(view, socket))))
        options.seek(0)
        yield [program() or "bwrap", "--args", str(options.fileno()), "--"], options.fileno()


def _namespaces() -> Iterator[str]:
    yield from ("--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
    yield from ("--hostname", "sandbox", "--die-with-parent", "--new-session", "--cap-drop", "ALL")
    if os.geteuid() == 0:
        # The init process changes its user with them, and has none from then on, nor can it gain any. A user namespace
        # would only give root another name: what belongs to root would stay the solution's to read.
        yield from ("--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID", "--cap-add", "CAP_SETPCAP")
    else:
        yield "--unshare-user"


def _mounts(view: View, socket: Path) -> Iterator[str]:
    for path, target in view.links:
        yield from ("--symlink", target, str(path))
    yield from ("--proc", "/proc", "--dev", "/dev")
    for place, count in (("/dev/shm", TEMPORARY_BYTES), ("/tmp", TEMPORARY_BYTES)):  # noqa: S108
        yield from ("--size", str(count), "--perms", "1777", "--tmpfs", place)
    # The outer ones first: the inner ones are mounted on top of them.
    for path in sorted(view.shown):
        for above in [*path.parents][-2::-1]:
            # Made by bubblewrap itself, they would be root's alone.
            yield from ("--perms", "0755", "--dir", str(above))
        yield from ("--ro-bind", str(path), str(path))
    for path in view.hidden:
        if path.is_dir():
            yield from ("--perms", "0555", "--size", "4096", "--tmpfs", str(path), "--remount-ro", str(path))
        else:
            yield from ("--ro-bind", "/dev/null", str(path))
    for path in (
        *INSIDE.parents,
        INSIDE,
        CODE_INSIDE,
        CODE_INSIDE / "benchbot",
        CODE_INSIDE / "benchbot" / "submission",
    ):
        yield from ("--perms", "0755", "--dir", str(path))
    for path in code_needed():
        yield from ("--ro-bind", str(path), str(CODE_INSIDE / path.relative_to(CODE)))
    yield from ("--ro-bind", str(socket), str(SOCKET_INSIDE))
    yield from ("--size", str(FOLDER_BYTES), "--perms", "0777", "--tmpfs", str(RESULT_INSIDE.parent))
    yield from ("--remount-ro", "/dev", "--remount-ro", "/")


class ResultPipe:
    """A pipe for the result, and the thread that writes its content into a file.

    A file of this machine could be filled by any process that got hold of it. Leaving the context completes the file at
    `path`; an empty pipe makes none.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._output, self.input = os.pipe()
        self._thread = threading.Thread(target=self._keep, name="benchbot-result", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def close_input(self) -> None:
        """Close this process's end, so that the sandbox alone holds the pipe open."""
        if self.input >= 0:
            os.close(self.input)
            self.input = -1

    def __exit__(self, *_error: object) -> None:
        self.close_input()
        self._thread.join(PIPE_TIMEOUT_S)  # the rest is in the pipe when the sandbox has ended

    def _keep(self) -> None:
        # One byte more than is read of it shows that it was too large.
        left = RESULT_MAX_BYTES + 1
        with os.fdopen(self._output, "rb", buffering=0) as output:
            first = output.read(CHUNK_BYTES)
            if not first:
                return
            with self._path.open("xb") as file:
                chunk = first
                while chunk:
                    file.write(chunk[:left])
                    left -= len(chunk[:left])
                    chunk = output.read(CHUNK_BYTES)
