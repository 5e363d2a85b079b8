"""The process that writes a run's recordings: it takes steps out of shared memory, one after the other.

It yields to everything else on the machine, and finishes the recordings also when the supervisor was killed.
"""

import gc
import json
import mmap
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot.core.recording import Noted
from benchbot.supervisor.platform.messages import Failed
from benchbot.supervisor.recording.messages import DOCUMENTS, DROPPED, ENTRY, HURRY_AT, RESET, STEP, TOOK, Entry, unpack

NICENESS = 10


class Writer:
    """Passes entries of the queue on to recordings, and reports to the supervisor."""

    def __init__(self, replies: int, memory: mmap.mmap) -> None:
        self._replies = replies
        self._memory = memory
        self._recordings: list[Noted] = []

    def begin(self, folders: Mapping[str, str]) -> bool:
        """Begin the recordings; False when one cannot begin."""
        try:
            for name, folder in folders.items():
                recording = plugin_manager.load().record("recorders", name).create(Path(folder))
                self._recordings.append(Noted(name, recording, Path(folder)))
        except BenchbotError as error:
            self._say({"refused": msgspec.to_builtins(Failed.of(error))})
            return False
        self._say({"started": True})
        return True

    def write(self, entries: Iterator[Entry]) -> None:
        """Write until the queue is closed, as it also is when the supervisor is gone."""
        skipped = 0
        for entry in entries:
            if entry.kind == RESET:
                skipped = 0
                self._tell(recording.reset() for recording in self._recordings)
            elif self._memory[HURRY_AT]:
                skipped += entry.kind == STEP
            elif entry.kind in DOCUMENTS:
                document = json.loads(self._memory[entry.offset : entry.offset + entry.size])
                self._send(TOOK)
                self._tell(recording.told(DOCUMENTS[entry.kind], document) for recording in self._recordings)
            else:
                step = unpack(self._memory, entry.offset, entry.size)
                # From here on its place is free: what takes long is the writing.
                self._send(TOOK)
                self._tell(recording.step(*step, entry.dropped) for recording in self._recordings)
        (dropped,) = DROPPED.unpack_from(self._memory)
        self._tell(recording.close(dropped + skipped) for recording in self._recordings)
        self._say({"closed": True})

    def _tell(self, ended: Iterator[BenchbotError | None]) -> None:
        for error in ended:
            if error is not None:
                self._say({"failed": f"{error.title} {error.why}"})

    def _say(self, message: dict[str, Any]) -> None:
        self._send(json.dumps(message).encode())

    def _send(self, line: bytes) -> None:
        # A supervisor that was killed does not listen; what it has observed is written all the same.
        with suppress(BrokenPipeError):
            os.write(self._replies, line + b"\n")


def main() -> int:
    """Write recordings until the queue is closed."""
    entries, replies, memory = map(int, sys.argv[1:4])
    os.nice(NICENESS)
    writer = Writer(replies, mmap.mmap(memory, os.fstat(memory).st_size, access=mmap.ACCESS_READ))
    if not writer.begin(json.loads(sys.argv[4])):
        return 1
    writer.write(_read(entries))
    return 0


def _read(pipe: int) -> Iterator[Entry]:
    while len(data := os.read(pipe, ENTRY.size)) == ENTRY.size:
        yield Entry(*ENTRY.unpack(data))


if __name__ == "__main__":
    ended = main()
    gc.freeze()  # what a dying process holds need not be searched for garbage
    sys.exit(ended)
