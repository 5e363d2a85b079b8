"""A picture in a terminal: two pixels a cell, the upper half block in two colours; characters under `NO_COLOR`."""

import os
from typing import TYPE_CHECKING

from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from PIL.Image import Image

HALF = "▀"
SHADES = " .:-=+*#%@"


class PictureView(Widget):
    """Shows a picture as large as its room allows, in its own proportions."""

    DEFAULT_CSS = "PictureView { height: 1fr; }"

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id, classes=classes)
        self._picture: Image | None = None
        self._rows: tuple[tuple[int, int], list[Strip]] | None = None

    def show(self, picture: "Image | None") -> None:
        """Show a picture from now on; None for none."""
        self._picture, self._rows = picture, None
        self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return one line of cells."""
        size = (self.size.width, self.size.height)
        if self._rows is None or self._rows[0] != size:
            self._rows = (size, self._drawn(*size))
        rows, around = self._rows[1], self.rich_style
        return rows[y].extend_cell_length(size[0], around) if y < len(rows) else Strip.blank(size[0], around)

    def _drawn(self, width: int, height: int) -> list[Strip]:
        if self._picture is None or width < 1 or height < 1:
            return []
        source = self._picture
        scale = min(width / source.width, 2 * height / source.height)
        # A cell is about twice as high as it is wide.
        fitted = (max(1, int(source.width * scale)), 2 * max(1, int(source.height * scale / 2)))
        pixels = source.convert("RGB").resize(fitted)
        plain = "NO_COLOR" in os.environ
        grey = pixels.convert("L")

        def cell(x: int, y: int) -> Segment:
            upper, lower = (x, 2 * y), (x, 2 * y + 1)
            if plain:
                light = (_number(grey.getpixel(upper)) + _number(grey.getpixel(lower))) / 2
                return Segment(SHADES[int(light / 256 * len(SHADES))])
            above, below = (Color.from_rgb(*_triple(pixels.getpixel(at))) for at in (upper, lower))
            return Segment(HALF, Style.from_color(above, below))

        return [Strip([cell(x, y) for x in range(fitted[0])]) for y in range(fitted[1] // 2)]


def _number(value: object) -> int:
    return value if isinstance(value, int) else 0


def _triple(value: object) -> tuple[int, int, int]:
    if not isinstance(value, tuple):
        return 0, 0, 0
    red, green, blue = value[:3]
    return int(red), int(green), int(blue)
