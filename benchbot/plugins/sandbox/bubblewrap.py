"""The command of bubblewrap (https://github.com/containers/bubblewrap) that a sandboxed solution's leader runs in."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from benchbot.plugins.sandbox.view import View, code_needed
from benchbot.submission.limits import TEMPORARY_BYTES
from benchbot.submission.modes import RESULT, RESULT_MAX_BYTES
from benchbot.submission.solution import CODE

INSIDE = Path("/run/benchbot")
CODE_INSIDE = INSIDE / "code"
SOCKET_INSIDE = INSIDE / "supervisor.sock"
RESULT_INSIDE = INSIDE / "result" / RESULT
FOLDER_BYTES = 2 * RESULT_MAX_BYTES
"""How much the folder of the result holds: more than is read of it, so that too much can be told from a full disk."""
PROBE_TIMEOUT_S = 30.0


def program() -> str | None:
    """Return where bubblewrap is; None where it is not installed."""
    return shutil.which("bwrap")


def problem() -> str | None:
    """Return why bubblewrap cannot make a sandbox on this machine; None when it can."""
    bwrap = program()
    if bwrap is None:
        return "bubblewrap is not installed"
    words = [bwrap, *_namespaces(), "--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--", "/bin/true"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=PROBE_TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"bubblewrap does not run: {error}"
    return None if done.returncode == 0 else f"bubblewrap failed: {done.stderr.strip()}"


def command(view: View, socket: Path) -> list[str]:
    """Return the words that come before the leader's: namespaces of its own, and what it sees of the files.

    The root of the file system is empty but for the view, all of it read-only; /tmp, /dev/shm and the folder of the
    result are in memory, each with a size.
    """
    return [program() or "bwrap", *_namespaces(), *_mounts(view, socket), "--"]


def _namespaces() -> Iterator[str]:
    yield from ("--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
    yield from ("--hostname", "sandbox", "--die-with-parent", "--new-session", "--cap-drop", "ALL")
    if os.geteuid() == 0:
        # The leader becomes somebody else with them, and has none from then on. A namespace of users would only give
        # root another name: what belongs to root would stay the solution's to read.
        yield from ("--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID")
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
