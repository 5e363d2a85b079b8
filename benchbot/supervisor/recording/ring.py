"""A queue of fixed size in shared memory: regions are taken in order, and given back in the same order."""

from collections import deque

ALIGNMENT_BYTES = 64


class Ring:
    """Says where in a memory of `size_bytes` there is room. A queue that runs empty begins again at the start.

    So a queue that is never long touches only as much memory as it needs, however much passes through it.
    """

    def __init__(self, size_bytes: int) -> None:
        self.size_bytes = size_bytes
        self._taken: deque[tuple[int, int]] = deque()

    def __len__(self) -> int:
        return len(self._taken)

    def take(self, size_bytes: int) -> int | None:
        """Return the offset of a free region, which is then taken; None when there is no room for it."""
        size = aligned(max(size_bytes, 1))
        offset = self._free(size)
        if offset is not None:
            self._taken.append((offset, size))
        return offset

    def give_back(self) -> None:
        """Free the region that was taken first; raises IndexError when none is taken."""
        self._taken.popleft()

    def untake(self) -> None:
        """Free the region that was taken last; raises IndexError when none is taken."""
        self._taken.pop()

    def _free(self, size: int) -> int | None:
        if not self._taken:
            return 0 if size <= self.size_bytes else None
        first, (last, last_size) = self._taken[0][0], self._taken[-1]
        end = last + last_size
        if last < first:
            return end if end + size <= first else None
        if end + size <= self.size_bytes:
            return end
        return 0 if size <= first else None


def aligned(size_bytes: int) -> int:
    """Return the size rounded up to whole cache lines."""
    return -(-size_bytes // ALIGNMENT_BYTES) * ALIGNMENT_BYTES
