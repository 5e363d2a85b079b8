"""One picture of one result: what the robot saw, what it mapped beside what is there, and the score."""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.map_layout import MapLayout, MapTransform, Rectangle, lay_out
from benchbot.plugins.drawing.map_model import (
    MapPath,
    Occupancy,
    Point,
    SceneMap,
    estimated_objects,
    planar,
    true_objects,
)
from benchbot.plugins.drawing.palette import LIGHT, PRINT_CLASSES, Color, between, class_colors

WIDTH_PX, HEIGHT_PX = 1840, 1000
# Everything is drawn twice as large and scaled down, which smooths all edges.
_SCALE = 2
_MARGIN, _GAP, _HEADER, _FOOTER = 44, 12, 92, 62
_STRIP_WIDTH, _SCORES_WIDTH = 560, 250
_BADGE_PX = 16
_VIEW_CONE_M = 0.62
_BAR: Color = (226, 229, 233)
_WHITE: Color = (255, 255, 255)


def draw(
    frames: Mapping[int, NDArray[np.uint8]],
    result: Mapping[str, Any],
    ground_truth: Mapping[str, Any],
    scores: Mapping[str, Any],
    trajectory: Sequence[Pose],
    occupancy: Occupancy | None = None,
) -> Image.Image:
    """Return the picture of a result, 1840 x 1000 pixels, RGB.

    `frames` holds colour images (H, W, 3), sRGB, by the index of the pose in `trajectory` that each was taken
    from; three or four are best. `scores` is the scores document.
    """
    image = Image.new("RGB", (WIDTH_PX * _SCALE, HEIGHT_PX * _SCALE), _WHITE)
    pencil = ImageDraw.Draw(image, "RGBA")
    truth, estimates = true_objects(ground_truth["ground_truth"]), estimated_objects(result["results"])
    path = MapPath(tuple(map(planar, trajectory)))
    scene = SceneMap(occupancy=occupancy, objects=(*truth, *estimates), path=path).without_far()
    counts = [f"{len(truth)} objects are there, {len(estimates)} are mapped"]
    if outside := len(truth) + len(estimates) - len(scene.objects):
        counts.append(f"{outside} of them far outside of the map")
    colors = class_colors((item.name for item in scene.objects), PRINT_CLASSES)
    top, bottom = _HEADER, HEIGHT_PX - _FOOTER
    _draw_header(pencil, result)
    strip_right = _draw_frames(image, pencil, frames, top, bottom)
    frame = Rectangle(strip_right + 78, top, WIDTH_PX - _MARGIN - _SCORES_WIDTH - 40, bottom)
    transform = MapTransform.fit(_scaled(frame), scene.points)
    taken_at = [trajectory[index] for index in frames]
    layout = lay_out(scene, transform, _label_size, taken_at, scale=_SCALE, badge_px=_BADGE_PX * _SCALE)
    draw_map(image, pencil, scene, layout, colors)
    _draw_scores(pencil, frame.right + 40, top, scores, counts)
    _draw_key(pencil, frame.right + 40, bottom, colors, result)
    return image.resize((WIDTH_PX, HEIGHT_PX), Image.Resampling.LANCZOS)


def draw_map(
    image: Image.Image, pencil: ImageDraw.ImageDraw, scene: SceneMap, layout: MapLayout, colors: Mapping[str, Color]
) -> None:
    """Draw a map into an image: true objects filled, estimated ones as outlines in the colours of their classes."""
    _draw_grid(pencil, layout)
    if scene.occupancy is not None and layout.floor is not None:
        size = (round(layout.floor.width), round(layout.floor.height))
        cells = Image.fromarray(scene.occupancy.occupied.astype(np.uint8) * 255).resize(size, Image.Resampling.NEAREST)
        image.paste(between(LIGHT.wall, LIGHT.floor, 0.5), (round(layout.floor.left), round(layout.floor.top)), cells)
    for shape in layout.shapes:
        if shape.role == "truth":
            look = {"fill": LIGHT.truth_fill, "outline": LIGHT.truth_line, "width": round(1.5 * _SCALE)}
        else:
            color = colors[shape.label]
            look = {"fill": (*color, 38), "outline": color, "width": round(2.5 * _SCALE)}
        pencil.rectangle(shape.box.corners, **look)  # type: ignore[arg-type]
    for marker in layout.markers:
        degrees = -math.degrees(marker.yaw_rad)
        for reach, alpha in ((1.0, 24), (0.66, 26)):
            disc = _disc(marker.point, _VIEW_CONE_M * layout.transform.pixels_per_m * reach)
            pencil.pieslice(disc, degrees - 45, degrees + 45, fill=(*LIGHT.path, alpha))
    _draw_path(pencil, layout.path)
    for label in layout.labels:
        color = between(colors[label.label], (0, 0, 0), 0.3)
        if label.leader is not None:
            pencil.line(label.leader, fill=color, width=round(1.2 * _SCALE))
        pencil.rounded_rectangle(label.box.corners, radius=4 * _SCALE, fill=(*_WHITE, 205))
        pencil.text(label.box.center, label.text, fill=color, font=_font(13 * _SCALE), anchor="mm")
    for marker in layout.markers:
        _draw_badge(pencil, marker.badge, str(marker.number))


