"""A map from above in characters alone, for terminals without colour and eyes that want none."""

import numpy as np

from benchbot.plugins.tui.watching.map_window import MapContent, Point, Window, arrow, corners

ARROWS = ">/^\\</v\\"
LEGEND = "# wall  + planned  o path  * laser  A-Z object  (a-z true)  >^<v robot"


def write(content: MapContent, window: Window) -> list[str]:
    """Return the lines of the map; the window's pixels are half a character high."""
    lines, columns = window.height // 2, window.width
    grid = [[" "] * columns for _ in range(lines)]

    def put(point: Point, character: str) -> None:
        column, line = int(point[0] // 1), int(point[1] // 2)
        if 0 <= column < columns and 0 <= line < lines:
            grid[line][column] = character

    if content.laser is not None:
        for x, y in content.laser.tolist():
            put(window.point(x, y), "*")
    _put_walls(content, window, grid)
    place = content.place
    for x, y in place.trajectory_xy if place is not None else ():
        put(window.point(x, y), "+")
    for boxes, upper in ((content.truth, False), (content.boxes, True)):
        for box in boxes:
            letter = box.label[:1].upper() if upper else box.label[:1].lower()
            (x0, y0), (x1, y1) = corners(box)
            put(window.point((x0 + x1) / 2, (y0 + y1) / 2), letter or "?")
    for start, end in zip(content.path, content.path[1:], strict=False):
        for share in np.linspace(0, 1, _count(window.point(*start), window.point(*end))).tolist():
            x, y = start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share
            put(window.point(x, y), "o")
    if content.pose_xyyaw is not None:
        x, y, yaw_rad = content.pose_xyyaw
        put(window.point(x, y), arrow(yaw_rad, ARROWS))
    return ["".join(line) for line in grid]


def _put_walls(content: MapContent, window: Window, grid: list[list[str]]) -> None:
    occupancy = None if content.place is None else content.place.occupancy
    if occupancy is None:
        return
    rows, columns = np.nonzero(occupancy.occupied)
    x = occupancy.low[0] + (columns + 0.5) * occupancy.resolution_m
    y = occupancy.high[1] - (rows + 0.5) * occupancy.resolution_m
    places = {
        (int(column), int(line))
        for column, line in zip(
            np.floor((x - window.left_m) * window.pixels_per_m),
            np.floor((window.top_m - y) * window.pixels_per_m / 2),
            strict=True,
        )
    }
    for column, line in places:
        if 0 <= line < len(grid) and 0 <= column < len(grid[line]):
            grid[line][column] = "#"


def _count(start: Point, end: Point) -> int:
    return min(500, 2 + int(max(abs(start[0] - end[0]), abs(start[1] - end[1]))))
