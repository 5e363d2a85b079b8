import os
from collections.abc import Iterator
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from benchbot.supervisor.platform import borrowed, messages
from benchbot.wire import encoding
from benchbot.wire.arena import ArenaReader, ArenaWriter, create
from tests.wire.test_arena import write


class Borrowed:
    """An arena, and an answer whose image lies in it."""

    def __init__(self, handle: int) -> None:
        self.arena = ArenaReader(handle)
        self._writer = ArenaWriter(handle)
        (offset,) = write(self._writer, [np.zeros((2, 3), np.uint8)])
        self.image = self.arena.view("|u1", [2, 3], offset)
        self.answer: dict[str, Any] = {"observations": {"image": self.image, "poses": [self.image, "map"]}}

    def overwrite(self) -> None:
        write(self._writer, [np.full((2, 3), 9, np.uint8)])


@pytest.fixture
def borrowing() -> Iterator[Borrowed]:
    handle = create()
    yield Borrowed(handle)
    os.close(handle)


def test_what_is_kept_stays_when_the_arena_is_written_on(borrowing: Borrowed) -> None:
    kept = borrowed.copy_answer(borrowing.answer, borrowing.arena)
    borrowing.overwrite()
    assert borrowing.image.tolist() == [[9] * 3] * 2
    assert kept["observations"]["image"].tolist() == [[0] * 3] * 2
    assert kept["observations"]["poses"][0].tolist() == [[0] * 3] * 2
    assert kept["observations"]["image"].flags.writeable


@pytest.mark.parametrize("opened", [None, "none", "00" * 16])
def test_who_has_not_opened_the_arena_gets_bytes(borrowing: Borrowed, opened: str | None) -> None:
    answer = encoding.decode(borrowed.encode_answer(borrowing.answer, borrowing.arena, opened=opened))
    assert answer["observations"]["image"].tolist() == [[0] * 3] * 2
    offer = {"nonce": borrowing.arena.nonce, "pid": os.getpid(), "descriptor": borrowing.arena.handle}
    assert answer.get("arena") == (None if opened is None else offer)


def test_who_has_opened_it_gets_places(borrowing: Borrowed) -> None:
    message = borrowed.encode_answer(borrowing.answer, borrowing.arena, opened=borrowing.arena.nonce)
    answer = encoding.decode(message, borrowing.arena.read)
    assert answer["observations"]["image"].tolist() == [[0] * 3] * 2
    assert answer["arena"] == {"nonce": borrowing.arena.nonce, "sequence": borrowing.arena.sequence}


ARRAYS = hnp.arrays(
    st.sampled_from(["|b1", "|u1", "<u2", ">i4", "<f4", ">f8"]), hnp.array_shapes(min_dims=0, min_side=0, max_side=3)
)
VALUES = st.recursive(
    ARRAYS | st.none() | st.booleans() | st.integers(-9, 9) | st.text(max_size=3) | st.floats(allow_nan=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


@settings(deadline=None)
@given(st.dictionaries(st.text(max_size=3), VALUES, max_size=3))
def test_what_the_platform_says_of_places_is_what_a_client_would_be_told(observations: dict[str, Any]) -> None:
    handle = create()
    try:
        message = messages.encode_value(observations, ArenaWriter(handle))
        arena = ArenaReader(handle)
        observed = messages.value_of(
            cast(messages.Done, messages.decode_message(message)), borrowed.BorrowingDecoder(arena)
        )
        passed_on = borrowed.encode_answer({"observations": observed}, arena, opened=arena.nonce)
        observed.encoded, found = None, observed.encoded
        looked_for = borrowed.encode_answer({"observations": observed}, arena, opened=arena.nonce)
        assert passed_on == looked_for
        odd = [array for array in arrays_of(observations) if not array.size or array.dtype.str.startswith(">")]
        assert (found is None) == bool(odd)
        np.testing.assert_equal(encoding.decode(bytearray(passed_on), arena.read)["observations"], observations)
    finally:
        os.close(handle)


def arrays_of(value: Any) -> list[NDArray[Any]]:
    """Return the arrays in a value."""
    if isinstance(value, np.ndarray):
        return [value]
    values = value.values() if isinstance(value, dict) else value if isinstance(value, list) else []
    return [array for each in values for array in arrays_of(each)]


def test_a_place_outside_of_the_arena_is_not_passed_on(borrowing: Borrowed) -> None:
    place = msgspec.msgpack.Ext(encoding.PLACE_CODE, msgspec.msgpack.encode(("|u1", [2, 3], 2**20)))
    with pytest.raises(ValueError, match="ends at byte"):
        borrowed.BorrowingDecoder(borrowing.arena).decode(msgspec.Raw(msgspec.msgpack.encode({"image": place})))


def test_without_an_arena_there_is_nothing_to_offer() -> None:
    assert encoding.decode(borrowed.encode_answer({"steps": 1}, None, opened="none")) == {"steps": 1}
