"""Atomic writing: a file is there whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass


def write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all; see `writing`."""
    with writing(path) as file:
        file.write(content)


@contextmanager
def writing(path: Path) -> Iterator[IO[bytes]]:
    """Yield a temporary file beside `path`, flushed to disk and renamed over it on leaving; makes its folder.

    Raises OSError when it cannot be written. `path` is then as it was, as it is after any other error.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes private files; this one is as readable as any other file of the user.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def cannot_write(path: Path, error: OSError) -> BenchbotError:
    """Return the error of a file that cannot be written."""
    return BenchbotError(
        f"Cannot write {path}.",
        error.strerror or str(error),
        "Free some disk space, or choose a file in a folder that you may write to.",
        failure=FailureClass.INFRASTRUCTURE,
        exit_code=ExitCode.INTERNAL,
    )


def write_text(path: Path, text: str) -> None:
    """Write a text atomically, UTF-8; raises BenchbotError when it cannot be written, `path` is then as it was."""
    try:
        write(path, text.encode())
    except OSError as error:
        raise cannot_write(path, error) from error
