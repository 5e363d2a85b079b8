"""Floor plans: how much room there is around every point of a floor, as the format `floor_plan` keeps it."""

import base64
import binascii
import lzma
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from benchbot.plugin import BenchbotError

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Point = tuple[float, float]

MOST_CLEARANCE_M = 2.0
MOST_NODES_ALONG = 8192
MOST_MEMORY_BYTES = 1 << 25


@dataclass(frozen=True)
class FloorPlan:
    """Distances to the nearest obstacle at the nodes of a square grid.

    `clearance_m` (I, J): that of node [i, j] at `origin_xy` + `resolution_m` * (i, j) in the map frame.
    """

    origin_xy: Point
    resolution_m: float
    clearance_m: Floats

    @classmethod
    def from_ground_truth(cls, values: Mapping[str, Any]) -> Self:
        """Return the plan in a ground truth of the format `floor_plan`; raises BenchbotError when it is damaged."""
        try:
            rows, columns = (min(int(size), MOST_NODES_ALONG) for size in values["shape"])
            packed = base64.b64decode(values["clearance_mm_differences"], validate=True)
            # No more than the shape allows: a few bytes can unpack to gigabytes.
            unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ, MOST_MEMORY_BYTES)
            data = unpacker.decompress(packed, 2 * rows * columns + 1)
            differences = np.frombuffer(data, "<u2").reshape(rows, columns)
            millimetres = differences.cumsum(0, np.uint16).cumsum(1, np.uint16)
            x, y = (float(value) for value in values["origin"])
            return cls((x, y), float(values["resolution_m"]), millimetres / 1000.0)
        except (KeyError, TypeError, ValueError, binascii.Error, lzma.LZMAError) as error:
            raise BenchbotError(
                "This is not a floor plan.",
                f"{type(error).__name__}: {error}.",
                "Make it anew: python -m benchbot_task_navigation.make_episodes ENVIRONMENT",
            ) from error

    def as_ground_truth(self) -> dict[str, Any]:
        """Return the plan as the format `floor_plan` has it: whole millimetres, capped at 2 m.

        Their differences along both axes are kept, modulo 65536 and compressed by xz: a third of what zlib makes of
        the millimetres themselves.
        """
        capped = np.clip(self.clearance_m, 0.0, MOST_CLEARANCE_M)
        # Rounded down: what is called free is free.
        millimetres = np.floor(capped * 1000.0 + 1e-6).astype("<u2")
        nothing = np.uint16(0)
        differences = np.diff(np.diff(millimetres, axis=0, prepend=nothing), axis=1, prepend=nothing).astype("<u2")
        return {
            "origin": list(self.origin_xy),
            "resolution_m": self.resolution_m,
            "shape": list(self.clearance_m.shape),
            "clearance_mm_differences": base64.b64encode(lzma.compress(differences.tobytes())).decode(),
        }

    def points(self, nodes: NDArray[np.integer]) -> Floats:
        """Return the places (N, 2) of nodes (N, 2)."""
        places: Floats = np.asarray(self.origin_xy) + self.resolution_m * np.asarray(nodes)
        return places

    def clearance_at(self, points: Floats) -> Floats:
        """Return the clearance (N,) at points (N, 2) of the map frame, bilinear between nodes, 0 beyond the plan."""
        grid = (np.asarray(points) - self.origin_xy) / self.resolution_m
        found: Floats = ndimage.map_coordinates(self.clearance_m, grid.T, order=1, mode="constant", cval=0.0)
        return found

    def within(self, centroid: Point, extent: Point, distance_m: float) -> Mask:
        """Return the nodes that are at most so far from the edge of an axis-aligned rectangle, or inside it."""
        x = self.origin_xy[0] + self.resolution_m * np.arange(self.clearance_m.shape[0])
        y = self.origin_xy[1] + self.resolution_m * np.arange(self.clearance_m.shape[1])
        outside_x = np.maximum(np.abs(x - centroid[0]) - extent[0] / 2, 0.0)
        outside_y = np.maximum(np.abs(y - centroid[1]) - extent[1] / 2, 0.0)
        near: Mask = np.hypot(outside_x[:, None], outside_y[None, :]) <= distance_m
        return near


def distance_to_box_m(point: Point, centroid: Point, extent: Point) -> float:
    """Return how far a point is from an axis-aligned rectangle, 0 inside it."""
    sides = zip(point, centroid, extent, strict=True)
    return math.hypot(*(max(abs(value - middle) - size / 2, 0.0) for value, middle, size in sides))
