"""The layout of a map on a canvas: one transform from metres to pixels, a grid, boxes and labels.

Pillow, SVG, matplotlib and the cells of a terminal draw the same layout; pixels grow to the right and down.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.map_model import (
    FALSE_NEGATIVE,
    FALSE_POSITIVE,
    IGNORED,
    MATCH,
    Box,
    MapObject,
    Occupancy,
    Point,
    SceneMap,
    planar,
)

MARGIN_M = 0.35
MOST_LABELS, LONGEST_LABEL = 80, 24
PATH_OBSTACLES = 80
MOST_GRID_LINES = 9
LEADER_PX = 7
KINDS = {MATCH: "found", FALSE_POSITIVE: "extra", FALSE_NEGATIVE: "missed", IGNORED: "ignored", None: "plain"}
_GRID_STEPS_M = (1, 2, 5, 10, 20, 50, 100, 1000, 10**9)
_DISTANCES_PX = (5, 12, 22, 36, 54, 78, 110)
_DIRECTIONS = 24
Line = tuple[float, float, float, float]


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned rectangle in pixels, y down."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """From left to right."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From top to bottom."""
        return self.bottom - self.top

    @property
    def center(self) -> Point:
        """The middle."""
        return ((self.left + self.right) / 2, (self.top + self.bottom) / 2)

    @property
    def area(self) -> float:
        """In square pixels."""
        return self.width * self.height

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, as Pillow takes them."""
        return (self.left, self.top, self.right, self.bottom)

    def overlap(self, other: "Rectangle") -> float:
        """Return the area shared with another one."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(width, 0.0) * max(height, 0.0)

    def nearest(self, x: float, y: float) -> Point:
        """Return the point of the rectangle that is nearest to a point."""
        return (min(max(x, self.left), self.right), min(max(y, self.top), self.bottom))


