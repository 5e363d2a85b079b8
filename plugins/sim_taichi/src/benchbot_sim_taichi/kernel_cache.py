"""The cache of compiled kernels between runs; Taichi reads it when it starts and adds to it when it ends."""

import time
from pathlib import Path

LOCK = "ticache.lock"
LONGEST_LOCK_S = 60.0


def prepare(cache_dir: Path) -> Path:
    """The folder of compiled kernels in `cache_dir`, made when it is not there.

    Taichi locks it while it reads or writes, which takes milliseconds. A process that was killed just then has left its
    lock, for which every later one would wait and then compile all kernels itself: a lock that old is taken away.
    """
    folder = cache_dir / "kernels"
    folder.mkdir(parents=True, exist_ok=True)
    lock = folder / LOCK
    try:
        age_s = time.time() - lock.stat().st_mtime
    except FileNotFoundError:
        return folder
    if age_s > LONGEST_LOCK_S:
        lock.unlink(missing_ok=True)
    return folder
