"""A result's way out of a sandbox: a pipe, since a file of this machine could be filled by whoever got hold of it."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.submission.modes import RESULT_MAX_BYTES

CHUNK_BYTES = 2**20
LAST_TIMEOUT_S = 15.0
"""How long the last of a result may take that is in the pipe when the sandbox has gone: it is 64 KiB at most."""


class ResultPipe:
    """A pipe to write a result to, and the thread that puts what comes out of it into a file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._output, self.input = os.pipe()
        self._thread = threading.Thread(target=self._keep, name="benchbot-result", daemon=True)
        self._thread.start()

    def close_input(self) -> None:
        """Close this process's end: what holds another one is the sandbox alone."""
        if self.input >= 0:
            os.close(self.input)
            self.input = -1

    def close(self) -> None:
        """Wait for the last of the result, which is there when the sandbox is gone."""
        self.close_input()
        self._thread.join(LAST_TIMEOUT_S)

    def _keep(self) -> None:
        # One byte more than is read of it tells that there was too much.
        left = RESULT_MAX_BYTES + 1
        with os.fdopen(self._output, "rb", buffering=0) as output:
            first = output.read(CHUNK_BYTES)
            if not first:
                return
            with self._path.open("xb") as file:
                chunk = first
                while chunk:
                    file.write(chunk[:left])
                    left -= len(chunk[:left])
                    chunk = output.read(CHUNK_BYTES)


@contextmanager
def result_pipe(path: Path) -> Iterator[ResultPipe]:
    """Yield a pipe whose content is in the file `path` afterwards; without any there is no file."""
    pipe = ResultPipe(path)
    try:
        yield pipe
    finally:
        pipe.close()
