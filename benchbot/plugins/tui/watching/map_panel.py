"""The map of a run in its frame: what is on it, how much is shown, and the legend of its colours."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Vertical

from benchbot.plugins.tui.watching import panels, top_map
from benchbot.plugins.tui.watching.map_characters import LEGEND
from benchbot.plugins.tui.watching.map_window import MapContent, Window
from benchbot.plugins.tui.watching.raster import Raster
from benchbot.plugins.tui.watching.top_map import TopMap


class MapPanel(Vertical):
    """Shows a map; one that it shows already costs nothing."""

    DEFAULT_CSS: ClassVar[str] = """
    MapPanel {
        border: round $foreground 25%; border-title-color: $foreground 70%;
        border-subtitle-color: $foreground 50%; width: 1fr; height: 1fr;
    }
    MapPanel > Words { height: 1; }
    """

    def __init__(self, box: Raster, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self._box = box
        self._legend = panels.Words()
        self._key: object = None
        self._content: MapContent | None = None

    def compose(self) -> ComposeResult:
        """Lay out the map and its legend."""
        yield self._box
        yield self._legend

    def show(self, content: MapContent, key: object) -> None:
        """Show a map; `key` is equal for maps that look the same."""
        if key == self._key:
            return
        self._key, self._content = key, content
        known = content.place is not None or content.pose_xyyaw is not None or bool(content.path)
        self._box.show(TopMap(content) if known else None, "Nothing is known of this place yet.")
        self._tell()

    def on_resize(self) -> None:
        """Fit the legend."""
        self._tell()

    def _tell(self) -> None:
        content, size = self._content, self._box.size
        if content is None or size.width < 2 or size.height < 1:
            return
        window = Window.of(content, size.width, 2 * size.height)
        zoom = f" · {content.zoom:g}×" if content.zoom != 1 else ""
        truth = " · with the truth" if content.truth else ""
        self.border_title = f"Map{zoom}{truth}"
        self.border_subtitle = f"{window.wide_m:.1f} × {window.tall_m:.1f} m"
        colored, dark = not self.app.no_color, self.app.current_theme.dark
        entries = top_map.legend(content, dark=dark, colored=colored)
        self._legend.tell(panels.legend(entries, self.size.width - 2) if colored else LEGEND)
