"""The cache of compiled kernels between runs: Taichi reads it when it starts, and adds to it when it ends."""

import os
import select
import signal
import time
import warnings
from pathlib import Path
from typing import Any

LOCK = "ticache.lock"
LONGEST_LOCK_S = 60.0
LONGEST_SAVE_S = 10.0
WORTH_SAVING_S = 0.4
"""Compiling takes seconds; what takes less is finding kernels that are on disk, which counts as compiling, too."""
_saved_s = 0.0


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


def save(program: Any) -> None:
    """Write what a program has compiled to disk, if that is worth it: its process may be killed before it ends.

    Taichi 1.7 writes when a program ends, and offers no other way. So the program ends in a copy of this process, which
    takes hundredths of a second. The copy of a process that uses a GPU could not, as drivers do not follow into it.
    """
    global _saved_s
    compiling_s = program.get_total_compilation_time()
    if compiling_s - _saved_s < WORTH_SAVING_S:
        return
    _saved_s = compiling_s
    with warnings.catch_warnings():
        # Python warns of copies of processes with threads: this one runs nothing but Taichi's end.
        warnings.simplefilter("ignore", DeprecationWarning)
        copy = os.fork()
    if copy == 0:
        try:
            program.finalize()
        finally:
            os._exit(0)
    handle = os.pidfd_open(copy)
    try:
        if not select.select([handle], [], [], LONGEST_SAVE_S)[0]:
            os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)
    finally:
        os.close(handle)
