"""Shared memory between the supervisor and the platform's process, with no name and so nothing to leak.

The memory is an anonymous file whose descriptor the child inherits. When both ends are gone, so is the memory.
"""

import fcntl
import mmap
import os
import tempfile
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

ALIGNMENT_BYTES = 64


def create() -> int:
    """Return the descriptor of a new, empty anonymous file."""
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create("benchbot-arena", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        # A file that cannot shrink cannot take mapped pages away from the reader (SIGBUS).
        fcntl.fcntl(handle, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
        return handle
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


class ArenaWriter:
    """The child's end: places arrays one after the other, and grows the file when they do not fit."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._map: mmap.mmap | None = None

    def write(self, arrays: Sequence[NDArray[Any]]) -> list[int]:
        """Write the arrays in C order and return their offsets in bytes. What was written before is overwritten."""
        offsets, end = [], 0
        for array in arrays:
            offsets.append(end)
            end += -(-array.nbytes // ALIGNMENT_BYTES) * ALIGNMENT_BYTES
        memory = self._memory(end)
        for offset, array in zip(offsets, arrays, strict=True):
            target = np.frombuffer(memory, array.dtype, array.size, offset).reshape(array.shape)
            np.copyto(target, array)
        return offsets

    def _memory(self, size: int) -> mmap.mmap:
        size = max(size, mmap.PAGESIZE)
        if self._map is None or len(self._map) < size:
            size = max(size, os.fstat(self._handle).st_size)
            os.ftruncate(self._handle, size)
            self._map = mmap.mmap(self._handle, size)
        return self._map


class ArenaReader:
    """The supervisor's end: copies arrays out."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._map: mmap.mmap | None = None

    def read(self, dtype: str, shape: Sequence[int], offset: int) -> NDArray[Any]:
        """Return a copy of the array at an offset; raises ValueError when it lies outside of the memory."""
        kind = np.dtype(dtype)
        if kind.hasobject or offset < 0 or any(size < 0 for size in shape):
            raise ValueError(f"not an array: {dtype} {list(shape)} at {offset}")
        count = int(np.prod(shape, dtype=object))
        end = offset + count * kind.itemsize
        available = os.fstat(self._handle).st_size
        if end > available:
            raise ValueError(f"the array ends at byte {end} of {available}")
        if count == 0:
            return np.empty(tuple(shape), kind)
        if self._map is None or len(self._map) < end:
            self._map = mmap.mmap(self._handle, available, access=mmap.ACCESS_READ)
        return np.frombuffer(self._map, kind, count, offset).reshape(tuple(shape)).copy()
