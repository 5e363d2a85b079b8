"""A top-down map of true and estimated objects, the path that was driven, and where pictures were taken."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from PIL import ImageDraw, ImageFont

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.label_placement import Rectangle, place

Color = tuple[int, int, int]

INK: Color = (38, 42, 48)
FAINT: Color = (128, 134, 142)
GRID: Color = (232, 234, 237)
PAPER: Color = (250, 250, 249)
TRUTH_FILL: Color = (221, 223, 226)
TRUTH_LINE: Color = (150, 155, 162)
PATH_START: Color = (140, 178, 214)
PATH_END: Color = (22, 66, 120)

# After Paul Tol's "muted" scheme, made for colour-blind eyes (SRON/EPS/TN/09-002, issue 3.2), light colours darkened.
CLASS_COLORS: tuple[Color, ...] = (
    (51, 34, 136), (204, 102, 119), (17, 119, 51), (170, 68, 153), (221, 170, 51), (68, 170, 153),
    (136, 34, 85), (238, 102, 51), (0, 119, 187), (128, 128, 30), (148, 86, 44), (0, 145, 170),
)  # fmt: skip


@dataclass(frozen=True)
class Thing:
    """A box seen from above: its class and its corners in the map frame, metres."""

    label: str
    lower: tuple[float, float]
    upper: tuple[float, float]

    @property
    def area(self) -> float:
        """Footprint in square metres."""
        return (self.upper[0] - self.lower[0]) * (self.upper[1] - self.lower[1])

    @classmethod
    def of(cls, item: Mapping[str, Any], label: str) -> "Thing":
        """Return the footprint of an object with a centroid and an extent."""
        (x, y), (width, depth) = item["centroid"][:2], item["extent"][:2]
        return cls(label, (x - width / 2, y - depth / 2), (x + width / 2, y + depth / 2))


@dataclass(frozen=True)
class View:
    """Where the map frame lands on the paper: x right, y up, one scale for both."""

    frame: Rectangle
    left_m: float
    top_m: float
    pixels_per_m: float

    @classmethod
    def of(cls, frame: Rectangle, points: Sequence[tuple[float, float]], margin_m: float = 0.35) -> "View":
        """Return the view that shows all points, in the middle of `frame`."""
        xs, ys = [x for x, _ in points] or [0.0], [y for _, y in points] or [0.0]
        width_m = max(xs) - min(xs) + 2 * margin_m
        height_m = max(ys) - min(ys) + 2 * margin_m
        width, height = frame.right - frame.left, frame.bottom - frame.top
        scale = min(width / width_m, height / height_m)
        center_x, center_y = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
        return cls(frame, center_x - width / 2 / scale, center_y + height / 2 / scale, scale)

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the map lands."""
        return (
            self.frame.left + (x - self.left_m) * self.pixels_per_m,
            self.frame.top + (self.top_m - y) * self.pixels_per_m,
        )

    def box(self, thing: Thing) -> Rectangle:
        """Return where a footprint lands."""
        (left, bottom), (right, top) = self.point(*thing.lower), self.point(*thing.upper)
        return Rectangle(left, top, right, bottom)


def draw_map(
    draw: ImageDraw.ImageDraw,
    frame: Rectangle,
    truth: Sequence[Thing],
    estimate: Sequence[Thing],
    trajectory: Sequence[Pose],
    marked: Mapping[int, str],
    scale: float,
) -> None:
    """Draw the map into `frame`. `marked` names poses of the trajectory by index; `scale` is that of lines and text."""
    path = [(pose.translation_xyz[0], pose.translation_xyz[1]) for pose in trajectory]
    corners = [corner for thing in [*truth, *estimate] for corner in (thing.lower, thing.upper)]
    view = View.of(frame, [*path, *corners])
    _draw_grid(draw, view, scale)
    colors = class_colors([*truth, *estimate])
    for thing in sorted(truth, key=lambda thing: -thing.area):
        box = view.box(thing)
        draw.rectangle(_xy(box), fill=TRUTH_FILL, outline=TRUTH_LINE, width=round(1.5 * scale))
    for thing in sorted(estimate, key=lambda thing: -thing.area):
        color = colors[thing.label]
        box = view.box(thing)
        draw.rectangle(_xy(box), fill=(*color, 38), outline=color, width=round(2.5 * scale))
    pixels = [view.point(x, y) for x, y in path]
    for index in marked:
        _draw_view_cone(draw, pixels[index], trajectory[index].yaw_rad, 0.62 * view.pixels_per_m)
    _draw_path(draw, pixels, scale)
    named = list(estimate or truth)
    texts = [font(13 * scale).getbbox(thing.label) for thing in named]
    sizes = [(text[2] + 6 * scale, 19 * scale) for text in texts]
    boxes = [view.box(thing) for thing in named]
    obstacles = [*pixels, *(_badge_center(pixels[index], trajectory[index].yaw_rad, scale) for index in marked)]
    for thing, box, label in zip(named, boxes, place(boxes, sizes, obstacles, frame, scale), strict=True):
        _draw_label(draw, thing.label, box, label, _darker(colors[thing.label]), scale)
    for index, name in marked.items():
        draw_badge(draw, _badge_center(pixels[index], trajectory[index].yaw_rad, scale), name, scale)


