"""Memory: no episode begins while less of it is free than the last ones took beside what is loaded already."""

import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from benchbot.plugins.batch import capacity

POLL_S = 1.0
SAMPLE_PERIOD_S = 1.0
LAST = 5
"""So many episodes are remembered."""
LONGEST_S = 600.0
"""So long room is waited for. Then the episode begins: to be killed for want of memory is survived, to stand is not."""

_PROC = Path("/proc")


class MemoryWatch:
    """How much the process tree of a worker takes: itself, the simulator that it keeps, and the solution."""

    def __init__(self, root: int) -> None:
        self._root = root
        self._peaks: deque[int] = deque(maxlen=LAST)
        self._sampled_s = float("-inf")

    def begin(self) -> None:
        """Remember the episode that follows apart from those before it."""
        self._peaks.append(0)

    def sample(self) -> None:
        """Look at the tree, once in a while: call it as often as you like."""
        now_s = time.monotonic()
        if now_s - self._sampled_s >= SAMPLE_PERIOD_S:
            self._sampled_s = now_s
            self._peaks[-1] = max(self._peaks[-1], tree_bytes(self._root))

    @property
    def needed_bytes(self) -> int:
        """What the next episode takes beside what the tree has now, if it is like the last ones; 0: not known."""
        return max(0, max(self._peaks, default=0) - tree_bytes(self._root))

    def wait_for_room(self, is_wanted: Callable[[], bool], tell: Callable[[int, int], None]) -> None:
        """Return when there is room, or nobody waits any more; `tell` is called once, with free and needed bytes."""
        deadline_s = time.monotonic() + LONGEST_S
        told = False
        while is_wanted() and time.monotonic() < deadline_s:
            free, needed = capacity.free_memory_bytes(), self.needed_bytes
            if free is None or free >= needed:
                return
            if not told:
                tell(free, needed)
                told = True
            time.sleep(POLL_S)


def tree_bytes(process: int) -> int:
    """Return how much memory a process and its descendants have for themselves; 0 where that cannot be told."""
    return sum(_own_bytes(number) for number in _tree(process))


def _tree(process: int) -> Iterator[int]:
    yield process
    with suppress(OSError):
        for children in (_PROC / str(process) / "task").glob("*/children"):
            with suppress(OSError):
                for child in children.read_text("utf-8").split():
                    yield from _tree(int(child))


def _own_bytes(process: int) -> int:
    """Return resident memory without what is mapped from files or shared (proc(5), statm)."""
    try:
        _, resident, shared, *_ = (_PROC / str(process) / "statm").read_text("utf-8").split()
    except (OSError, ValueError):
        return 0
    return (int(resident) - int(shared)) * os.sysconf("SC_PAGE_SIZE")
