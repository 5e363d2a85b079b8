"""What a solution prints, kept in its run's folder, so that whoever looks on can read it."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from benchbot.wire import run_state
from benchbot.wire.run_state import Connection

NAME = "solution.log"
MOST_BYTES = 16 * 2**20


class OutputLog:
    """A file that takes what a solution prints, up to a size; nothing where the run has no folder on this machine."""

    def __init__(self, folder: Path | None) -> None:
        self._left_bytes = MOST_BYTES
        self._file: IO[bytes] | None = None
        if folder is not None:
            with suppress(OSError):
                self._file = (folder / NAME).open("ab", buffering=0)

    @classmethod
    def of(cls, connection: Connection) -> Self:
        """Return the log of the run that a connection leads to."""
        folders = [Path(state.folder) for state in run_state.live() if state.connection.token == connection.token]
        return cls(next(iter(folders), None))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()

    def write(self, chunk: bytes) -> None:
        """Keep what was printed, as long as there is room; on a full disk it is lost."""
        if self._file is not None and self._left_bytes > 0:
            with suppress(OSError, ValueError):
                self._left_bytes -= self._file.write(chunk[: self._left_bytes])
