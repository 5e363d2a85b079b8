"""Shared memory for arrays, with no name and so nothing to leak: an anonymous file that the platform's process writes.

The supervisor made it, and reads it; a client of the same user may, too (docs/wire.md). When the last of them is gone,
so is the memory. It begins with 64 bytes: a nonce (16), by which a client knows that it has opened the right file, and
a sequence number (8, little-endian), which is odd while arrays are being written and grows by 2 with every writing.
"""

import fcntl
import math
import mmap
import os
import secrets
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # where no array is looked at, numpy is not imported
    from numpy.typing import NDArray

NAME = "benchbot-arena"
ALIGNMENT_BYTES = 64
HEADER_BYTES = 64
NONCE_BYTES = 16
_SEQUENCE = struct.Struct("<Q")


def create() -> int:
    """Return the descriptor of a new anonymous file that holds a header and no arrays."""
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create(NAME, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        # A file that cannot shrink cannot take mapped pages away from a reader (SIGBUS).
        fcntl.fcntl(handle, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
        # Another process can open it for reading only: the child writes through the descriptor that it inherits.
        os.fchmod(handle, 0o400)
    else:
        import tempfile

        with tempfile.TemporaryFile() as file:
            handle = os.dup(file.fileno())
    os.ftruncate(handle, mmap.PAGESIZE)
    os.pwrite(handle, secrets.token_bytes(NONCE_BYTES), 0)
    return handle


class Layout:
    """Places for arrays in shared memory, one after the other from `start` on, in bytes."""

    def __init__(self, start: int = HEADER_BYTES) -> None:
        self.end = start
        self._arrays: list[tuple[int, NDArray[Any]]] = []

    def add(self, array: "NDArray[Any]") -> int:
        """Return the offset at which an array will lie."""
        offset, self.end = self.end, self.end + aligned(array.nbytes)
        self._arrays.append((offset, array))
        return offset

    def write(self, memory: mmap.mmap, base: int = 0) -> None:
        """Copy the arrays in C order to their places, counted from byte `base` on."""
        import numpy as np

        for offset, array in self._arrays:
            if array.size:
                target = np.frombuffer(memory, array.dtype, array.size, base + offset).reshape(array.shape)
                np.copyto(target, array)


def aligned(size_bytes: int) -> int:
    """Return the size rounded up to whole cache lines."""
    return -(-size_bytes // ALIGNMENT_BYTES) * ALIGNMENT_BYTES


class ArenaWriter:
    """The child's end: writes arrays, and grows the file when they do not fit."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._map = mmap.mmap(handle, os.fstat(handle).st_size)
        (self._sequence,) = _SEQUENCE.unpack_from(self._map, NONCE_BYTES)

    def write(self, layout: Layout) -> None:
        """Write a layout's arrays, if there are any, over those that were written before."""
        if layout.end == HEADER_BYTES:
            return
        if len(self._map) < layout.end:
            os.ftruncate(self._handle, layout.end)
            self._map = mmap.mmap(self._handle, layout.end)
        self._count()
        layout.write(self._map)
        self._count()

    def _count(self) -> None:
        self._sequence += 1
        _SEQUENCE.pack_into(self._map, NONCE_BYTES, self._sequence)


class ArenaReader:
    """The end of the supervisor or of a client: looks at arrays, or copies them out.

    Raises ValueError for a file that is too short to be an arena. The descriptor is the caller's to close.
    """

    def __init__(self, handle: int) -> None:
        self.handle = handle
        self._address: int | None = None  # of the map, once somebody asks where in it an array lies
        self._remap(os.fstat(handle).st_size)
        self.nonce = self._map[:NONCE_BYTES].hex()
        """The nonce, as hexadecimal digits."""

    @property
    def sequence(self) -> int:
        """The number of the last writing; odd while it is under way."""
        number: int = _SEQUENCE.unpack_from(self._map, NONCE_BYTES)[0]
        return number

    def view(self, dtype: str, shape: Sequence[int], offset: int) -> "NDArray[Any]":
        """Return the array at an offset, read-only, as long as nothing else is written.

        Raises ValueError when it lies outside of the memory.
        """
        import numpy as np

        kind = np.dtype(dtype)
        if kind.hasobject or offset < HEADER_BYTES or min(shape, default=0) < 0:
            raise ValueError(f"not an array: {dtype} {list(shape)} at {offset}")
        count = math.prod(shape)
        end = offset + count * kind.itemsize
        if end > len(self._map):
            self._remap(os.fstat(self.handle).st_size)
        if end > len(self._map):
            raise ValueError(f"the array ends at byte {end} of {len(self._map)}")
        if count == 0:
            return np.empty(tuple(shape), kind)
        return np.ndarray(shape, kind, self._map, offset)

    def read(self, dtype: str, shape: Sequence[int], offset: int) -> "NDArray[Any]":
        """Return a copy of the array at an offset; raises ValueError when it lies outside of the memory."""
        return self.view(dtype, shape, offset).copy()

    def offset_of(self, array: "NDArray[Any]") -> int | None:
        """Return where an array lies, or None when it is not a contiguous part of this memory."""
        import numpy as np

        if self._address is None:
            self._address = np.frombuffer(self._map, np.uint8).__array_interface__["data"][0]
        address: int = array.__array_interface__["data"][0]
        offset = address - self._address
        inside = offset >= HEADER_BYTES and offset + array.nbytes <= len(self._map)
        return offset if inside and array.nbytes and array.flags.c_contiguous else None

    def close(self) -> None:
        """Let go of the memory; raises BufferError while views of it are in use."""
        self._map.close()

    def _remap(self, size: int) -> None:
        if size < HEADER_BYTES:
            raise ValueError(f"an arena has at least {HEADER_BYTES} bytes, not {size}")
        self._map = mmap.mmap(self.handle, size, access=mmap.ACCESS_READ)
        self._address = None
