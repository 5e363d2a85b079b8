"""The same picture in fewer bytes: of what is painted, a terminal is sent only the cells that it does not show yet.

Textual paints whole widgets anew, and resets all attributes after each piece of text. Half cells are pieces of one
character: their colours are most of what ssh has to carry.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from rich.cells import cell_len, get_character_cell_size
from textual.driver import Driver

_PIECE = re.compile(r"\x1b\[38;2;(\d+;\d+;\d+);48;2;(\d+;\d+;\d+)m([^\x1b]*)\x1b\[0m")
_RUN = re.compile(rf"(?:{_PIECE.pattern}){{2,}}")
_TOKEN = re.compile(r"\x1b\[(\d+);(\d+)H|\x1b\[([\d;]*)m|([^\x00-\x1f\x7f]+)|\r?\n")
"""A move of the cursor, a style, text, or the end of a line: all that painted widgets are made of."""
_PAINTS_NOTHING = re.compile(r"(?:\x1b\[\?(?:25|2026)[hl]|\x1b\]22;[a-z-]*\x07)*")
"""The cursor is shown or hidden, an update begins or ends, the mouse has another shape."""
GAP = 8
"""Cells that are the same are sent again where there are no more of them between others: moving there takes as much."""

Cell = tuple[str, str]
"""A character and its style, as SGR parameters."""


@dataclass(frozen=True)
class _Span:
    """Cells from a line and column on, which both count from 0."""

    line: int
    column: int
    cells: Sequence[Cell]


def of(driver: type[Driver], size: Callable[[], object]) -> type[Driver]:
    """Return a driver that writes only news, and does all else as another does; `size` tells that of the terminal."""

    class Thrifty(driver):  # type: ignore[misc, valid-type]
        def __init__(self, *given: Any, **options: Any) -> None:
            super().__init__(*given, **options)
            self._shown, self._shown_size = ShownCells(), size()

        def write(self, data: str) -> None:
            if size() != self._shown_size:
                # Terminals move or cut what they show when they change.
                self._shown_size = size()
                self._shown.forget()
            super().write(self._shown.news(data))

    return Thrifty


class ShownCells:
    """What a terminal shows, as far as what it was sent tells."""

    def __init__(self) -> None:
        self._lines: dict[int, list[Cell | None]] = {}

    def forget(self) -> None:
        """Take nothing for known."""
        self._lines = {}

    def news(self, text: str) -> str:
        """Return what has to be sent so that a terminal shows the same as with all of a text."""
        spans = _spans(text)
        if spans is not None:
            moved = text[text.rfind("\x1b[") :] if text.endswith("H") else ""
            return thrifty("".join(part for span in spans for part in self._changes(span))) + moved
        if not _PAINTS_NOTHING.fullmatch(text):
            self.forget()
        return thrifty(text)

    def _changes(self, span: _Span) -> Iterator[str]:
        known, first, count = self._lines.setdefault(span.line, []), span.column, len(span.cells)
        text = "".join(letter for letter, _ in span.cells)
        width = count if text.isascii() else cell_len(text)
        known += [None] * (first + width - len(known))
        if width != count or not (text.isascii() or all(get_character_cell_size(letter) == 1 for letter in text)):
            # Terminals do not agree how wide such characters are: nothing is taken for known there.
            known[first : first + width] = [None] * width
            yield _said(span.line, first, span.cells)
            return
        changed = [place for place in range(count) if known[first + place] != span.cells[place]]
        known[first : first + count] = span.cells
        while changed:
            begin = end = changed[0]
            while changed and changed[0] - end <= GAP:
                end = changed.pop(0)
            yield _said(span.line, first + begin, span.cells[begin : end + 1])


def _spans(text: str) -> list[_Span] | None:
    """Return what is painted where; None for a text that does anything else."""
    spans: list[_Span] = []
    cells: list[Cell] | None = None
    style, place = "", 0
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            return None
        place = token.end()
        line, column, codes, letters = token.groups()
        if line is not None:
            cells = []
            spans.append(_Span(int(line) - 1, int(column) - 1, cells))
        elif codes is not None:
            style = "" if codes in ("", "0") else f"{style};{codes}" if style else codes
        elif letters is None:
            cells = None
        elif cells is None:
            return None
        else:
            cells += [(letter, style) for letter in letters]
    return spans


def _said(line: int, column: int, cells: Sequence[Cell]) -> str:
    parts = [f"\x1b[{line + 1};{column + 1}H"]
    for style, group in groupby(cells, key=lambda cell: cell[1]):
        text = "".join(letter for letter, _ in group)
        parts.append(f"\x1b[{style}m{text}\x1b[0m" if style else text)
    return "".join(parts)


def thrifty(text: str) -> str:
    """Return what a terminal is sent, such that it shows the same; only texts with two plain colours are touched."""
    return _RUN.sub(_said_once, text) if "\x1b[38;2;" in text else text


def _said_once(run: re.Match[str]) -> str:
    parts: list[str] = []
    fore = back = ""
    for piece in _PIECE.finditer(run[0]):
        codes = [f"38;2;{piece[1]}"] if piece[1] != fore else []
        codes += [f"48;2;{piece[2]}"] if piece[2] != back else []
        fore, back = piece[1], piece[2]
        parts.append(f"\x1b[{';'.join(codes)}m{piece[3]}" if codes else piece[3])
    return f"{''.join(parts)}\x1b[0m"
