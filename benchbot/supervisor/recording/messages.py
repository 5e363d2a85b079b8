"""The messages between the supervisor and the process that writes its recordings, in shared memory and pipes.

The memory that they share begins with 64 bytes: whether to hurry (1), and from byte 8 on how many steps were dropped
since the last reset (8, little-endian). The queue lies behind. Through a pipe go its entries, `(kind, offset, size,
dropped)`, 25 bytes each; the end of the pipe is that of the recordings. A step is its arrays, then a MessagePack
message with their places, counted from the start of the step, then the length of the message (8, little-endian).
A result and the run in the queue are JSON.

From the process come lines of JSON: `{"started": true}` or `{"refused": …}`, `{"took": 1}` for each step that it has
copied, `{"failed": "why"}` for a recording that has ended, `{"closed": true}`.
"""

import math
import mmap
import struct
import time
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.progress import Progress, Step
from benchbot.wire import encoding
from benchbot.wire.arena import Layout, aligned

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP, RESET, RESULT, RUN = range(4)
DOCUMENTS = {RESULT: "result", RUN: "run"}
HEADER_BYTES = 64
HURRY_AT = 0
DROPPED = struct.Struct("<8xQ")
TOOK = b'{"took": 1}'
ENTRY = struct.Struct("<BQQQ")
_MESSAGE_SIZE = struct.Struct("<Q")


class Entry(NamedTuple):
    """One entry of the queue; `dropped` is how many steps had no place in it since the last reset."""

    kind: int
    offset: int
    size: int
    dropped: int


class RecordedStep(NamedTuple):
    """The arguments of `Recording.step`."""

    action: str | None
    arguments: Mapping[str, Any]
    step: Step
    progress: Progress


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


class Parcel:
    """A step on its way into shared memory."""

    def __init__(self, step: RecordedStep) -> None:
        self._layout = Layout(0)
        # Not by `encoding.encode`: this is done while a step waits, and what is checked there has been checked before.
        self._message = msgspec.msgpack.Encoder(enc_hook=self._placed).encode((step, time.monotonic()))
        self.size_bytes = self._layout.end + len(self._message) + _MESSAGE_SIZE.size

    def write(self, memory: mmap.mmap, offset: int) -> None:
        """Copy it into a region that begins at `offset`: the only copy that is made while the step waits."""
        self._layout.write(memory, offset)
        start = offset + self._layout.end
        memory[start : start + len(self._message)] = self._message
        _MESSAGE_SIZE.pack_into(memory, start + len(self._message), len(self._message))

    def _placed(self, value: Any) -> Any:
        if encoding.is_scalar(value):
            return value.item()
        if not encoding.is_array(value) or value.dtype.str not in encoding.DTYPES:
            raise BenchbotError(
                f"A {type(value).__name__} cannot be recorded.",
                "An observation is made of dicts, lists, strings, numbers and arrays of numbers.",
                "Report it to the author of the simulator or driver.",
                failure=FailureClass.PLATFORM,
            )
        return encoding.place_of(value.dtype.str, value.shape, self._layout.add(value))


def unpack(memory: mmap.mmap, offset: int, size: int) -> RecordedStep:
    """Return the step that lies in a region, with copies of its arrays; raises msgspec.DecodeError when it is none."""
    end = offset + size - _MESSAGE_SIZE.size
    (length,) = _MESSAGE_SIZE.unpack_from(memory, end)

    import numpy as np

    def array(_code: int, place: memoryview) -> "NDArray[Any]":
        dtype, shape, start = encoding.decode_place(place)
        if 0 in shape:
            return np.empty(shape, dtype)
        return np.frombuffer(memory, dtype, math.prod(shape), offset + start).reshape(shape).copy()

    message = memory[end - length : end]
    step, sent_s = msgspec.msgpack.decode(message, type=tuple[RecordedStep, float], ext_hook=array)
    # What waits in the queue must not count as time of the run: `wall_time_s` is what it was.
    step.progress.started_s += time.monotonic() - sent_s
    return step
