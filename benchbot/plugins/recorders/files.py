"""The files that recorders write: errors of the disk as BenchbotErrors, and files of whole lines."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass


@contextmanager
def disk_errors(what: str, folder: Path) -> Iterator[None]:
    """Raise BenchbotError for an OSError within; `what` are the things in `folder`, in the plural."""
    try:
        yield
    except OSError as error:
        raise BenchbotError(
            f"The {what} in {folder} cannot be written.",
            f"{error.strerror or error}.",
            "Make room, or record into a folder on a disk that has some and that you may write to.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        ) from error


class LineFile:
    """A text file, begun anew, whose lines are on the disk at once, and whole or not at all.

    Every method raises BenchbotError for `what` when the disk refuses; earlier lines stay.
    """

    def __init__(self, what: str, path: Path, head: str = "") -> None:
        self._what = what
        self._folder = path.parent
        self._head = head
        self._size = 0
        with disk_errors(what, self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)
            # Without a buffer: the system keeps a written line, however this process ends.
            self._file = path.open("wb", buffering=0)
        try:
            self.restart()
        except BenchbotError:
            self._file.close()
            raise

    def restart(self) -> None:
        """Drop all lines but the head."""
        with disk_errors(self._what, self._folder):
            self._cut(0)
        if self._head:
            self.add(self._head)

    def add(self, line: str) -> None:
        """Append one line, or nothing of it."""
        data = memoryview(f"{line}\n".encode())
        with disk_errors(self._what, self._folder):
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
