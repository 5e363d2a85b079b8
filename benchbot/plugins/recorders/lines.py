"""A file of lines that are there as soon as they are written, and whole or not at all."""

from pathlib import Path


class LineFile:
    """A text file, begun anew. Every method raises OSError when the disk refuses; what was written before stays."""

    def __init__(self, path: Path, head: str = "") -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Without a buffer: what is written is the system's to keep, however this process ends.
        self._file = path.open("wb", buffering=0)
        self._head = head
        self._size = 0
        try:
            self.restart()
        except OSError:
            self._file.close()
            raise

    def restart(self) -> None:
        """Drop all lines but the head."""
        self._cut(0)
        if self._head:
            self.add(self._head)

    def add(self, line: str) -> None:
        """Append one line, or nothing of it."""
        data = memoryview(f"{line}\n".encode())
        try:
            left = data
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            self._cut(self._size)
            raise
        self._size += len(data)

    def close(self) -> None:
        """Close the file. Safe to call twice."""
        self._file.close()

    def _cut(self, size: int) -> None:
        self._file.truncate(size)
        self._file.seek(size)
        self._size = size
