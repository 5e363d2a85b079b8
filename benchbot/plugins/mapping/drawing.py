"""Boxes drawn over what a camera saw: what is in front of them hides their edges, and no label hides another.

Pillow draws, which BenchBot always has; the pictures are arrays as OpenCV takes them, but in the order R, G, B.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import CameraModel, FramePose
from benchbot.plugins.drawing.palette import Color, class_colors
from benchbot.plugins.mapping.objects import MappedObject
from benchbot.plugins.mapping.projection import NEAREST_M, Floats, check_size, project

if TYPE_CHECKING:
    from PIL import Image

Pixels = NDArray[np.float64]

# Lines are drawn twice as large and scaled down, which smooths them.
_SMOOTHING = 2
_SAMPLES = 96
_LEAST_VISIBLE = 0.05
_SURFACE_M, _SURFACE_SHARE = 0.02, 0.01
_LUMINANCE, _MIDDLE = (0.2126, 0.7152, 0.0722), 105
# Corners by their bits (x, y, z); an edge joins two that differ in one.
_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], bool)
_EDGES = [(i, j) for i, j in combinations(range(8), 2) if (i ^ j) in (1, 2, 4)]


@dataclass(frozen=True)
class _Wire:
    """The edges of a box in a picture: pieces of lines with whether they are hidden; left, top, right, bottom."""

    item: MappedObject
    pieces: list[tuple[Pixels, bool]]
    corners: tuple[float, float, float, float]
    distance_m: float


def draw_boxes(
    picture: NDArray[np.uint8],
    objects: Sequence[MappedObject],
    info: CameraModel,
    pose: FramePose,
    depth_m: Floats | None = None,
    width_px: int | None = None,
) -> NDArray[np.uint8]:
    """Return a colour picture (H, W, 3), sRGB, with boxes and their classes drawn over it.

    `info` and `pose` are those of the picture's camera; `depth_m` (H, W), of the same camera, tells what hides edges.
    Hidden edges are dashed; a box that is all but hidden is left out. Without depth, the edges at a box's own back are
    dashed. A class is followed by its probability when that is below 1; a label for which there is no room is left
    out. `width_px` makes the picture larger, so that the labels of a small one can be read.
    """
    from PIL import Image, ImageDraw

    check_size(picture, info)
    if depth_m is not None:
        check_size(depth_m, info)
    scale = 1.0 if width_px is None else width_px / picture.shape[1]
    size = (round(picture.shape[1] * scale), round(picture.shape[0] * scale))
    wires = [wire for item in objects for wire in _wires(item, info, pose, depth_m, scale)]
    colors = class_colors(item.label for item in objects)
    overlay = Image.new("RGBA", (size[0] * _SMOOTHING, size[1] * _SMOOTHING))
    pencil = ImageDraw.Draw(overlay)
    line_px = max(size[0] / 550, 1.5)
    # From the back to the front, so that near boxes are drawn over far ones.
    for wire in sorted(wires, key=lambda wire: -wire.distance_m):
        color = colors[wire.item.label]
        for look, thick_px in (((*_shade(color), 150), 2 * line_px), ((*color, 255), line_px)):
            for points, hidden in wire.pieces:
                for line in _dashes(points, 4 * line_px) if hidden else [_thinned(points)]:
                    ends = [tuple(point) for point in (line * _SMOOTHING).tolist()]
                    pencil.line(ends, fill=look, width=round(thick_px * _SMOOTHING), joint="curve")
    drawn = Image.fromarray(picture).convert("RGBA").resize(size, Image.Resampling.BICUBIC)
    drawn.alpha_composite(overlay.resize(size, Image.Resampling.LANCZOS))
    _draw_labels(drawn, wires, colors)
    return np.asarray(drawn.convert("RGB"))


def _wires(
    item: MappedObject, info: CameraModel, pose: FramePose, depth_m: Floats | None, scale: float
) -> Iterator[_Wire]:
    """Yield the box in the picture, if it is to be seen."""
    lower, upper = np.asarray(item.lower, np.float64), np.asarray(item.upper, np.float64)
    corners = np.where(_CORNERS, upper, lower)
    eye = np.asarray(pose["translation_xyz"], np.float64)
    shares = np.linspace(0, 1, _SAMPLES)[:, None]
    found: list[tuple[Pixels, bool]] = []
    for i, j in _EDGES:
        pixels, away_m = project(corners[i] + shares * (corners[j] - corners[i]), info, pose)
        u, v = pixels.T
        with np.errstate(invalid="ignore"):
            shown = (away_m > NEAREST_M) & (u > -1) & (u < info["width"]) & (v > -1) & (v < info["height"])
        if depth_m is None:
            hidden = np.full(_SAMPLES, _is_at_the_back(i, j, eye, lower, upper))
        else:
            hidden = np.zeros(_SAMPLES, bool)
            columns = np.clip(np.rint(u[shown]).astype(int), 0, info["width"] - 1)
            rows = np.clip(np.rint(v[shown]).astype(int), 0, info["height"] - 1)
            surface_m = depth_m[rows, columns]
            # NaN and infinity hide nothing.
            hidden[shown] = surface_m < away_m[shown] * (1 - _SURFACE_SHARE) - _SURFACE_M
        found += _runs((pixels + 0.5) * scale, shown, hidden)
    visible = sum(len(points) for points, hidden in found if not hidden)
    if not found or visible < _LEAST_VISIBLE * sum(len(points) for points, _ in found):
        return
    points = np.concatenate([points for points, _ in found])
    (left, top), (right, bottom) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    yield _Wire(item, found, (left, top, right, bottom), float(np.linalg.norm((lower + upper) / 2 - eye)))


def _is_at_the_back(i: int, j: int, eye: Pixels, lower: Pixels, upper: Pixels) -> bool:
    """Say whether both sides of a box that meet in an edge are turned away from the eye."""
    fixed = [axis for axis in range(3) if not (i ^ j) >> axis & 1]
    outside = [eye[axis] > upper[axis] if i >> axis & 1 else eye[axis] < lower[axis] for axis in fixed]
    return not any(outside)


def _runs(points: Pixels, shown: NDArray[np.bool_], hidden: NDArray[np.bool_]) -> Iterator[tuple[Pixels, bool]]:
    """Yield the stretches of a line that are shown, each either hidden or not; neighbours share a point."""
    state = np.where(shown, np.where(hidden, 2, 1), 0)
    starts = [0, *(np.flatnonzero(np.diff(state)) + 1).tolist(), len(state)]
    for start, end in pairwise(starts):
        piece = points[start : min(end + 1, len(points)) if end < len(points) and state[end] else end]
        if state[start] and len(piece) > 1:
            yield piece, bool(state[start] == 2)


def _dashes(points: Pixels, dash_px: float) -> Iterator[Pixels]:
    """Yield every other stretch of a line."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    for start in np.arange(0.0, along[-1], 2 * dash_px):
        ends = np.array([start, min(start + dash_px, along[-1])])
        yield np.stack([np.interp(ends, along, points[:, axis]) for axis in range(2)], axis=1)


def _thinned(points: Pixels) -> Pixels:
    """Return every eighth point of a line, and its last: a lens bends it, but not much."""
    return np.concatenate([points[:-1:8], points[-1:]])


def _draw_labels(drawn: "Image.Image", wires: Sequence[_Wire], colors: dict[str, Color]) -> None:
    from PIL import ImageDraw, ImageFont

    # It brings all that results are read with, which most solutions never need.
    from benchbot.plugins.drawing.map_layout import Rectangle, legible, place

    size_px = min(max(drawn.width / 60, 11.0), 22.0)
    font = ImageFont.load_default(size_px)
    pencil = ImageDraw.Draw(drawn)
    # Those in front are named first, where there is no room for all.
    named = sorted(wires, key=lambda wire: wire.distance_m)
    texts = [_text(wire.item) for wire in named]
    margin_px = size_px / 4
    sizes = [(pencil.textlength(text, font) + 3 * margin_px, size_px + 3 * margin_px) for text in texts]
    spots = place([Rectangle(*wire.corners) for wire in named], sizes, (), Rectangle(0, 0, *drawn.size))
    within = [
        spot.left >= 0 and spot.top >= 0 and spot.right <= drawn.width and spot.bottom <= drawn.height for spot in spots
    ]
    fitting = [index for index, fits in enumerate(within) if fits]
    for index, fits in zip(fitting, legible([spots[index] for index in fitting], tolerance=0.0), strict=True):
        if fits:
            spot, color = spots[index], colors[named[index].item.label]
            pencil.rounded_rectangle(spot.corners, radius=margin_px, fill=color, outline=_shade(color))
            ink = (0, 0, 0) if np.dot(color, _LUMINANCE) > _MIDDLE else (255, 255, 255)
            pencil.text(spot.center, texts[index], fill=ink, font=font, anchor="mm")


def _text(item: MappedObject) -> str:
    probability = item.label_probs[item.label]
    return item.label if probability > 0.995 else f"{item.label} {probability:.2f}"


def _shade(color: Color) -> Color:
    red, green, blue = (value // 4 for value in color)
    return red, green, blue
