"""The way of a result out of a sandbox: copied from a file that the solution wrote into a pipe.

Whatever the solution put there is looked at with suspicion: no link is followed, nothing but a regular file is read,
and no more of it than was agreed.
"""

import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

CHUNK_BYTES = 2**20


@dataclass(frozen=True)
class Handover:
    """Copies the file `path` to the pipe `target`, if it has at most `max_bytes`."""

    path: str
    target: int
    max_bytes: int

    @classmethod
    def of(cls, document: dict[str, Any] | None) -> Self | None:
        """Return what a JSON document describes; the target is kept from the solution."""
        if document is None:
            return None
        os.set_inheritable(document["target"], False)
        return cls(**document)

    def hand_over(self) -> str | None:
        """Copy it; return why it was refused, or None when it was not, or there is none."""
        try:
            source = open_result(self.path, self.max_bytes)
        except FileNotFoundError:
            return None
        except OSError as error:
            return error.strerror or str(error)
        left = self.max_bytes
        while left and (chunk := os.read(source, min(left, CHUNK_BYTES))):
            left -= len(chunk)
            while chunk:
                chunk = chunk[os.write(self.target, chunk) :]
        os.close(source)
        return None


def open_result(path: str, max_bytes: int) -> int:
    """Return the open file; raises OSError when it is no regular file, a link, or has more than `max_bytes`."""
    try:
        # Non-blocking: a FIFO without a writer would be waited for.
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        if Path(path).is_symlink():
            raise OSError(error.errno, "it is a link, and links are not followed") from error
        raise
    about = os.fstat(handle)
    refused = None
    if not stat.S_ISREG(about.st_mode):
        refused = "it is no regular file"
    elif about.st_size > max_bytes:
        refused = f"it has {about.st_size} bytes, and at most {max_bytes} are read"
    if refused is not None:
        os.close(handle)
        raise OSError(0, refused)
    return handle