@dataclass(frozen=True)
class MapTransform:
    """The transform from the map frame (metres, x right, y up) to the pixels of a frame; one scale for both axes."""

    frame: Rectangle
    left_m: float
    top_m: float
    pixels_per_m: float

    @classmethod
    def fit(
        cls,
        frame: Rectangle,
        points: Sequence[Point],
        margin_m: float = MARGIN_M,
        *,
        least_m: float = 0.0,
        zoom: float = 1.0,
        center: Point | None = None,
    ) -> "MapTransform":
        """Return the transform that shows all points in the middle of `frame`, at least `least_m` wide and high.

        Where it is enlarged by `zoom`, `center` is in the middle instead.
        """
        xs, ys = [x for x, _ in points] or [0.0], [y for _, y in points] or [0.0]
        width_m = max(max(xs) - min(xs) + 2 * margin_m, least_m)
        height_m = max(max(ys) - min(ys) + 2 * margin_m, least_m)
        scale = min(frame.width / width_m, frame.height / height_m) * zoom
        x, y = center if center and zoom > 1 else ((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2)
        return cls(frame, x - frame.width / 2 / scale, y + frame.height / 2 / scale, scale)

    @property
    def width_m(self) -> float:
        """The metres that are shown from left to right."""
        return self.frame.width / self.pixels_per_m

    @property
    def height_m(self) -> float:
        """The metres that are shown from top to bottom."""
        return self.frame.height / self.pixels_per_m

    def point(self, x: float, y: float) -> Point:
        """Return where a point of the map lands."""
        return (
            self.frame.left + (x - self.left_m) * self.pixels_per_m,
            self.frame.top + (self.top_m - y) * self.pixels_per_m,
        )

    def metres(self, x: float, y: float) -> Point:
        """Return the point of the map that lands on a pixel."""
        return (
            self.left_m + (x - self.frame.left) / self.pixels_per_m,
            self.top_m - (y - self.frame.top) / self.pixels_per_m,
        )

    def rectangle(self, area: Box | Occupancy) -> Rectangle:
        """Return where a box or a floor lands, from above."""
        (left, bottom), (right, top) = self.point(*area.low), self.point(*area.high)
        return Rectangle(left, top, right, bottom)

    def scaled(self, factor: int) -> "MapTransform":
        """Return the same part of the map on a frame that is so many times as large."""
        frame = Rectangle(*(factor * value for value in self.frame.corners))
        return MapTransform(frame, self.left_m, self.top_m, self.pixels_per_m * factor)

    def grid(self) -> tuple[list[tuple[float, int]], list[tuple[float, int]]]:
        """Return the lines of a grid, x and metre of the upright ones, and y and metre of the level ones."""
        step = next(step for step in _GRID_STEPS_M if self.width_m / step <= MOST_GRID_LINES)
        right_m, bottom_m = self.left_m + self.width_m, self.top_m - self.height_m
        xs = range(math.ceil(self.left_m / step) * step, math.floor(right_m) + 1, step)
        ys = range(math.ceil(bottom_m / step) * step, math.floor(self.top_m) + 1, step)
        return [(self.point(x, 0)[0], x) for x in xs], [(self.point(0, y)[1], y) for y in ys]


@dataclass(frozen=True)
class Shape:
    """A box of an object: `role` is `truth` or `proposal`, `kind` one of KINDS, `title` a sentence about it."""

    role: str
    kind: str
    label: str
    box: Rectangle
    title: str


@dataclass(frozen=True)
class Label:
    """The name of an object beside it, and the line that leads to it when it stands apart."""

    text: str
    kind: str
    label: str
    box: Rectangle
    leader: Line | None


@dataclass(frozen=True)
class Marker:
    """The place where a picture was taken: its number, where its badge goes, and the direction of the view."""

    number: int
    point: Point
    badge: Point
    yaw_rad: float


@dataclass(frozen=True)
class MapLayout:
    """Everything of a map in pixels."""

    transform: MapTransform
    columns: list[tuple[float, int]]
    rows: list[tuple[float, int]]
    shapes: list[Shape]
    labels: list[Label]
    path: list[Point]
    markers: list[Marker] = field(default_factory=list)
    goals: list[Point] = field(default_factory=list)
    floor: Rectangle | None = None


def lay_out(
    scene: SceneMap,
    transform: MapTransform,
    text_size: Callable[[str], tuple[float, float]],
    pictures: Sequence[Pose] = (),
    *,
    scale: float = 1.0,
    badge_px: float = 0.0,
) -> MapLayout:
    """Return the layout of a map. `text_size` is the width and height of a label, `scale` that of lines and gaps.

    `pictures` are the poses where some were taken, numbered from 1; their badges stand `badge_px` behind the camera.
    """
    # The largest are drawn first, so that small objects lie on top.
    by_size = sorted(scene.objects, key=lambda item: -item.footprint_m2)
    shapes = []
    for role in ("truth", "proposal"):
        for item in by_size:
            label, box = (item.truth_label, item.true) if role == "truth" else (item.label, item.estimated)
            if box is not None:
                name = label or "object"
                title = f"{name}: {item.why}" if item.why else name
                shapes.append(Shape(role, KINDS[item.verdict], label or "", transform.rectangle(box), title))
    path = [transform.point(x, y) for x, y in scene.path.points]
    markers = [_marker(number, pose, transform, badge_px) for number, pose in enumerate(pictures, 1)]
    # A path of thousands of points would be avoided no better.
    kept_free = [*path[:: len(path) // PATH_OBSTACLES + 1], *(marker.badge for marker in markers)]
    return MapLayout(
        transform,
        *transform.grid(),
        shapes=shapes,
        labels=place_labels(scene.objects, transform, text_size, kept_free, scale),
        path=path,
        markers=markers,
        goals=[transform.point(x, y) for x, y in scene.goals],
        floor=None if scene.occupancy is None else transform.rectangle(scene.occupancy),
    )


def _marker(number: int, pose: Pose, transform: MapTransform, badge_px: float) -> Marker:
    x, y = transform.point(*planar(pose))
    badge = (x - badge_px * math.cos(pose.yaw_rad), y + badge_px * math.sin(pose.yaw_rad))
    return Marker(number, (x, y), badge, pose.yaw_rad)


def place_labels(
    objects: Sequence[MapObject],
    transform: MapTransform,
    text_size: Callable[[str], tuple[float, float]],
    kept_free: Sequence[Point] = (),
    scale: float = 1.0,
    tolerance: float = 0.08,
) -> list[Label]:
    """Return the names of objects, failures first, then the worst; an object for whose name there is no room has none.

    There is none where it would hide a larger share of another, or be hidden by it, than `tolerance`.
    Where nothing is known of which object is which, only the estimated ones are named.
    """
    objects = [item for item in objects if item.boxes]
    named = [item for item in objects if item.verdict is not None or item.estimated is not None] or objects
    named = sorted(named, key=lambda item: not item.failed)[:MOST_LABELS]
    texts = [item.name if len(item.name) <= LONGEST_LABEL else f"{item.name[: LONGEST_LABEL - 1]}…" for item in named]
    boxes = [transform.rectangle(max(item.boxes, key=lambda box: box.footprint_m2)) for item in named]
    spots = place(boxes, [text_size(text) for text in texts], kept_free, transform.frame, scale)
    labels = []
    for item, text, box, spot, fits in zip(named, texts, boxes, spots, legible(spots, tolerance), strict=True):
        if fits:
            start = box.nearest(*spot.center)
            end = spot.nearest(*start)
            leader = (*start, *end) if math.dist(start, end) > LEADER_PX * scale else None
            labels.append(Label(text, KINDS[item.verdict], item.label or item.name, spot, leader))
    return labels


def place(
    boxes: Sequence[Rectangle],
    sizes: Sequence[tuple[float, float]],
    path: Sequence[tuple[float, float]],
    within: Rectangle,
    scale: float = 1.0,
) -> list[Rectangle]:
    """Return the place of each box's label, given the labels' sizes.

    Labels of small boxes choose first. Each takes the place that hides least of other labels, of the boxes and of the
    path, and is nearest to its box; `scale` stretches the distances that are tried.
    """
    corners = np.array([box.corners for box in boxes], float).reshape(-1, 4)
    areas = np.array([box.area for box in boxes], float)
    points = np.array(path, float).reshape(-1, 2)
    paper = np.array([within.corners], float)
    placed = np.empty((0, 4))
    labels: dict[int, Rectangle] = {}
    for i in sorted(range(len(boxes)), key=lambda index: boxes[index].area):
        found = list(_candidates(boxes[i], sizes[i], scale))
        places = np.array([corner for corner, _ in found])
        distances_px = np.array([distance_px for _, distance_px in found])
        area = (places[:, 2:] - places[:, :2]).prod(1)
        # A label may well cover what its own box stands on; covering what is small is worst.
        is_under = _overlaps(corners[i : i + 1], corners)[0] > 0.8 * areas[i]
        badness = np.where(is_under, 0.15, 1.0 + 4.0 * (areas < 2 * sizes[i][0] * sizes[i][1]))
        badness[i] = 0.0
        hidden = 40 * _overlaps(places, placed).sum(1) + _overlaps(places, corners) @ badness
        left, top, right, bottom = places.T[:, :, None]
        x, y = points.T
        on_path = ((left < x) & (x < right) & (top < y) & (y < bottom)).sum(1)
        outside = area - _overlaps(places, paper)[:, 0]
        cost = (hidden + 100 * outside) / area + 0.15 * on_path + 0.012 * distances_px / scale
        best = places[int(cost.argmin())]
        placed = np.vstack([placed, best])
        labels[i] = Rectangle(*map(float, best))
    return [labels[i] for i in range(len(boxes))]


def legible(labels: Sequence[Rectangle], tolerance: float = 0.08) -> list[bool]:
    """Say which labels can be kept so that none hides another by more than a share of itself; the first go first."""
    kept: list[Rectangle] = []
    found = []
    for label in labels:
        fits = all(label.overlap(other) <= tolerance * min(label.area, other.area) for other in kept)
        found.append(fits)
        if fits:
            kept.append(label)
    return found


def _overlaps(some: NDArray[Any], others: NDArray[Any]) -> NDArray[Any]:
    """Return the areas (N, M) that rectangles (N, 4) share with others (M, 4)."""
    low = np.maximum(some[:, None, :2], others[None, :, :2])
    high = np.minimum(some[:, None, 2:], others[None, :, 2:])
    shared: NDArray[Any] = np.clip(high - low, 0.0, None).prod(2)
    return shared


def _candidates(
    box: Rectangle, size: tuple[float, float], scale: float
) -> Iterator[tuple[tuple[float, float, float, float], float]]:
    """Yield places for a label of `size`, and their distance from the box: inside when it fits, then all around."""
    width, height = size
    margin = 5 * scale
    if width + 2 * margin < box.right - box.left and height + 2 * margin < box.bottom - box.top:
        x, y = box.center
        columns = (x - width / 2, box.left + margin, box.right - margin - width)
        rows = (y - height / 2, box.top + margin, box.bottom - margin - height)
        for left in columns:
            for top in rows:
                yield (left, top, left + width, top + height), 0.0
    for distance_px in _DISTANCES_PX:
        for step in range(_DIRECTIONS):
            angle = 2 * math.pi * step / _DIRECTIONS
            dx, dy = math.cos(angle), math.sin(angle)
            # The label's centre runs along the box, widened by half the label and the distance.
            reach_x = (box.right - box.left + width) / 2 + distance_px * scale
            reach_y = (box.bottom - box.top + height) / 2 + distance_px * scale
            stretch = 1 / max(abs(dx) / reach_x, abs(dy) / reach_y)
            x, y = box.center[0] + dx * stretch, box.center[1] + dy * stretch
            yield (x - width / 2, y - height / 2, x + width / 2, y + height / 2), distance_px * scale
