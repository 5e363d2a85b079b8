"""The folder that a container may write its result into, and the copy of the result out of it."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.submission.init.handover import open_result
from benchbot.submission.modes import RESULT, RESULT_MAX_BYTES

INODES = 1000
V2_RESULT = "benchbot_result"
"""The file that BenchBot v2's client saves its result to, by its name below /tmp; an empty one is none."""


@contextmanager
def outbox(exchange: Path, user: tuple[int, int]) -> Iterator[Path]:
    """Yield an empty folder for `user` to write into.

    Where we are root it is in memory and holds no more than a result may have: what a solution writes never reaches
    this machine's disk. Otherwise it is a folder in `exchange`, and it is the user's own disk that it could fill.
    Raises BenchbotError when root may not mount it.
    """
    folder = exchange / "outbox"
    folder.mkdir(mode=0o700)
    if os.geteuid() != 0:
        yield folder
        return
    room = f"size={RESULT_MAX_BYTES + 2**20},nr_inodes={INODES},mode=0700,uid={user[0]},gid={user[1]}"
    _run("mount", "-t", "tmpfs", "-o", f"nosuid,nodev,noexec,{room}", "benchbot", str(folder))
    try:
        yield folder
    finally:
        # Lazily: an engine that ends slowly may still use it.
        _run("umount", "--lazy", str(folder))


def v2_result(folder: Path, user: tuple[int, int] | None) -> Path:
    """Make the empty file in an outbox that BenchBot v2's client writes to; None is the user of this process."""
    path = folder / V2_RESULT
    path.touch(0o600)
    if user is not None:
        os.chown(path, *user)
    return path


def take(folder: Path, target: Path) -> str | None:
    """Copy the result out of the folder, once the container has ended; return why it was refused, if it was.

    No link is followed, nothing but a regular file is read, and no more than a result may have.
    """
    try:
        source = open_result(str(folder / RESULT), RESULT_MAX_BYTES)
    except FileNotFoundError:
        saved_as_v2_does = os.path.lexists(folder / V2_RESULT) and (folder / V2_RESULT).lstat().st_size
        if not saved_as_v2_does:
            return None
        (folder / V2_RESULT).rename(folder / RESULT)
        return take(folder, target)
    except OSError as error:
        return error.strerror or str(error)
    with os.fdopen(source, "rb") as file, target.open("xb") as copy:
        shutil.copyfileobj(file, copy)
    return None


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BenchbotError(
            "There is no safe place for what the solution writes.",
            f"'{command[0]}' says: {done.stderr.strip()}",
            "Run it as an ordinary user, or as root with the right to mount (CAP_SYS_ADMIN).",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )
