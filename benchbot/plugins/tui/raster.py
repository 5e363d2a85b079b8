"""Widgets that show pictures: in the cells of a terminal, or in the pixels of one that can show them."""

import textwrap
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.style import Style
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.drawing.palette import Color, Pixels
from benchbot.plugins.tui import half_cells, mosaics, panels

KINDS = [*mosaics.GRIDS, "kitty", "sixel", "none"]


class Renderable(Protocol):
    """Content of a `Raster`: a `Picture`, or a drawing that is made for each size."""

    def strips(self, size: Size, *, colored: bool, dark: bool, grid: tuple[int, int] = half_cells.HALF) -> list[Strip]:
        """Return the lines that show it within so many cells of a grid of pixels each."""
        ...

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it as large as it fits into so many pixels, uint8 (H, W, 3)."""
        ...


@dataclass(frozen=True)
class Picture:
    """A picture with a legend, shown as large as it fits."""

    image: Pixels
    """uint8 (H, W, 3)."""
    legend: tuple[tuple[Color, str], ...] = ()
    """Colours and their meanings, most important first."""
    symbols: NDArray[np.uint8] | None = None
    """An ASCII character for each pixel, (H, W), shown where the terminal has no colour."""
    marks: tuple[str, ...] = ()
    """The characters of the entries of the legend, for the same case."""
    exact: bool = False
    """Whether the nearest pixel is taken instead of the mean: classes have no mean."""

    def strips(self, size: Size, *, colored: bool, dark: bool, grid: tuple[int, int] = half_cells.HALF) -> list[Strip]:
        """Return the lines that show it within so many cells of a grid of pixels each."""
        height, width = self.image.shape[:2]
        columns, lines = half_cells.fit(width, height, size.width, size.height)
        if not columns:
            return []
        if self.symbols is not None and not colored:
            return half_cells.plain(self.letters(columns, lines))
        if not colored:
            return half_cells.shaded(self._resized(columns, 2 * lines), dark=dark)
        return half_cells.colored(self._resized(grid[0] * columns, grid[1] * lines), grid=grid)

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it as large as it fits into so many pixels, uint8 (H, W, 3)."""
        height, width = self.image.shape[:2]
        scale = min(size.width / width, size.height / height)
        return self._resized(max(1, round(width * scale)), max(1, round(height * scale)))

    def letters(self, columns: int, lines: int) -> list[str]:
        """Return the symbols as lines of text."""
        if self.symbols is None:
            return []
        return [bytes(row).decode("ascii") for row in _nearest(self.symbols, columns, lines)]

    def _resized(self, width: int, height: int) -> Pixels:
        if self.exact:
            return _nearest(self.image, width, height)
        # The mean of the covered pixels: a smooth filter costs more and shows no more at this size.
        return np.asarray(Image.fromarray(self.image).resize((width, height), Image.Resampling.BOX))


