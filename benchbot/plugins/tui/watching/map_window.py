"""What a map from above shows, and which part of the map frame lies where on it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchbot.plugins.watching.place import MapBox, Place

MARGIN_M = 0.25
LEAST_M = 1.0
FARTHEST_M = 1e5
"""Coordinates beyond this are no place of a robot."""

Point = tuple[float, float]


@dataclass(frozen=True)
class MapContent:
    """Everything on a map, in metres and radians in the map frame (x right, y up)."""

    place: Place | None = None
    pose_xyyaw: tuple[float, float, float] | None = None
    path: tuple[Point, ...] = ()
    laser: NDArray[np.float64] | None = None
    """Where the laser's rays ended, (N, 2)."""
    boxes: tuple[MapBox, ...] = ()
    """What the solution proposes."""
    truth: tuple[MapBox, ...] = ()
    """What is really there: for the host of a run only."""
    zoom: float = 1.0


def cleaned(content: MapContent) -> MapContent:
    """Return a map without what cannot be on one: places that are no numbers, or beyond all reach."""

    def there(*values: float) -> bool:
        return all(abs(value) < FARTHEST_M for value in values)

    def whole(boxes: tuple[MapBox, ...]) -> tuple[MapBox, ...]:
        return tuple(
            each for each in boxes if there(*each.box.centroid, *each.box.extent) and min(each.box.extent) >= 0
        )

    pose, laser = content.pose_xyyaw, content.laser
    return replace(
        content,
        pose_xyyaw=pose if pose is not None and there(*pose) else None,
        path=tuple(point for point in content.path if there(*point)),
        laser=None if laser is None else laser[(abs(laser) < FARTHEST_M).all(1)],
        boxes=whole(content.boxes),
        truth=whole(content.truth),
    )


@dataclass(frozen=True)
class Window:
    """The part that is shown: pixels are squares, y of a pixel grows downwards."""

    left_m: float
    top_m: float
    pixels_per_m: float
    width: int
    height: int

    @classmethod
    def of(cls, content: MapContent, width: int, height: int) -> "Window":
        """Return the window that shows all of a map on so many pixels; zoomed in, the robot is in its middle."""
        points = list(_extremes(content))
        xs, ys = [x for x, _ in points] or [0.0], [y for _, y in points] or [0.0]
        wide_m = max(max(xs) - min(xs) + 2 * MARGIN_M, LEAST_M)
        tall_m = max(max(ys) - min(ys) + 2 * MARGIN_M, LEAST_M)
        scale = min(width / wide_m, height / tall_m) * content.zoom
        x, y = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
        if content.zoom > 1 and content.pose_xyyaw is not None:
            x, y = content.pose_xyyaw[:2]
        return cls(x - width / 2 / scale, y + height / 2 / scale, scale, width, height)

    def point(self, x: float, y: float) -> Point:
        """Return where a place of the map frame lies, in pixels."""
        return (x - self.left_m) * self.pixels_per_m, (self.top_m - y) * self.pixels_per_m

    def times(self, factor: int) -> "Window":
        """Return the same part on more pixels."""
        return Window(self.left_m, self.top_m, self.pixels_per_m * factor, self.width * factor, self.height * factor)

    @property
    def wide_m(self) -> float:
        """How many metres are shown from left to right."""
        return self.width / self.pixels_per_m

    @property
    def tall_m(self) -> float:
        """How many metres are shown from top to bottom."""
        return self.height / self.pixels_per_m


def endpoints(
    scans: NDArray[np.float64], range_max_m: float, pose_xyyaw: tuple[float, float, float]
) -> NDArray[np.float64]:
    """Return where rays (N, 2) of [range in metres, angle in radians] end, (M, 2) in the map frame: those that hit."""
    ranges, angles = np.asarray(scans, float).reshape(-1, 2).T
    hit = np.isfinite(ranges) & (ranges > 0) & (ranges < range_max_m)
    x, y, yaw_rad = pose_xyyaw
    turned = angles[hit] + yaw_rad
    return np.stack([x + ranges[hit] * np.cos(turned), y + ranges[hit] * np.sin(turned)], 1)


def corners(box: MapBox) -> tuple[Point, Point]:
    """Return the corners of a box from above: those of least and of greatest x and y."""
    (x, y, _), (width, depth, _) = box.box.centroid, box.box.extent
    return (x - width / 2, y - depth / 2), (x + width / 2, y + depth / 2)


def arrow(yaw_rad: float, arrows: str) -> str:
    """Return the one of eight arrows, the first to the right and the others counter-clockwise, that points so."""
    return arrows[round(yaw_rad / (math.pi / 4)) % 8]


def _extremes(content: MapContent) -> Iterator[Point]:
    place = content.place
    if place is not None:
        yield from place.trajectory_xy
        if place.start_xyyaw is not None:
            yield place.start_xyyaw[:2]
        if place.occupancy is not None:
            yield place.occupancy.low
            yield place.occupancy.high
    if content.pose_xyyaw is not None:
        yield content.pose_xyyaw[:2]
    yield from content.path
    # What a solution proposes far outside must not make the rest small.
    for box in content.truth if place is None or place.occupancy is None else ():
        yield from corners(box)
