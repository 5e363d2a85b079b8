"""Compiled kernels are kept on disk, by whichever processes, and found there again."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from benchbot_sim_taichi import kernel_cache as kept
from tests.ray_tracing import WARM

WITHOUT_HASTE = "import benchbot_sim_taichi._front_end as front_end; front_end.hasten = lambda taichi: None; " + WARM


def kernels(cache: Path) -> dict[str, int]:
    """When each compiled kernel was written, by the hash that it is found by."""
    return {path.name: path.stat().st_mtime_ns for path in (cache / "kernels").glob("T*.tic")}


def warm(cache: Path, script: str = WARM) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", script, str(cache)])


def test_several_processes_may_fill_the_cache_at_once(tmp_path: Path, kernel_cache: Path) -> None:
    processes = [warm(tmp_path) for _ in range(2)]
    assert [process.wait() for process in processes] == [0, 0]
    filled = kernels(tmp_path)
    assert filled.keys() <= kernels(kernel_cache).keys(), "where other tests of this process may have added theirs"
    assert warm(tmp_path).wait() == 0
    assert kernels(tmp_path) == filled, "all that were asked for were there"


def test_kernels_are_the_same_for_any_number_of_threads(tmp_path: Path, kernel_cache: Path) -> None:
    cache = tmp_path / "cache"
    shutil.copytree(kernel_cache, cache)
    before = kernels(cache)
    for threads in ("1", "3"):
        command = [sys.executable, "-c", WARM, str(cache)]
        subprocess.run(command, env={**os.environ, "TI_CPU_MAX_NUM_THREADS": threads}, check=True)
    assert kernels(cache) == before, "workers of few threads find those of a machine with many"


def test_kernels_are_the_same_whether_or_not_taichis_front_end_is_hastened(tmp_path: Path, kernel_cache: Path) -> None:
    cache = tmp_path / "cache"
    shutil.copytree(kernel_cache, cache)
    before = kernels(cache)
    assert warm(cache, WITHOUT_HASTE).wait() == 0
    assert kernels(cache) == before


def test_the_lock_of_a_process_that_was_killed_while_it_wrote_is_taken_away(tmp_path: Path) -> None:
    lock = kept.prepare(tmp_path) / kept.LOCK
    lock.touch()
    kept.prepare(tmp_path)
    assert lock.exists(), "whoever made it may still be writing"
    long_ago = time.time() - 2 * kept.LONGEST_LOCK_S
    os.utime(lock, (long_ago, long_ago))
    kept.prepare(tmp_path)
    assert not lock.exists()