class Raster(Widget):
    """Shows a picture or a drawing in terminal cells, centred; words where there is none.

    It is rendered again only when its content, size or theme changes.
    """

    DEFAULT_CSS: ClassVar[str] = "Raster { width: 1fr; height: 1fr; }"

    def __init__(self, kind: str = "halfcell", *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self._grid = mosaics.GRIDS[kind]
        self._shown: Renderable | None = None
        self._words = ""
        self._strips: list[Strip] | None = None
        self._painted = Size()
        """The size that the strips were made for: Textual may ask for lines before it tells of another size."""
        self._top = 0
        self._style = Style()

    @property
    def pixels_wide(self) -> int:
        """The number of pixels from left to right."""
        return self.size.width * self._grid[0]

    def show(self, shown: Renderable | None, words: str = "") -> None:
        """Show this content from now on, or `words` in its place."""
        if shown is None and self._shown is None and words == self._words:
            return
        before, top = self._strips, self._top
        self._shown, self._words, self._strips = shown, words, None
        if before is None or not self.size or self._painted != self.size:
            self.refresh()
            return
        # Only lines that look otherwise are painted, and sent.
        self._paint()
        now: list[Strip] = self._strips or []
        if len(now) != len(before) or top != self._top:
            self.refresh()
            return
        changed = [line for line, (new, old) in enumerate(zip(now, before, strict=True)) if new != old]
        if changed:
            self.refresh(*(Region(0, top + line, self.size.width, 1) for line in changed))

    def notify_style_update(self) -> None:
        """Render again in another theme."""
        self._strips = None
        super().notify_style_update()

    def render_line(self, y: int) -> Strip:
        """Return one line."""
        if self._strips is None or self._painted != self.size:
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
        self._style, self._painted = self.rich_style, self.size
        if self._shown is not None:
            colored, dark = not self.app.no_color, self.app.current_theme.dark
            self._strips = self._shown.strips(self.size, colored=colored, dark=dark, grid=self._grid)
        else:
            colored = False
            self._strips = _wrapped(self._words, self.size.width)
        if not colored:
            self._strips = [strip.apply_style(self._style) for strip in self._strips]
        self._top = max(0, (self.size.height - len(self._strips)) // 2)


class Blank(Raster):
    """Shows words in place of every picture."""

    def show(self, shown: Renderable | None, words: str = "") -> None:
        """Show words only."""
        super().show(None, words if shown is None else "No pictures are shown (--images none).")


class Graphics(Raster):
    """Shows pictures in the pixels of the terminal, by `textual-image`."""

    DEFAULT_CSS: ClassVar[str] = "Graphics > * { width: 100%; height: 100%; }"

    def __init__(self, kind: str) -> None:
        super().__init__()
        # The package queries the terminal as soon as it is imported: only users of graphics should pay for that.
        from textual_image._terminal import get_cell_size
        from textual_image.widget import SixelImage, TGPImage

        self._image = SixelImage() if kind == "sixel" else TGPImage()
        self._cell = get_cell_size()
        self._graphic: Renderable | None = None

    def compose(self) -> ComposeResult:
        """Lay out the picture."""
        yield self._image

    @property
    def pixels_wide(self) -> int:
        """The number of pixels from left to right."""
        return self.size.width * self._cell.width

    def show(self, shown: Renderable | None, words: str = "") -> None:
        """Show this content from now on, or `words` in its place."""
        super().show(None, words)
        self._graphic = shown
        self._paint_pixels()

    def on_resize(self) -> None:
        """Paint for the new size."""
        self._paint_pixels()

    def _paint_pixels(self) -> None:
        self._image.display = self._graphic is not None
        size = Size(self.size.width * self._cell.width, self.size.height * self._cell.height)
        if self._graphic is None or not size:
            return
        self._image.image = Image.fromarray(self._graphic.pixels(size, dark=self.app.current_theme.dark))


def make(kind: str) -> Raster:
    """Return a widget of one of `KINDS`; raises BenchbotError for another kind."""
    if kind not in KINDS:
        raise BenchbotError(
            f"Pictures cannot be shown as '{kind}'.",
            f"There is no such way.{did_you_mean(kind, KINDS)}",
            f"Choose one of: {', '.join(KINDS)}",
        )
    if kind == "none":
        return Blank()
    return Raster(kind) if kind in mosaics.GRIDS else Graphics(kind)


def _wrapped(text: str, width: int) -> list[Strip]:
    return half_cells.plain(textwrap.wrap(text, max(1, width - 2)) if text else [])


def _nearest(values: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    rows = np.arange(height) * values.shape[0] // height
    columns = np.arange(width) * values.shape[1] // width
    chosen: NDArray[np.uint8] = values[rows[:, None], columns]
    return chosen


class RasterPanel(Vertical):
    """A raster above its legend, in a frame."""

    DEFAULT_CSS: ClassVar[str] = """
    RasterPanel {
        border: round $foreground 25%; border-title-color: $foreground 70%;
        border-subtitle-color: $foreground 50%; width: 1fr; height: 1fr;
    }
    RasterPanel > Words { height: 1; }
    """

    def __init__(self, box: Raster, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self._box = box
        self._legend = panels.Words()

    def compose(self) -> ComposeResult:
        """Lay out the raster and its legend."""
        yield self._box
        yield self._legend

    def on_resize(self) -> None:
        """Fit the legend."""
        self.tell_legend()

    def tell_legend(self) -> None:
        """Write the legend for the width that there is."""
        raise NotImplementedError
