"""The client's end of the arena: observations of a supervisor on this machine, read where its platform wrote them."""

import os
import weakref
from pathlib import Path
from typing import Any, Self

from numpy.typing import NDArray

from benchbot.wire import arena


class SharedMemory:
    """An arena that a supervisor has offered, open for reading; `nonce` names it."""

    def __init__(self, handle: int) -> None:
        self._reader = arena.ArenaReader(handle)
        self.nonce = self._reader.nonce
        # A solution that forgets its client must not leak: nobody else closes the file.
        self._close = weakref.finalize(self, os.close, handle)

    @classmethod
    def open(cls, offered: Any) -> Self | None:
        """Return what is offered, or None when it cannot be reached from here: another user, container or system.

        Nothing is opened but an anonymous file of that name, so an offer cannot lead anywhere else.
        """
        try:
            path = f"/proc/{int(offered['pid'])}/fd/{int(offered['descriptor'])}"
            if str(Path(path).readlink()) != f"/memfd:{arena.NAME} (deleted)":
                return None
            handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        except (OSError, KeyError, TypeError, ValueError):
            return None
        try:
            memory = cls(handle)
        except ValueError:
            os.close(handle)
            return None
        # Elsewhere, this process number may belong to another supervisor.
        if memory.nonce != offered.get("nonce"):
            memory.close()
            return None
        return memory

    def read(self, dtype: str, shape: list[int], offset: int) -> NDArray[Any]:
        """Return a copy of an array; raises ValueError when it lies outside of the memory."""
        return self._reader.read(dtype, shape, offset)

    def holds(self, sequence: Any) -> bool:
        """Say whether the arena still holds what a supervisor wrote as number `sequence`."""
        return bool(self._reader.sequence == sequence)

    def close(self) -> None:
        """Let go of the memory."""
        self._reader.close()
        self._close()
