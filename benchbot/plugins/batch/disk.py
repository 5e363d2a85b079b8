"""Room on the disk: no episode begins without it, and what does not fit waits, rather than being lost."""

import errno
import shutil
import time
from collections.abc import Callable
from pathlib import Path

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
POLL_S = 1.0


def free_bytes(folder: Path) -> int:
    """Return how many bytes are free where a folder is."""
    return shutil.disk_usage(folder).free


def is_full(error: OSError) -> bool:
    """Say whether an error is about room on the disk, a quota or a limit of a file's size."""
    return error.errno in FULL


def wait_for_room(
    folder: Path, minimum_bytes: int, is_wanted: Callable[[], bool], tell: Callable[[Path, int], None]
) -> None:
    """Return when there is room, or nobody waits any more; `tell` is called once, with folder and free bytes.

    Nothing but looking: whoever makes room need tell nobody.
    """
    told = False
    while is_wanted() and (free := free_bytes(folder)) < minimum_bytes:
        if not told:
            tell(folder, free)
            told = True
        time.sleep(POLL_S)
