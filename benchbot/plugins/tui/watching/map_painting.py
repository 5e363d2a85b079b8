"""A map from above in colours, painted finer than it is shown and averaged, so that thin lines stay lines."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw

from benchbot.plugins.tui.watching.colors import Color, Pixels, class_colors
from benchbot.plugins.tui.watching.map_window import MapContent, Point, Window, corners
from benchbot.plugins.watching.place import MapBox, Place

FINER = 3
ROBOT: Color = (255, 196, 0)
LASER: Color = (226, 84, 92)
ROBOT_RADIUS_M = 0.22


@dataclass(frozen=True)
class Palette:
    """The colours of a map on a dark or on a light terminal."""

    paper: Color
    floor: Color
    wall: Color
    planned: Color
    path: Color
    truth: Color


DARK = Palette((18, 20, 24), (40, 44, 51), (176, 182, 190), (116, 126, 142), (86, 180, 255), (120, 128, 120))
LIGHT = Palette((232, 234, 236), (252, 252, 250), (96, 102, 110), (168, 176, 188), (0, 100, 200), (190, 196, 188))


def paint(content: MapContent, window: Window, *, dark: bool, finer: int = FINER, robot: bool = True) -> Pixels:
    """Return the map, uint8 (window.height, window.width, 3); `robot` says whether to draw it, too."""
    fine = window.times(finer)
    palette = DARK if dark else LIGHT
    image = _base(_Same(content.place), content.truth, fine, palette, finer).copy()
    draw = ImageDraw.Draw(image)
    colors = class_colors(box.label for box in (*content.boxes, *content.truth))
    for box in sorted(content.boxes, key=_area, reverse=True):
        draw.rectangle(_rectangle(box, fine), outline=colors[box.label], width=finer)
    if content.laser is not None:
        for x, y in content.laser.tolist():
            _dot(draw, fine.point(x, y), finer * 0.25, LASER)
    if len(content.path) > 1:
        draw.line([fine.point(x, y) for x, y in content.path], fill=palette.path, width=finer, joint="curve")
    if robot and content.pose_xyyaw is not None:
        _draw_robot(draw, fine, content.pose_xyyaw, finer)
    return np.asarray(image.reduce(finer) if finer > 1 else image)


@dataclass(frozen=True, eq=False)
class _Same:
    """A place, compared by what it is and not by what is in it: arrays cannot be keys."""

    place: Place | None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.place is self.place

    def __hash__(self) -> int:
        return id(self.place)


@lru_cache(maxsize=8)
def _base(same: _Same, truth: tuple[MapBox, ...], window: Window, palette: Palette, finer: int) -> Image.Image:
    """Return what does not change while the robot drives."""
    image = Image.new("RGB", (window.width, window.height), palette.paper)
    place = same.place
    if place is not None and place.occupancy is not None:
        _paste_occupancy(image, place, window, palette)
    draw = ImageDraw.Draw(image)
    for box in sorted(truth, key=_area, reverse=True):
        draw.rectangle(_rectangle(box, window), fill=palette.truth)
    if place is not None:
        planned = [window.point(x, y) for x, y in place.trajectory_xy]
        if len(planned) > 1:
            draw.line(planned, fill=palette.planned, width=1)
        for point in planned:
            _dot(draw, point, finer * 0.35, palette.planned)
    return image


def _paste_occupancy(image: Image.Image, place: Place, window: Window, palette: Palette) -> None:
    occupancy = place.occupancy
    if occupancy is None:
        return
    rows, columns = occupancy.occupied.shape
    cell_m = occupancy.resolution_m
    left, bottom = window.point(*occupancy.low)
    right, top = window.point(*occupancy.high)
    # Only what is in the window is made larger: zoomed in, the whole floor would be a huge picture.
    crop_left, crop_right = max(0, math.floor(left)), min(window.width, math.ceil(right))
    crop_top, crop_bottom = max(0, math.floor(top)), min(window.height, math.ceil(bottom))
    if crop_left >= crop_right or crop_top >= crop_bottom:
        return
    per_pixel = 1 / (cell_m * window.pixels_per_m)
    part = (
        max(0.0, (crop_left - left) * per_pixel),
        max(0.0, (crop_top - top) * per_pixel),
        min(float(columns), (crop_right - left) * per_pixel),
        min(float(rows), (crop_bottom - top) * per_pixel),
    )
    if part[2] - part[0] < 1e-6 or part[3] - part[1] < 1e-6:
        return
    size = (crop_right - crop_left, crop_bottom - crop_top)
    grey = Image.fromarray(occupancy.occupied.astype(np.uint8) * 255).resize(size, Image.Resampling.BOX, part)
    # Where a third of a pixel is wall, it is one: thin walls are not to fade.
    share = np.minimum(np.asarray(grey, np.float32) / 255 * 3, 1.0)[..., None]
    floor, wall = np.array(palette.floor, np.float32), np.array(palette.wall, np.float32)
    image.paste(Image.fromarray((floor + (wall - floor) * share).astype(np.uint8)), (crop_left, crop_top))


def _draw_robot(draw: ImageDraw.ImageDraw, window: Window, pose: tuple[float, float, float], finer: int) -> None:
    x, y = window.point(*pose[:2])
    radius = max(ROBOT_RADIUS_M * window.pixels_per_m, 2.5 * finer)
    tip = [
        (x + length * radius * math.cos(pose[2] + turn), y - length * radius * math.sin(pose[2] + turn))
        for length, turn in ((1.5, 0.0), (1.0, 2.5), (0.4, math.pi), (1.0, -2.5))
    ]
    draw.polygon(tip, fill=ROBOT, outline=(60, 40, 0))


def _dot(draw: ImageDraw.ImageDraw, point: Point, radius: float, color: Color) -> None:
    x, y = point
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=color)


def _rectangle(box: MapBox, window: Window) -> tuple[float, float, float, float]:
    low, high = corners(box)
    (left, bottom), (right, top) = window.point(*low), window.point(*high)
    return left, top, right, bottom


def _area(box: MapBox) -> float:
    return box.box.extent[0] * box.box.extent[1]