def class_colors(things: Sequence[Thing]) -> dict[str, Color]:
    """Return a colour for each class, the same for the same set of classes."""
    names = sorted({thing.label for thing in things})
    return {name: CLASS_COLORS[i % len(CLASS_COLORS)] for i, name in enumerate(names)}


def draw_badge(draw: ImageDraw.ImageDraw, center: tuple[float, float], name: str, scale: float) -> None:
    """Draw a name in a filled circle."""
    x, y = center
    radius = 11 * scale
    draw.ellipse(
        (x - radius, y - radius, x + radius, y + radius), fill=INK, outline=(255, 255, 255), width=round(2 * scale)
    )
    draw.text((x, y), name, fill=(255, 255, 255), font=font(13 * scale), anchor="mm")


@lru_cache(maxsize=32)
def font(size_px: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return Pillow's own typeface, which is on every machine."""
    return ImageFont.load_default(size_px)


def _draw_grid(draw: ImageDraw.ImageDraw, view: View, scale: float) -> None:
    frame = view.frame
    draw.rectangle(_xy(frame), fill=PAPER)
    right_m = view.left_m + (frame.right - frame.left) / view.pixels_per_m
    bottom_m = view.top_m - (frame.bottom - frame.top) / view.pixels_per_m
    step_m = 1 if view.pixels_per_m > 40 * scale else 5
    for metre in range(math.ceil(view.left_m / step_m) * step_m, math.floor(right_m) + 1, step_m):
        x, _ = view.point(metre, 0)
        draw.line((x, frame.top, x, frame.bottom), fill=GRID, width=round(scale))
        draw.text((x, frame.bottom + 7 * scale), f"{metre} m", FAINT, font(12 * scale), anchor="ma")
    for metre in range(math.ceil(bottom_m / step_m) * step_m, math.floor(view.top_m) + 1, step_m):
        _, y = view.point(0, metre)
        draw.line((frame.left, y, frame.right, y), fill=GRID, width=round(scale))
        draw.text((frame.left - 8 * scale, y), f"{metre} m", FAINT, font(12 * scale), anchor="rm")
    draw.rectangle(_xy(frame), outline=(205, 208, 212), width=round(scale))


def _draw_path(draw: ImageDraw.ImageDraw, pixels: Sequence[tuple[float, float]], scale: float) -> None:
    for i in range(1, len(pixels)):
        color = _between(PATH_START, PATH_END, i / len(pixels))
        draw.line((*pixels[i - 1], *pixels[i]), fill=color, width=round(3 * scale))
    for i, (x, y) in enumerate(pixels):
        radius = (5 if i in (0, len(pixels) - 1) else 2.6) * scale
        color = _between(PATH_START, PATH_END, i / len(pixels))
        fill = (255, 255, 255) if i == 0 else color
        draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill, outline=color, width=round(2 * scale))


def _draw_view_cone(draw: ImageDraw.ImageDraw, apex: tuple[float, float], yaw_rad: float, length: float) -> None:
    x, y = apex
    degrees = -math.degrees(yaw_rad)
    for reach, alpha in ((1.0, 24), (0.66, 26)):
        r = length * reach
        draw.pieslice((x - r, y - r, x + r, y + r), degrees - 45, degrees + 45, fill=(*PATH_END, alpha))


def _draw_label(
    draw: ImageDraw.ImageDraw, text: str, box: Rectangle, label: Rectangle, color: Color, scale: float
) -> None:
    start = box.nearest(*label.center)
    end = label.nearest(*start)
    if math.dist(start, end) > 7 * scale:
        draw.line((*start, *end), fill=color, width=round(1.2 * scale))
    draw.rounded_rectangle(_xy(label), radius=4 * scale, fill=(255, 255, 255, 205))
    draw.text(label.center, text, fill=color, font=font(13 * scale), anchor="mm")


def _badge_center(apex: tuple[float, float], yaw_rad: float, scale: float) -> tuple[float, float]:
    """Behind the camera, so that the badge does not cover what it looks at."""
    return (apex[0] - 16 * scale * math.cos(yaw_rad), apex[1] + 16 * scale * math.sin(yaw_rad))


def _between(first: Color, second: Color, share: float) -> Color:
    r, g, b = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return (r, g, b)


def _darker(color: Color) -> Color:
    return _between(color, (0, 0, 0), 0.3)


def _xy(box: Rectangle) -> tuple[float, float, float, float]:
    return (box.left, box.top, box.right, box.bottom)
