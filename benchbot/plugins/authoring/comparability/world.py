"""Boxes that stand in the map frame, and where rays meet them: the truth that observations are held against."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Vector3 = tuple[float, float, float]
Floats = NDArray[np.float64]
NOTHING = -1
_ALMOST_ZERO = 1e-12


@dataclass(frozen=True)
class Box:
    """A solid box along the axes of the map frame, in metres."""

    name: str
    class_name: str | None
    low: Vector3
    high: Vector3
    color: Vector3 | None = None
    """Reflectance, linear sRGB; None where it is not known."""


@dataclass(frozen=True)
class World:
    """All that is known to stand somewhere; `is_complete` where nothing else stands there."""

    boxes: tuple[Box, ...]
    is_complete: bool = False

    @classmethod
    def of_ground_truth(cls, ground_truth: Mapping[str, Any]) -> Self:
        """Return the objects of an object map's ground truth (format `object_map_ground_truth`)."""
        boxes = []
        for item in ground_truth["objects"]:
            middle, half = np.array(item["centroid"], float), np.array(item["extent"], float) / 2
            low, high = (tuple(corner.tolist()) for corner in (middle - half, middle + half))
            boxes.append(Box(str(item.get("ID_name", item["class"])), str(item["class"]), low, high))
        return cls(tuple(boxes))

    def cast(self, origin: Floats, directions: Floats) -> tuple[Floats, NDArray[np.intp]]:
        """Return how far rays (…, 3) from a point go, in lengths of their directions, and the index of the box there.

        inf and `NOTHING` where they meet nothing.
        """
        nearest = np.full(directions.shape[:-1], np.inf)
        index = np.full(directions.shape[:-1], NOTHING, np.intp)
        # A ray along a face is let pass it, rather than be divided by zero.
        inverse = 1.0 / np.where(directions == 0.0, _ALMOST_ZERO, directions)
        for number, box in enumerate(self.boxes):
            enter, leave = np.zeros_like(nearest), nearest
            for axis in range(3):
                to_low = (box.low[axis] - origin[axis]) * inverse[..., axis]
                to_high = (box.high[axis] - origin[axis]) * inverse[..., axis]
                enter = np.maximum(enter, np.minimum(to_low, to_high))
                leave = np.minimum(leave, np.maximum(to_low, to_high))
            closer = (enter <= leave) & (enter > 0) & (enter < nearest)
            nearest = np.where(closer, enter, nearest)
            index[closer] = number
        return nearest, index

    def distances_m(self, points_xyz: Floats) -> Floats:
        """Return how far points (N, 3) are from each solid box, (N, boxes): 0 inside of it."""
        lows, highs = (np.array([getattr(box, end) for box in self.boxes]).reshape(-1, 3) for end in ("low", "high"))
        beyond = np.maximum(np.maximum(lows - points_xyz[:, None], points_xyz[:, None] - highs), 0.0)
        distances: Floats = np.linalg.norm(beyond, axis=-1)
        return distances
