"""The footprint of a robot on the floor: a disc about the base's origin, and where declared the polygon inside it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Footprint:
    """A disc that holds the whole robot, and its outline in the base frame if it is no disc.

    `polygon` has corners (x, y) in metres in either order, the last one joined to the first. `z_m` are the lowest and
    highest heights, in the base frame, of what the robot can touch. Raises ValueError saying what makes no sense.
    """

    radius_m: float
    z_m: tuple[float, float]
    polygon: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if not (self.radius_m > 0 and self.z_m[0] < self.z_m[1]):
            raise ValueError("the robot has no extent: radius_m must be positive, and z_min_m less than z_max_m")
        if not self.polygon:
            return
        if len(self.polygon) < 3:
            raise ValueError(f"a polygon has at least 3 corners, not {len(self.polygon)}")
        farthest_m = max(math.hypot(*corner) for corner in self.polygon)
        if not farthest_m <= self.radius_m:
            raise ValueError(
                f"the polygon reaches {farthest_m:.3f} m from the base's origin, and radius_m, {self.radius_m:g}, does "
                "not hold it"
            )
        if _crosses_itself(self.polygon):
            raise ValueError("the polygon's sides cross or touch each other, or have no length")

    def distance_m(self, points_xy: Array) -> Array:
        """Return the distances (N,) of points (N, 2) in the base frame from the outline, negative inside."""
        if not self.polygon:
            disc_m: Array = np.hypot(points_xy[:, 0], points_xy[:, 1]) - self.radius_m
            return disc_m
        starts = np.array(self.polygon)
        ends = np.roll(starts, -1, 0)
        sides = ends - starts
        off = points_xy[:, None] - starts
        share = np.clip((off * sides).sum(2) / (sides**2).sum(1), 0.0, 1.0)
        nearest_m = np.hypot(*np.moveaxis(off - share[..., None] * sides, 2, 0)).min(1)
        # A ray from a point inside crosses an odd number of sides.
        x, y = points_xy[:, None, 0], points_xy[:, None, 1]
        spans = (starts[:, 1] > y) != (ends[:, 1] > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing_x = starts[:, 0] + (y - starts[:, 1]) * sides[:, 0] / sides[:, 1]
        is_inside = (spans & (x < crossing_x)).sum(1) % 2 == 1
        signed_m: Array = np.where(is_inside, -nearest_m, nearest_m)
        return signed_m


def _crosses_itself(corners: tuple[tuple[float, float], ...]) -> bool:
    """Return whether sides that are no neighbours meet, or a side has no length."""
    count = len(corners)
    sides = [(corners[number], corners[(number + 1) % count]) for number in range(count)]
    return any(start == end for start, end in sides) or any(
        _meet(sides[one], sides[other])
        for one in range(count)
        for other in range(one + 2, count)
        if (other + 1) % count != one
    )


Side = tuple[tuple[float, float], tuple[float, float]]


def _meet(one: Side, other: Side) -> bool:
    (a, b), (c, d) = one, other
    return _side_of(a, b, c) * _side_of(a, b, d) <= 0 and _side_of(c, d, a) * _side_of(c, d, b) <= 0


def _side_of(start: tuple[float, float], end: tuple[float, float], point: tuple[float, float]) -> float:
    """Return a number whose sign says on which side of a line a point is."""
    return (end[0] - start[0]) * (point[1] - start[1]) - (end[1] - start[1]) * (point[0] - start[0])
