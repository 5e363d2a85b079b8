"""The output of a solution: the log of its prints, and the exchange folder with the result that it wrote there.

Results are read defensively, since their author may want to mislead the reader.
"""

import json
import os
import tempfile
from codecs import getincrementaldecoder
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, Self

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission.init.handover import open_result
from benchbot.submission.limits import size
from benchbot.submission.modes import RESULT_MAX_BYTES
from benchbot.wire import run_state
from benchbot.wire.run_state import Connection

LOG_NAME = "solution.log"
CUT_BYTES = 4096
"""A line's end is looked for so near to where a log is cut."""
CONTINUATION = bytes(range(0x80, 0xC0))
"""The bytes of UTF-8 that begin no character."""
MAX_DEPTH = 100
_TOO_DEEP = f"It has lists and objects in more than {MAX_DEPTH} others."


class CappedLog:
    """A log file that keeps the beginning and the end of long output, and says between them how much is left out.

    It has at most `limit_bytes`, and a chunk for a moment. Half of that is the beginning; the end is cut to a quarter
    whenever it has grown to the other half. Cuts are made between lines, or at least between characters of UTF-8.
    """

    def __init__(self, path: Path, limit_bytes: int) -> None:
        self._file = open(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b", buffering=0)  # noqa: SIM115, PTH123
        self._limit = limit_bytes
        self._start = self._end = self._file.seek(0, os.SEEK_END)
        self._head = self._tail = self._left_out = 0
        """The bytes where the beginning ends, and where the end begins; both are 0 while nothing is left out."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._file.close()

    def write(self, chunk: bytes) -> None:
        """Append a chunk; on a full disk it is lost, since a solution must not wait for room."""
        with suppress(OSError, ValueError):
            self._file.seek(self._end)
            self._end += self._file.write(chunk)
            if self._end - self._start > self._limit:
                self._cut()

    def _cut(self) -> None:
        if not self._tail:
            middle = self._start + self._limit // 2
            self._head = middle - _torn_end(self._read(max(self._start, middle - CUT_BYTES), middle))
            self._tail = self._head
        tail = max(self._end - self._limit // 4, self._tail)
        tail += _torn_start(self._read(tail, min(tail + CUT_BYTES, self._end)))
        left_out = self._left_out + tail - self._tail
        note = f"\n[{left_out} bytes are left out here: --log-limit is {size(self._limit)}]\n".encode()
        kept = note + self._read(tail, self._end)
        self._file.seek(self._head)
        self._end = self._head + self._file.write(kept)
        self._file.truncate(self._end)
        self._tail, self._left_out = self._head + len(note), left_out

    def _read(self, start: int, end: int) -> bytes:
        self._file.seek(start)
        return self._file.read(end - start)


def _torn_end(data: bytes) -> int:
    """Return how many bytes follow the last line's end; without one, how many are of a character that is cut."""
    if b"\n" in data:
        return len(data) - data.rfind(b"\n") - 1
    decoder = getincrementaldecoder("utf-8")("ignore")
    decoder.decode(data)
    return len(decoder.getstate()[0])


def _torn_start(data: bytes) -> int:
    """Return how many bytes there are up to the first line's end; without one, how many are of a cut character."""
    return data.find(b"\n") + 1 or len(data[:3]) - len(data[:3].lstrip(CONTINUATION))


def output_log(connection: Connection, limit_bytes: int) -> CappedLog:
    """Return the log in the run's folder of what a solution prints; without a local folder, one that keeps nothing."""
    address = connection.url, connection.socket
    alive = [(state.connection, state.folder) for state in run_state.live()]
    folders = [Path(folder) for there, folder in alive if (there.url, there.socket) == address]
    with suppress(OSError):
        return CappedLog(folders[0] / LOG_NAME if folders else Path(os.devnull), limit_bytes)
    return CappedLog(Path(os.devnull), limit_bytes)


@contextmanager
def exchange_folder() -> Iterator[Path]:
    """Yield a fresh folder (0700), which is removed in the end with everything that a solution has put into it."""
    folder = Path(tempfile.mkdtemp(prefix="benchbot-"))
    try:
        yield folder
    finally:
        remove(folder)


def remove(folder: Path) -> None:
    """Remove a folder, however deep it is: `shutil.rmtree` gives up at a thousand levels, and so do paths.

    Folders two levels down are moved up before their parents are removed. Files of another user may stay.
    """
    numbers = count()
    # With links and files gone at once, every round leaves less, or nothing can be done any more.
    while _flattened(folder, numbers):
        pass
    with suppress(OSError):
        folder.rmdir()


def _flattened(folder: Path, numbers: "count[int]") -> bool:
    """Remove one level of folders; return whether there was one, and it could be removed."""
    changed = False
    for entry in list(os.scandir(folder)):
        if not entry.is_dir(follow_symlinks=False):
            with suppress(OSError):
                Path(entry).unlink()
            continue
        with suppress(OSError):
            Path(entry).chmod(0o700)
            for inner in list(os.scandir(entry)):
                if inner.is_dir(follow_symlinks=False):
                    # To rename a folder, one must be able to write to it.
                    Path(inner).chmod(0o700)
                    free = (folder / f"benchbot-removing-{number}" for number in numbers)
                    Path(inner).rename(next(path for path in free if not os.path.lexists(path)))
                else:
                    Path(inner).unlink()
            Path(entry).rmdir()
            changed = True
    return changed


def read_result(path: Path) -> dict[str, Any]:
    """Return a solution's result, one JSON object.

    Raises BenchbotError (failure `agent`) when there is none, and for anything but a regular file, one that is larger
    than `RESULT_MAX_BYTES`, something that is not JSON, and lists and objects in more than `MAX_DEPTH` others.
    """
    try:
        handle = open_result(str(path), RESULT_MAX_BYTES)
    except FileNotFoundError as error:
        raise BenchbotError(
            "The solution saved no result.",
            "It ended well, but wrote nothing where BENCHBOT_RESULT says.",
            "Save one: in Agent.save_result, or in a loop of your own, to BenchBot.result_filename.",
            failure=FailureClass.AGENT,
        ) from error
    except OSError as error:
        raise _unreadable(f"{error.strerror or error}.") from error
    with os.fdopen(handle, "rb") as file:
        data = file.read(RESULT_MAX_BYTES + 1)
    if len(data) > RESULT_MAX_BYTES:
        raise _unreadable(f"It has more than {RESULT_MAX_BYTES} bytes.")
    try:
        document = json.loads(data.decode("utf-8"))
    except json.JSONDecodeError as error:
        raise _unreadable(f"result:{error.lineno}: not valid JSON: {error.msg}.") from error
    except ValueError as error:
        # Not UTF-8, or an integer of more than 4300 digits (sys.set_int_max_str_digits).
        raise _unreadable(f"{error}.") from error
    except RecursionError as error:
        raise _unreadable(_TOO_DEEP) from error
    if not isinstance(document, dict):
        raise _unreadable(f"It holds a {type(document).__name__}.")
    if _is_deeper(document, MAX_DEPTH):
        raise _unreadable(_TOO_DEEP)
    return document


def refused_result(why: str) -> BenchbotError:
    """Return the error of a result that was not taken out of a sandbox or container."""
    return BenchbotError(
        "The solution's result was refused.",
        f"{why[0].upper()}{why[1:].rstrip('.')}. A result is a regular file of at most {size(RESULT_MAX_BYTES)}.",
        "Write it with json.dump to the file that BENCHBOT_RESULT names.",
        failure=FailureClass.AGENT,
    )


def _is_deeper(document: Any, limit: int) -> bool:
    level = [document]
    for _ in range(limit):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True


def _unreadable(why: str) -> BenchbotError:
    return BenchbotError(
        "The solution's result cannot be read.",
        f"{why[0].upper()}{why[1:]}",
        "Write it with json.dump, as one JSON object.",
        failure=FailureClass.AGENT,
    )
