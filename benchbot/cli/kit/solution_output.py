"""The output of a solution as it is shown beside lines of BenchBot's own, for one of which none of it can pass."""

import os
import re
from codecs import getincrementaldecoder
from collections.abc import Iterator
from contextlib import suppress
from unicodedata import east_asian_width

from benchbot.core.text import SOLUTION, visible

ERASE = "\r\x1b[K"
_PIECES = re.compile(r"[\n\r]|[^\n\r]+")


def cells(text: str) -> int:
    """Return how many cells of a terminal a text takes at most."""
    return sum(2 if east_asian_width(character) in "WF" else 1 for character in text)


def folded(line: str, width: float, taken: int = 0, indent: int = 0) -> Iterator[str]:
    """Yield the parts of a line that each take less than `width` cells, after those `taken` and an `indent`."""
    start = 0
    for place, character in enumerate(line):
        taken += cells(character)
        if taken >= width:
            yield line[start:place]
            start, taken = place, indent + cells(character)
    yield line[start:]


class MarkedOutput:
    """Takes output in chunk by chunk, and returns it with `solution | ` before each line.

    Where `handle` is that of a terminal, lines are broken where it would break them. A carriage return has the line
    written anew, as progress bars do, if that terminal `rewrites`; otherwise it ends the line.
    """

    def __init__(self, handle: int | None, *, rewrites: bool) -> None:
        self._handle = handle
        self._rewrites = rewrites
        self._decoded = getincrementaldecoder("utf-8")("replace").decode
        self._column = 0
        self._returned = False

    @property
    def at_line_start(self) -> bool:
        """True while no line has been begun."""
        return not self._column

    def shown(self, chunk: bytes) -> str:
        """Return the next chunk as it is shown."""
        return "".join(part for piece in _PIECES.findall(self._decoded(chunk)) for part in self._parts(piece))

    def line_end(self) -> str:
        """End the line, where one has been begun, and return how."""
        ended = "\n" if self._column else ""
        self._column, self._returned = 0, False
        return ended

    def _parts(self, piece: str) -> Iterator[str]:
        if piece == "\r":
            self._returned = True
        elif piece == "\n":
            yield self.line_end() or f"{SOLUTION.rstrip()}\n"
        else:
            if self._returned and self._column:
                yield ERASE if self._rewrites else "\n"
                self._column = 0
            self._returned = False
            yield from self._text(visible(piece))

    def _text(self, text: str) -> Iterator[str]:
        parts = [text]
        with suppress(OSError):  # it is no terminal
            width = 0 if self._handle is None else os.get_terminal_size(self._handle).columns
            if width > 2 * len(SOLUTION):  # else it does not know, or has no room
                parts = list(folded(text.expandtabs(), width, self._column or len(SOLUTION), len(SOLUTION)))
        if not self._column:
            yield SOLUTION
        yield f"\n{SOLUTION}".join(parts)
        self._column = cells(parts[-1]) + (len(SOLUTION) if len(parts) > 1 or not self._column else self._column)
