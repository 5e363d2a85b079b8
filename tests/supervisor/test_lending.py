import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from benchbot.supervisor import lending, wire
from benchbot.supervisor.arena import ArenaReader, ArenaWriter, create


class Lent:
    """An arena, and an answer whose image lies in it."""

    def __init__(self, handle: int) -> None:
        self.arena = ArenaReader(handle)
        self._writer = ArenaWriter(handle)
        (offset,) = self._writer.write([np.zeros((2, 3), np.uint8)])
        self.image = self.arena.view("|u1", [2, 3], offset)
        self.answer: dict[str, Any] = {"observations": {"image": self.image, "poses": [self.image, "map"]}}

    def overwrite(self) -> None:
        self._writer.write([np.full((2, 3), 9, np.uint8)])


@pytest.fixture
def lent() -> Iterator[Lent]:
    handle = create()
    yield Lent(handle)
    os.close(handle)


def test_what_is_kept_stays_when_the_arena_is_written_on(lent: Lent) -> None:
    kept = lending.keep(lent.answer, lent.arena)
    lent.overwrite()
    assert lent.image.tolist() == [[9] * 3] * 2
    assert kept["observations"]["image"].tolist() == [[0] * 3] * 2
    assert kept["observations"]["poses"][0].tolist() == [[0] * 3] * 2
    assert kept["observations"]["image"].flags.writeable


@pytest.mark.parametrize("opened", [None, "none", "00" * 16])
def test_who_has_not_opened_the_arena_gets_bytes(lent: Lent, opened: str | None) -> None:
    answer = wire.decode(lending.encode(lent.answer, lent.arena, opened=opened))
    assert answer["observations"]["image"].tolist() == [[0] * 3] * 2
    offer = {"nonce": lent.arena.nonce, "pid": os.getpid(), "descriptor": lent.arena.handle}
    assert answer.get("arena") == (None if opened is None else offer)


def test_who_has_opened_it_gets_places(lent: Lent) -> None:
    message = lending.encode(lent.answer, lent.arena, opened=lent.arena.nonce)
    answer = wire.decode(message, lent.arena.read)
    assert answer["observations"]["image"].tolist() == [[0] * 3] * 2
    assert answer["arena"] == {"nonce": lent.arena.nonce, "sequence": lent.arena.sequence}


def test_without_an_arena_there_is_nothing_to_offer() -> None:
    assert wire.decode(lending.encode({"steps": 1}, None, opened="none")) == {"steps": 1}
