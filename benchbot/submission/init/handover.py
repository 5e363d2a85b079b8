"""The transfer of a result out of a sandbox: from the file that the solution wrote into a pipe.

The file is not trusted: no link is followed, nothing but a regular file is read, and no more of it than is allowed.
"""

import os
import stat
from pathlib import Path

CHUNK_BYTES = 2**20


def hand_over(path: str, target: int, max_bytes: int) -> str | None:
    """Copy the file `path` to the pipe `target`; return why it was refused, or None if it was not or there is none."""
    try:
        source = open_result(path, max_bytes)
    except FileNotFoundError:
        return None
    except OSError as error:
        return error.strerror or str(error)
    left = max_bytes
    while left and (chunk := os.read(source, min(left, CHUNK_BYTES))):
        left -= len(chunk)
        while chunk:
            chunk = chunk[os.write(target, chunk) :]
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
