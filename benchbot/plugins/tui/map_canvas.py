"""The map of a run in the cells of a terminal: painted in colours with characters on top, or in characters alone.

Colours are painted finer than they are shown and averaged, so that thin lines stay lines.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw
from rich.color import Color as RichColor
from rich.style import Style
from textual.geometry import Size
from textual.strip import Strip

from benchbot.plugins.drawing.map_layout import MapTransform, Rectangle
from benchbot.plugins.drawing.map_model import FARTHEST_M, Box, MapObject, Occupancy, Point, SceneMap, Vector
from benchbot.plugins.drawing.palette import DARK, LASER, LIGHT, ROBOT, Color, Palette, Pixels, class_colors
from benchbot.plugins.tui import half_cells

MARGIN_M = 0.25
LEAST_M = 1.0
FINER = 3
ROBOT_RADIUS_M = 0.22
ARROWS, ASCII_ARROWS = "→↗↑↖←↙↓↘", ">/^\\</v\\"
CHARACTERS = "# wall  + planned  o path  * laser  A-Z object  (a-z true)  >^<v robot"
"""The legend of a map in characters alone."""
LEAST_COLUMNS_FOR_NAMES = 44
LONGEST_NAME = 10

Marks = dict[tuple[int, int], tuple[str, Style]]


@dataclass(frozen=True)
class RunMap:
    """The map of a scene, painted for whatever room there is; enlarged by `zoom`, the robot is in its middle."""

    scene: SceneMap
    zoom: float = 1.0

    def transform(self, width: int, height: int) -> MapTransform:
        """Return the transform to so many square pixels that shows all of the map, or a part of it."""
        scene = self.scene
        points = [*scene.planned, *scene.path.points]
        points += [pose[:2] for pose in (scene.start_xyyaw, scene.robot_xyyaw) if pose is not None]
        if scene.occupancy is not None:
            points += [scene.occupancy.low, scene.occupancy.high]
        else:
            # An estimate far outside must not make the rest small.
            points += [corner for _, box in scene.truth for corner in (box.low, box.high)]
        center = None if scene.robot_xyyaw is None else scene.robot_xyyaw[:2]
        frame = Rectangle(0, 0, width, height)
        return MapTransform.fit(frame, points, MARGIN_M, least_m=LEAST_M, zoom=self.zoom, center=center)

    def strips(self, size: Size, *, colored: bool, dark: bool, grid: tuple[int, int] = half_cells.HALF) -> list[Strip]:
        """Return the lines that show it within a size of cells of a grid of pixels each."""
        if size.width < 2 or size.height < 1:
            return []
        transform = self.transform(size.width, 2 * size.height)
        if not colored:
            return half_cells.plain(write(self.scene, transform))
        if grid == half_cells.HALF:
            pixels = paint(self.scene, transform, dark=dark, robot=False)
        else:
            fine = Image.fromarray(paint(self.scene, transform.scaled(grid[0]), dark=dark, robot=False))
            pixels = np.asarray(fine.resize((grid[0] * size.width, grid[1] * size.height), Image.Resampling.BOX))
        return half_cells.colored(pixels, self._marks(transform, size.width, DARK if dark else LIGHT), grid)

    def pixels(self, size: Size, *, dark: bool) -> Pixels:
        """Return it on so many pixels."""
        return paint(self.scene, self.transform(size.width, size.height), dark=dark, finer=2)

    def legend(self, *, dark: bool) -> tuple[tuple[Color, str], ...]:
        """Return the meaning of the colours that are on the map."""
        scene, palette = self.scene, DARK if dark else LIGHT
        entries = (
            (ROBOT, "robot", scene.robot_xyyaw is not None),
            (palette.path, "path", bool(scene.path.points)),
            (palette.planned, "planned", bool(scene.planned)),
            (LASER, "laser", scene.laser is not None),
            (palette.truth_solid, "truth", bool(scene.truth)),
        )
        return tuple((color, name) for color, name, is_there in entries if is_there)

    def _marks(self, transform: MapTransform, columns: int, palette: Palette) -> Marks:
        marks: Marks = {}
        scene = self.scene
        if columns >= LEAST_COLUMNS_FOR_NAMES or self.zoom > 1:
            colors = _class_colors(scene)
            for label, box in scene.estimates:
                _name(marks, columns, transform.point(*box.centroid[:2]), label, colors[label])
            for label, box in scene.truth:
                _name(marks, columns, transform.point(*box.centroid[:2]), label, palette.ink)
        if scene.robot_xyyaw is not None:
            x, y, yaw_rad = scene.robot_xyyaw
            style = Style(color=_rich((20, 16, 0)), bgcolor=_rich(ROBOT), bold=True)
            marks[_cell(transform.point(x, y))] = (arrow(yaw_rad, ARROWS), style)
        return marks


def cleaned(scene: SceneMap) -> SceneMap:
    """Return a map without what cannot be on one: coordinates that are no numbers, or beyond all reach."""

    def is_near(*values: float) -> bool:
        return all(abs(value) < FARTHEST_M for value in values)

    def is_sound(item: MapObject) -> bool:
        return all(is_near(*box.centroid, *box.extent) and min(box.extent) >= 0 for box in item.boxes)

    robot, laser = scene.robot_xyyaw, scene.laser
    return replace(
        scene,
        robot_xyyaw=robot if robot is not None and is_near(*robot) else None,
        path=replace(scene.path, points=tuple(point for point in scene.path.points if is_near(*point))),
        laser=None if laser is None else laser[(abs(laser) < FARTHEST_M).all(1)],
        objects=tuple(filter(is_sound, scene.objects)),
    )


def arrow(yaw_rad: float, arrows: str) -> str:
    """Return the one of eight arrows, the first to the right and the others counter-clockwise, that points so."""
    return arrows[round(yaw_rad / (math.pi / 4)) % 8]


def paint(scene: SceneMap, transform: MapTransform, *, dark: bool, finer: int = FINER, robot: bool = True) -> Pixels:
    """Return the map in the frame of a transform, uint8 (height, width, 3); `robot` says whether to draw it, too."""
    fine, palette = transform.scaled(finer), DARK if dark else LIGHT
    truth = tuple(box for _, box in scene.truth)
    image = _background(scene.occupancy, truth, scene.planned, fine, palette, finer).copy()
    draw = ImageDraw.Draw(image)
    colors = _class_colors(scene)
    for label, box in scene.estimates:
        draw.rectangle(fine.rectangle(box).corners, outline=colors[label], width=finer)
    if scene.laser is not None:
        for x, y in scene.laser.tolist():
            _dot(draw, fine.point(x, y), finer * 0.25, LASER)
    if len(scene.path.points) > 1:
        path = [fine.point(x, y) for x, y in scene.path.points]
        draw.line(path, fill=palette.path, width=finer, joint="curve")
    if robot and scene.robot_xyyaw is not None:
        _draw_robot(draw, fine, scene.robot_xyyaw, finer)
    return np.asarray(image.reduce(finer) if finer > 1 else image)


@lru_cache(maxsize=8)
def _background(
    occupancy: Occupancy | None,
    truth: tuple[Box, ...],
    planned: Sequence[Point],
    transform: MapTransform,
    palette: Palette,
    finer: int,
) -> Image.Image:
    """Return what does not change while the robot drives."""
    image = Image.new("RGB", (round(transform.frame.width), round(transform.frame.height)), palette.paper)
    if occupancy is not None:
        _paste_occupancy(image, occupancy, transform, palette)
    draw = ImageDraw.Draw(image)
    for box in truth:
        draw.rectangle(transform.rectangle(box).corners, fill=palette.truth_solid)
    points = [transform.point(x, y) for x, y in planned]
    if len(points) > 1:
        draw.line(points, fill=palette.planned, width=1)
    for point in points:
        _dot(draw, point, finer * 0.35, palette.planned)
    return image


def _paste_occupancy(image: Image.Image, occupancy: Occupancy, transform: MapTransform, palette: Palette) -> None:
    rows, columns = occupancy.occupied.shape
    floor = transform.rectangle(occupancy)
    # Only what is in the frame is made larger: zoomed in, the whole floor would be a huge picture.
    left, right = max(0, math.floor(floor.left)), min(image.width, math.ceil(floor.right))
    top, bottom = max(0, math.floor(floor.top)), min(image.height, math.ceil(floor.bottom))
    if left >= right or top >= bottom:
        return
    cells_per_pixel = 1 / (occupancy.resolution_m * transform.pixels_per_m)
    part = (
        max(0.0, (left - floor.left) * cells_per_pixel),
        max(0.0, (top - floor.top) * cells_per_pixel),
        min(float(columns), (right - floor.left) * cells_per_pixel),
        min(float(rows), (bottom - floor.top) * cells_per_pixel),
    )
    if part[2] - part[0] < 1e-6 or part[3] - part[1] < 1e-6:
        return
    occupied = Image.fromarray(occupancy.occupied.astype(np.uint8) * 255)
    share = occupied.resize((right - left, bottom - top), Image.Resampling.BOX, part)
    # Where a third of a pixel is wall, it is one: thin walls are not to fade.
    share = share.point(lambda value: min(3 * value, 255))
    image.paste(palette.floor, (left, top, right, bottom))
    image.paste(palette.wall, (left, top), share)


def _draw_robot(draw: ImageDraw.ImageDraw, transform: MapTransform, pose: Vector, finer: int) -> None:
    x, y = transform.point(*pose[:2])
    radius = max(ROBOT_RADIUS_M * transform.pixels_per_m, 2.5 * finer)
    tip = [
        (x + length * radius * math.cos(pose[2] + turn), y - length * radius * math.sin(pose[2] + turn))
        for length, turn in ((1.5, 0.0), (1.0, 2.5), (0.4, math.pi), (1.0, -2.5))
    ]
    draw.polygon(tip, fill=ROBOT, outline=(60, 40, 0))


def _dot(draw: ImageDraw.ImageDraw, point: Point, radius: float, color: Color) -> None:
    x, y = point
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=color)


def write(scene: SceneMap, transform: MapTransform) -> list[str]:
    """Return the lines of the map in characters; the pixels of the transform are half a character high."""
    lines, columns = round(transform.frame.height) // 2, round(transform.frame.width)
    grid = [[" "] * columns for _ in range(lines)]

    def put(x: float, y: float, character: str) -> None:
        column, line = _cell(transform.point(x, y))
        if 0 <= column < columns and 0 <= line < lines:
            grid[line][column] = character

    if scene.laser is not None:
        for x, y in scene.laser.tolist():
            put(x, y, "*")
    if scene.occupancy is not None:
        (left, _), (_, top), cell_m = scene.occupancy.low, scene.occupancy.high, scene.occupancy.resolution_m
        for row, column in np.argwhere(scene.occupancy.occupied).tolist():
            put(left + (column + 0.5) * cell_m, top - (row + 0.5) * cell_m, "#")
    for x, y in scene.planned:
        put(x, y, "+")
    for label, box in scene.truth:
        put(*box.centroid[:2], label[:1].lower() or "?")
    for label, box in scene.estimates:
        put(*box.centroid[:2], label[:1].upper() or "?")
    for start, end in zip(scene.path.points, scene.path.points[1:], strict=False):
        cells = max(abs(a - b) for a, b in zip(transform.point(*start), transform.point(*end), strict=True))
        for x, y in np.linspace(start, end, min(500, 2 + int(cells))).tolist():
            put(x, y, "o")
    if scene.robot_xyyaw is not None:
        x, y, yaw_rad = scene.robot_xyyaw
        put(x, y, arrow(yaw_rad, ASCII_ARROWS))
    return ["".join(line) for line in grid]


def _name(marks: Marks, columns: int, point: Point, label: str, color: Color) -> None:
    """Write a name in the middle of its box, unless it would lie on another."""
    text = label if len(label) <= LONGEST_NAME else f"{label[: LONGEST_NAME - 1]}…"
    column, line = _cell(point)
    column -= len(text) // 2
    cells = [(column + offset, line) for offset in range(len(text))]
    around = [(column - 1, line), *cells, (column + len(text), line)]
    if any(cell in marks for cell in around) or column < 0 or column + len(text) > columns:
        return
    style = Style(color=_rich(color))
    marks.update({cell: (character, style) for cell, character in zip(cells, text, strict=True)})


def _cell(point: Point) -> tuple[int, int]:
    return int(point[0] // 1), int(point[1] // 2)


def _class_colors(scene: SceneMap) -> dict[str, Color]:
    return class_colors(label for label, _ in (*scene.estimates, *scene.truth))


def _rich(color: Color) -> RichColor:
    return RichColor.from_rgb(*color)
