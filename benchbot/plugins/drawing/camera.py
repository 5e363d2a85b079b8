"""Where things of the map appear in a camera's picture: the pinhole model, no lens distortion."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from benchbot.core.geometry import Pose

NEAREST_M = 0.1
_ABSURD = 1e4
Point = tuple[float, float, float]
_EDGES = [(i, j) for i, j in itertools.combinations(range(8), 2) if (i ^ j) in (1, 2, 4)]


@dataclass(frozen=True)
class Box:
    """An axis-aligned box of the map frame: centre and side lengths, metres."""

    centroid: Point
    extent: Point

    @classmethod
    def of(cls, centroid: Sequence[float] | None, extent: Sequence[float] | None) -> "Box | None":
        """Return the box, or None when it is not known."""
        if centroid is None or extent is None:
            return None
        (x, y, z), (width, depth, height) = (tuple(map(float, values)) for values in (centroid, extent))
        return cls((x, y, z), (width, depth, height))

    @property
    def corners(self) -> list[Point]:
        """The eight corners; those whose indices differ in one bit share an edge."""
        (x, y, z), (width, depth, height) = self.centroid, self.extent
        signs = itertools.product((-0.5, 0.5), repeat=3)
        return [(x + a * width, y + b * depth, z + c * height) for a, b, c in signs]

    def is_between(self, start: Point, end: Point) -> bool:
        """Say whether the straight line between two points outside the box passes through it (slab method)."""
        near, far = 0.0, 1.0
        for i in range(3):
            low, high = self.centroid[i] - self.extent[i] / 2, self.centroid[i] + self.extent[i] / 2
            along = end[i] - start[i]
            if abs(along) < 1e-12:
                if not low <= start[i] <= high:
                    return False
                continue
            first, second = sorted(((low - start[i]) / along, (high - start[i]) / along))
            near, far = max(near, first), min(far, second)
        return near < far


@dataclass(frozen=True)
class Camera:
    """A pinhole camera on a robot: its pose in the robot's frame, and its intrinsics in pixels."""

    mount: Pose
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def of(cls, robot: Mapping[str, Any] | None) -> "Camera | None":
        """Return the camera that a robot's declaration describes, None when it describes none."""
        camera = (robot or {}).get("camera")
        frame = (robot or {}).get("frames", {}).get((camera or {}).get("frame"))
        if camera is None or frame is None:
            return None
        mount = Pose.from_xyz_rpy_deg(frame["xyz"], frame.get("rpy_deg", (0, 0, 0)))
        return cls(mount, *(camera[key] for key in ("width", "height", "fx", "fy", "cx", "cy")))

    def pixels(self, base: Pose, points: Sequence[Point]) -> list[tuple[float, float]] | None:
        """Return where points of the map appear when the robot is at `base`; None when one is not before the lens."""
        to_camera = (base @ self.mount).inverse()
        seen = []
        for point in points:
            x, y, z = (to_camera @ Pose(point)).translation_xyz
            if z < NEAREST_M:
                return None
            seen.append((self.fx * x / z + self.cx, self.fy * y / z + self.cy))
        return seen

    def edges(self, base: Pose, box: Box) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """Return the twelve edges of a box as lines in the picture, none when it is not before the lens."""
        corners = self.pixels(base, box.corners)
        return [] if corners is None else [(corners[i], corners[j]) for i, j in _EDGES]

    def view_of(self, base: Pose, box: Box, others: Sequence[Box] = ()) -> float:
        """Return how well a box can be seen from `base`, 0 for not at all.

        Better is larger, whole, and not behind one of `others`.
        """
        corners = self.pixels(base, box.corners)
        if corners is None:
            return 0.0
        left, right = min(x for x, _ in corners), max(x for x, _ in corners)
        top, bottom = min(y for _, y in corners), max(y for _, y in corners)
        area = max((right - left) * (bottom - top), 1e-9)
        if not area < _ABSURD * self.width * self.height:
            return 0.0
        width = min(right, self.width) - max(left, 0.0)
        height = min(bottom, self.height) - max(top, 0.0)
        inside = max(width, 0.0) * max(height, 0.0) / area
        size = min(math.sqrt(area / (self.width * self.height)), 0.5)
        eye = (base @ self.mount).translation_xyz
        hidden = any(other.is_between(eye, box.centroid) for other in others)
        return inside**2 * size * (0.1 if hidden else 1.0)
