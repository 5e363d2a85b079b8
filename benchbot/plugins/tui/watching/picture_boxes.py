"""What pictures are shown in: cells of a terminal, or the true pixels of one that can show them."""

from typing import ClassVar

from PIL import Image
from textual.app import ComposeResult
from textual.geometry import Size

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.tui.watching.raster import Raster, Shown

KINDS = ["halfcell", "kitty", "sixel", "none"]


class Blank(Raster):
    """Shows no pictures, as its user wishes."""

    def show(self, shown: Shown | None, words: str = "") -> None:
        """Show words only."""
        super().show(None, words if shown is None else "No pictures are shown (--images none).")


class Graphics(Raster):
    """Shows pictures in the pixels of the terminal, by `textual-image`."""

    DEFAULT_CSS: ClassVar[str] = "Graphics > * { width: 100%; height: 100%; }"

    def __init__(self, kind: str) -> None:
        super().__init__()
        # Its package asks the terminal what it can do as soon as it is imported: nobody else should pay for that.
        from textual_image._terminal import get_cell_size
        from textual_image.widget import SixelImage, TGPImage

        self._image = SixelImage() if kind == "sixel" else TGPImage()
        self._cell = get_cell_size()
        self._graphic: Shown | None = None

    def compose(self) -> ComposeResult:
        """Lay out the picture."""
        yield self._image

    @property
    def pixels_wide(self) -> int:
        """How many pixels it shows from left to right."""
        return self.size.width * self._cell.width

    def show(self, shown: Shown | None, words: str = "") -> None:
        """Show something from now on, or `words` in its place."""
        super().show(None, words)
        self._graphic = shown
        self._paint_pixels()

    def on_resize(self) -> None:
        """Paint for the new size."""
        super().on_resize()
        self._paint_pixels()

    def _paint_pixels(self) -> None:
        self._image.display = self._graphic is not None
        size = Size(self.size.width * self._cell.width, self.size.height * self._cell.height)
        if self._graphic is None or not size:
            return
        self._image.image = Image.fromarray(self._graphic.pixels(size, dark=self.app.current_theme.dark))


def make(kind: str) -> Raster:
    """Return a box of a kind; raises BenchbotError for one that is not there."""
    if kind not in KINDS:
        raise BenchbotError(
            f"Pictures cannot be shown as '{kind}'.",
            f"There is no such way.{did_you_mean(kind, KINDS)}",
            f"Choose one of: {', '.join(KINDS)}",
        )
    if kind == "none":
        return Blank()
    return Raster() if kind == "halfcell" else Graphics(kind)


def prepare(kind: str) -> None:
    """Ask the terminal what must be known of it, before an app begins to read from it."""
    if kind in ("kitty", "sixel"):
        from textual_image._terminal import get_cell_size

        get_cell_size()
