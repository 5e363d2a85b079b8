"""A widget that shows a picture in the cells of a terminal."""

import textwrap
from typing import ClassVar, Protocol

from rich.style import Style
from textual.geometry import Size
from textual.strip import Strip
from textual.widget import Widget

from benchbot.plugins.drawing.palette import Pixels
from benchbot.plugins.tui.watching import half_cells
from benchbot.plugins.tui.watching.pictures import Picture


class Shown(Protocol):
    """What can be shown in cells: a `Picture`, or what paints itself anew for each size."""

    def strips(self, size: Size, *, colored: bool, dark: bool) -> list[Strip]:
        """Return the lines that show it within a size."""
        ...

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it as large as it fits into so many pixels, uint8 (H, W, 3)."""
        ...


class Still:
    """A picture that is made as large as there is room."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture

    def strips(self, size: Size, *, colored: bool, dark: bool) -> list[Strip]:
        """Return the lines that show it within a size."""
        height, width = self._picture.pixels.shape[:2]
        columns, lines = half_cells.fit(width, height, size.width, size.height)
        if not columns:
            return []
        if self._picture.symbols is not None and not colored:
            return half_cells.plain(self._picture.letters(columns, lines))
        pixels = self._picture.resized(columns, 2 * lines)
        return half_cells.colored(pixels) if colored else half_cells.shaded(pixels, dark=dark)

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it as large as it fits into so many pixels."""
        height, width = self._picture.pixels.shape[:2]
        scale = min(size.width / width, size.height / height)
        return self._picture.resized(max(1, round(width * scale)), max(1, round(height * scale)))


class Raster(Widget):
    """Shows one thing after the other, in the middle of what room there is; words where there is nothing to show.

    It is painted anew only when what it shows or its size changes, and then only lines that are different.
    """

    DEFAULT_CSS: ClassVar[str] = "Raster { width: 1fr; height: 1fr; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self._shown: Shown | None = None
        self._words = ""
        self._strips: list[Strip] | None = None
        self._top = 0
        self._style = Style()

    @property
    def pixels_wide(self) -> int:
        """How many pixels it shows from left to right."""
        return self.size.width

    def show(self, shown: Shown | None, words: str = "") -> None:
        """Show something from now on, or `words` in its place."""
        if shown is None and self._shown is None and words == self._words:
            return
        self._shown, self._words, self._strips = shown, words, None
        self.refresh()

    def on_resize(self) -> None:
        """Paint for the new size."""
        self._strips = None

    def notify_style_update(self) -> None:
        """Paint anew in another theme."""
        self._strips = None
        super().notify_style_update()

    def render_line(self, y: int) -> Strip:
        """Return one line."""
        if self._strips is None:
            self._paint()
        strips = self._strips or []
        y -= self._top
        blank = Strip.blank(self.size.width, self._style)
        if not 0 <= y < len(strips):
            return blank
        strip = strips[y]
        left = (self.size.width - strip.cell_length) // 2
        if left <= 0:
            return strip.crop(0, self.size.width)
        right = self.size.width - strip.cell_length - left
        sides = (Strip.blank(left, self._style), Strip.blank(right, self._style))
        return Strip.join([sides[0], strip, sides[1]])

    def _paint(self) -> None:
        self._style = self.rich_style
        if self._shown is not None:
            colored, dark = not self.app.no_color, self.app.current_theme.dark
            self._strips = self._shown.strips(self.size, colored=colored, dark=dark)
        else:
            colored = False
            self._strips = _wrapped(self._words, self.size.width)
        if not colored:
            self._strips = [strip.apply_style(self._style) for strip in self._strips]
        self._top = max(0, (self.size.height - len(self._strips)) // 2)


def _wrapped(text: str, width: int) -> list[Strip]:
    return half_cells.plain(textwrap.wrap(text, max(1, width - 2)) if text else [])