def _draw_grid(pencil: ImageDraw.ImageDraw, layout: MapLayout) -> None:
    frame, font = layout.transform.frame, _font(12 * _SCALE)
    pencil.rectangle(frame.corners, fill=LIGHT.floor)
    for x, metre in layout.columns:
        pencil.line((x, frame.top, x, frame.bottom), fill=LIGHT.grid, width=_SCALE)
        pencil.text((x, frame.bottom + 7 * _SCALE), f"{metre} m", LIGHT.faint, font, anchor="ma")
    for y, metre in layout.rows:
        pencil.line((frame.left, y, frame.right, y), fill=LIGHT.grid, width=_SCALE)
        pencil.text((frame.left - 8 * _SCALE, y), f"{metre} m", LIGHT.faint, font, anchor="rm")
    pencil.rectangle(frame.corners, outline=(205, 208, 212), width=_SCALE)


def _draw_path(pencil: ImageDraw.ImageDraw, path: Sequence[Point]) -> None:
    colors = [between(LIGHT.path_start, LIGHT.path, i / len(path)) for i in range(len(path))]
    for start, end, color in zip(path, path[1:], colors[1:], strict=False):
        pencil.line((*start, *end), fill=color, width=3 * _SCALE)
    for i, (point, color) in enumerate(zip(path, colors, strict=True)):
        disc = _disc(point, (5 if i in (0, len(path) - 1) else 2.6) * _SCALE)
        pencil.ellipse(disc, fill=_WHITE if i == 0 else color, outline=color, width=2 * _SCALE)


def _draw_badge(pencil: ImageDraw.ImageDraw, center: Point, text: str) -> None:
    pencil.ellipse(_disc(center, 11 * _SCALE), fill=LIGHT.ink, outline=_WHITE, width=2 * _SCALE)
    pencil.text(center, text, fill=_WHITE, font=_font(13 * _SCALE), anchor="mm")


def _label_size(text: str) -> tuple[float, float]:
    return _font(13 * _SCALE).getbbox(text)[2] + 6 * _SCALE, 19 * _SCALE


def _disc(center: Point, radius: float) -> tuple[float, float, float, float]:
    x, y = center
    return x - radius, y - radius, x + radius, y + radius


@lru_cache(maxsize=32)
def _font(size_px: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return Pillow's own typeface, which is on every machine."""
    return ImageFont.load_default(size_px)


def _draw_header(pencil: ImageDraw.ImageDraw, result: Mapping[str, Any]) -> None:
    scenes = result["environment_details"]
    environment = ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])
    _text(pencil, _MARGIN, 40, environment, 27, LIGHT.ink, "ls", bold=True)
    _text(pencil, _MARGIN, 66, result["task_details"]["name"], 15, LIGHT.faint, "ls")


