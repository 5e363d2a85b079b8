"""The same picture in fewer bytes: a terminal's colours are said again only where they change.

Textual resets all attributes after each piece of text. Half cells are pieces of one character: their colours are most
of what ssh has to carry.
"""

import re

from textual.driver import Driver

_PIECE = re.compile(r"\x1b\[38;2;(\d+;\d+;\d+);48;2;(\d+;\d+;\d+)m([^\x1b]*)\x1b\[0m")
_RUN = re.compile(rf"(?:{_PIECE.pattern}){{2,}}")


def of(driver: type[Driver]) -> type[Driver]:
    """Return a driver that writes `thrifty` text, and does all else as another does."""

    class Thrifty(driver):  # type: ignore[misc, valid-type]
        def write(self, data: str) -> None:
            super().write(thrifty(data))

    return Thrifty


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
