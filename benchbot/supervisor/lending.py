"""What becomes of arrays that the platform's process lends: sent by place, as bytes, or kept as copies.

They lie in its arena, and are good until the next observation. One request at a time uses the session, so they stay for
as long as that request is answered.
"""

import os
from typing import Any, Protocol, TypeVar

import numpy as np

from benchbot.supervisor import wire
from benchbot.supervisor.arena import ArenaReader

T_co = TypeVar("T_co", covariant=True)


class Deliver(Protocol[T_co]):
    """Makes of an answer what its sender wants, while its arrays are sure to stay as they are."""

    def __call__(self, answer: dict[str, Any], arena: ArenaReader | None) -> T_co:
        """Return it; `arena` is where arrays that are lent lie."""


def keep(answer: dict[str, Any], arena: ArenaReader | None) -> Any:
    """Return an answer whose arrays are the caller's to keep."""
    return copied(answer)


def encode(answer: dict[str, Any], arena: ArenaReader | None, *, opened: str | None) -> bytes:
    """Return an answer as MessagePack, for a client that has opened the arena with the nonce `opened`.

    To that arena's client it names places. To one that has opened none yet, or that of a process which has died, it
    sends bytes and tells where the arena is; to one that shares no memory (None), bytes.
    """
    if arena is None or opened is None:
        return wire.encode(answer)
    if opened == arena.nonce:
        told = {"nonce": arena.nonce, "sequence": arena.sequence}
        return wire.encode({**answer, "arena": told}, arena.offset_of)
    offered = {"nonce": arena.nonce, "pid": os.getpid(), "descriptor": arena.handle}
    return wire.encode({**answer, "arena": offered})


def copied(value: Any) -> Any:
    """Return a value with copies of its arrays."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, dict):
        return {key: copied(item) for key, item in value.items()}
    if isinstance(value, list):
        return [copied(item) for item in value]
    return value
