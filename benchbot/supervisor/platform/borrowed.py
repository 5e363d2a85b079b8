"""Zero copy: arrays borrowed from the arena of the platform's process, which answers send by place, as bytes or copied.

They are valid until the next observation. One request at a time uses the session, so they stay valid for as long as
that request is answered.
"""

import os
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import msgspec

from benchbot.supervisor.platform import messages
from benchbot.wire import encoding
from benchbot.wire.arena import ArenaReader

if TYPE_CHECKING:
    from numpy.typing import NDArray

T_co = TypeVar("T_co", covariant=True)


class BorrowedObservations(dict[str, Any]):
    """Observations as the platform's process has sent them: their arrays are read-only views of its arena."""

    encoded: msgspec.Raw | None = None
    """The message that names the places of all arrays, as a client would be sent it; None when that one differs."""


class BorrowingDecoder:
    """Decodes the observations in the messages of a platform's process without a copy; a `messages.Decoder`."""

    def __init__(self, arena: ArenaReader) -> None:
        self._arena = arena
        self._decoder = messages.decoder(dict[str, Any], self._view)
        self._all_named = True

    def decode(self, message: msgspec.Raw) -> BorrowedObservations:
        """Return the observations in a message; raises ValueError or msgspec.MsgspecError when there are none."""
        self._all_named = True
        observations = BorrowedObservations(self._decoder.decode(message))
        if self._all_named:
            observations.encoded = message
        return observations

    def _view(self, dtype: str, shape: list[int], offset: int) -> "NDArray[Any]":
        self._all_named &= encoding.has_place(dtype, shape)
        return self._arena.view(dtype, shape, offset)


class Converter(Protocol[T_co]):
    """Converts an answer into what its caller needs, while its arrays are valid."""

    def __call__(self, answer: dict[str, Any], arena: ArenaReader | None) -> T_co:
        """Return it; `arena` is where borrowed arrays lie."""


def copy_answer(answer: dict[str, Any], arena: ArenaReader | None) -> Any:
    """Return an answer whose arrays are the caller's to keep."""
    return copied(answer)


def encode_answer(answer: dict[str, Any], arena: ArenaReader | None, *, opened: str | None) -> bytes:
    """Return an answer as MessagePack, for a client that has opened the arena with the nonce `opened`.

    To that arena's client it names places. To one that has opened none yet, or that of a process which has died, it
    sends bytes and tells where the arena is; to one that shares no memory (None), bytes.
    """
    if arena is None or opened is None:
        return encoding.encode(answer)
    if opened == arena.nonce:
        told = {"nonce": arena.nonce, "sequence": arena.sequence}
        shown = answer.get("observations")
        if isinstance(shown, BorrowedObservations) and shown.encoded is not None:
            # The same bytes as would come out below, without looking for the places again.
            answer = {**answer, "observations": shown.encoded}
        return encoding.encode({**answer, "arena": told}, arena.offset_of)
    offered = {"nonce": arena.nonce, "pid": os.getpid(), "descriptor": arena.handle}
    return encoding.encode({**answer, "arena": offered})


def copied(value: Any) -> Any:
    """Return a value with copies of its arrays."""
    if encoding.is_array(value):
        return value.copy()
    if isinstance(value, dict):
        return {key: copied(item) for key, item in value.items()}
    if isinstance(value, list):
        return [copied(item) for item in value]
    return value
