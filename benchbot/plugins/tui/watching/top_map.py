"""The map of a run as it is shown: in colours with characters on top, or in characters alone."""

from dataclasses import dataclass

from rich.color import Color as RichColor
from rich.style import Style
from textual.geometry import Size
from textual.strip import Strip

from benchbot.plugins.tui.watching import half_cells, map_characters
from benchbot.plugins.tui.watching.colors import Color, Pixels, class_colors
from benchbot.plugins.tui.watching.map_painting import DARK, LASER, LIGHT, ROBOT, paint
from benchbot.plugins.tui.watching.map_window import MapContent, Point, Window, arrow

ARROWS = "→↗↑↖←↙↓↘"
LEAST_COLUMNS_FOR_NAMES = 44
LONGEST_NAME = 10


@dataclass(frozen=True)
class TopMap:
    """A map from above, painted for whatever room there is."""

    content: MapContent

    def strips(self, size: Size, *, colored: bool, dark: bool) -> list[Strip]:
        """Return the lines that show it within a size."""
        if size.width < 2 or size.height < 1:
            return []
        window = Window.of(self.content, size.width, 2 * size.height)
        if not colored:
            return half_cells.plain(map_characters.write(self.content, window))
        pixels = paint(self.content, window, dark=dark, robot=False)
        return half_cells.colored(pixels, self._marks(window, dark=dark))

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it on so many pixels."""
        return paint(self.content, Window.of(self.content, size.width, size.height), dark=dark, finer=2)

    def _marks(self, window: Window, *, dark: bool) -> dict[tuple[int, int], tuple[str, Style]]:
        marks: dict[tuple[int, int], tuple[str, Style]] = {}
        if window.width >= LEAST_COLUMNS_FOR_NAMES or self.content.zoom > 1:
            colors = class_colors(box.label for box in (*self.content.boxes, *self.content.truth))
            plain = (200, 204, 210) if dark else (60, 64, 70)
            for box in self.content.boxes:
                _name(marks, window, box.box.centroid[:2], box.label, colors[box.label])
            for box in self.content.truth:
                _name(marks, window, box.box.centroid[:2], box.label, plain)
        if self.content.pose_xyyaw is not None:
            x, y, yaw_rad = self.content.pose_xyyaw
            style = Style(color=_rich((20, 16, 0)), bgcolor=_rich(ROBOT), bold=True)
            marks[_cell(window.point(x, y))] = (arrow(yaw_rad, ARROWS), style)
        return marks


def legend(content: MapContent, *, dark: bool, colored: bool) -> tuple[tuple[Color, str], ...]:
    """Return what the colours of a map mean, of what is on it; nothing where there are none."""
    if not colored:
        return ()
    palette = DARK if dark else LIGHT
    place = content.place
    found: list[tuple[Color, str]] = []
    if content.pose_xyyaw is not None:
        found.append((ROBOT, "robot"))
    if content.path:
        found.append((palette.path, "path"))
    if place is not None and place.trajectory_xy:
        found.append((palette.planned, "planned"))
    if content.laser is not None:
        found.append((LASER, "laser"))
    if content.truth:
        found.append((palette.truth, "truth"))
    return tuple(found)


def _name(
    marks: dict[tuple[int, int], tuple[str, Style]], window: Window, place: Point, label: str, color: Color
) -> None:
    """Write a name in the middle of its box, unless it would lie on another."""
    text = label if len(label) <= LONGEST_NAME else f"{label[: LONGEST_NAME - 1]}…"
    column, line = _cell(window.point(*place))
    column -= len(text) // 2
    cells = [(column + offset, line) for offset in range(len(text))]
    around = [(column - 1, line), *cells, (column + len(text), line)]
    if any(cell in marks for cell in around) or column < 0 or column + len(text) > window.width:
        return
    style = Style(color=_rich(color))
    marks.update({cell: (character, style) for cell, character in zip(cells, text, strict=True)})


def _cell(point: Point) -> tuple[int, int]:
    return int(point[0] // 1), int(point[1] // 2)


def _rich(color: Color) -> RichColor:
    return RichColor.from_rgb(*color)
