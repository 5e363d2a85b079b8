"""Loops that may take long, and how far they are: a command tells whoever waits for it (`cli.kit.status_line`)."""

import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")


@dataclass(eq=False)
class Loop:
    """A loop: what it does, as `Scoring results`, and how many of its items are done."""

    what: str
    total: int
    done: int = 0
    started_s: float = field(default_factory=time.monotonic)

    def __str__(self) -> str:
        told = f"{self.what}: {self.done} of {self.total}"
        if not self.done:
            return told
        left_s = (time.monotonic() - self.started_s) / self.done * (self.total - self.done)
        return f"{told}, about {left_s:.0f} s left"


under_way: list[Loop] = []
"""The loops of this process that are counted, each inside the one before it."""


def counted(what: str, items: Collection[T]) -> Iterator[T]:
    """Yield items, and count them for whoever looks at the loops under way."""
    loop = Loop(what, len(items))
    under_way.append(loop)
    try:
        for item in items:
            yield item
            loop.done += 1
    finally:
        under_way.remove(loop)