def _draw_frames(
    image: Image.Image,
    pencil: ImageDraw.ImageDraw,
    frames: Mapping[int, NDArray[np.uint8]],
    top: float,
    bottom: float,
) -> float:
    """Draw the pictures below one another; return where the strip ends on the right."""
    if not frames:
        return _MARGIN - 30
    tallest = (bottom - top - _GAP * (len(frames) - 1)) / len(frames)
    right = float(_MARGIN)
    for number, frame in enumerate(frames.values(), 1):
        width = min(tallest * frame.shape[1] / frame.shape[0], _STRIP_WIDTH)
        height = width * frame.shape[0] / frame.shape[1]
        place = _scaled(Rectangle(_MARGIN, top, _MARGIN + width, top + height))
        size = (round(place.width), round(place.height))
        image.paste(
            Image.fromarray(frame).resize(size, Image.Resampling.LANCZOS), (round(place.left), round(place.top))
        )
        _draw_badge(pencil, (place.left + 22 * _SCALE, place.top + 22 * _SCALE), str(number))
        top += height + _GAP
        right = max(right, _MARGIN + width)
    return right


def _draw_scores(
    pencil: ImageDraw.ImageDraw, left: float, top: float, scores: Mapping[str, Any], counts: Sequence[str]
) -> None:
    headline = scores["method"]["headline"]
    values = scores["scores"]
    _text(pencil, left, top + 14, headline, 17, LIGHT.faint, "ls")
    _text(pencil, left - 3, top + 84, f"{values[headline]:.2f}", 76, LIGHT.ink, "ls", bold=True)
    y = top + 128
    for name, value in values.items():
        if name == headline:
            continue
        _text(pencil, left, y, _words(name), 14, LIGHT.ink, "ls")
        _text(pencil, left + _SCORES_WIDTH, y, f"{value:.2f}", 14, LIGHT.ink, "rs")
        bar = Rectangle(left, y + 8, left + _SCORES_WIDTH, y + 14)
        pencil.rounded_rectangle(_scaled(bar).corners, radius=3 * _SCALE, fill=_BAR)
        filled = Rectangle(left, bar.top, left + max(_SCORES_WIDTH * value, 6), bar.bottom)
        pencil.rounded_rectangle(_scaled(filled).corners, radius=3 * _SCALE, fill=LIGHT.path)
        y += 46
    for number, line in enumerate(counts):
        _text(pencil, left, y + 8 + 20 * number, line, 14, LIGHT.faint, "ls")


def _draw_key(
    pencil: ImageDraw.ImageDraw, left: float, bottom: float, colors: Mapping[str, Color], result: Mapping[str, Any]
) -> None:
    provenance = result.get("provenance") or {}
    selection = provenance.get("selection", {})
    lines = [f"robot {selection['robot']}, seed {selection['seed']}"] if selection else []
    if provenance:
        lines.append(f"benchbot {provenance['benchbot']}, {provenance['steps']} steps")
        lines.append(f"observations {provenance['observation_digest'][:16]}")
    y = bottom - 4
    for line in reversed(lines):
        _text(pencil, left, y, line, 13, LIGHT.faint, "ls")
        y -= 20
    y -= 12
    swatches = [_scaled(Rectangle(left, y - 13 - 26 * i, left + 26, y + 1 - 26 * i)).corners for i in range(3)]
    for i, text in enumerate(("path of the robot", "estimate, coloured by class", "ground truth")):
        _text(pencil, left + 38, y - 26 * i, text, 14, LIGHT.ink, "ls")
    x0, y0, x1, y1 = swatches[0]
    pencil.line((x0, (y0 + y1) / 2, x1, (y0 + y1) / 2), fill=LIGHT.path, width=3 * _SCALE)
    sample = next(iter(colors.values()), LIGHT.ink)
    pencil.rectangle(swatches[1], fill=(*sample, 38), outline=sample, width=round(2.5 * _SCALE))
    pencil.rectangle(swatches[2], fill=LIGHT.truth_fill, outline=LIGHT.truth_line, width=round(1.5 * _SCALE))


def _words(name: str) -> str:
    return {"avg_fp_quality": "false-positive quality"}.get(name, name.removeprefix("avg_").replace("_", " "))


def _text(
    pencil: ImageDraw.ImageDraw,
    x: float,
    y: float,
    text: str,
    size: float,
    color: Color,
    anchor: str,
    *,
    bold: bool = False,
) -> None:
    stroke = size * _SCALE / 40 if bold else 0
    pencil.text(
        (x * _SCALE, y * _SCALE), text, fill=color, font=_font(size * _SCALE), anchor=anchor, stroke_width=stroke
    )


def _scaled(box: Rectangle) -> Rectangle:
    return Rectangle(*(value * _SCALE for value in box.corners))
