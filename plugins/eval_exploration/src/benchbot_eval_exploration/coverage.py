"""Coverage: the floor that a robot has seen and visited, computed from its path on the floor plan.

Exploration is commonly judged by the floor that was seen: T. Chen et al., "Learning Exploration Policies for
Navigation", ICLR 2019; S. Ramakrishnan et al., "An Exploration of Embodied Visual Exploration", IJCV 129, 2021.
"""

import math
from dataclasses import dataclass

import numpy as np

from benchbot.plugin import wrap_angle_rad
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask
from benchbot_task_navigation.ways import Ways

BODY_RADIUS_M = 0.3
"""The radius of the disc whose reachable floor is counted, whatever the robot's own size."""
SIGHT_M = 3.0
FIELD_OF_VIEW_RAD = math.radians(90)
"""The range and the horizontal field of view that every robot is credited with, whatever its sensors are."""
_RAYS = 181
_APART_M, _APART_RAD = 0.1, math.radians(4.9)


@dataclass(frozen=True)
class Coverage:
    """Nodes of a floor plan (I, J): the floor that counts, and what of it was seen and been to.

    `looks` (K, 2): after so many metres, so large a share of the floor had been seen.
    """

    floor: Mask
    seen: Mask
    visited: Mask
    node_m2: float
    looks: Floats

    @property
    def seen_share(self) -> float:
        """The share of the floor that was seen."""
        return float(self.seen.sum() / self.floor.sum())

    @property
    def visited_share(self) -> float:
        """The share of the floor that was been to."""
        return float(self.visited.sum() / self.floor.sum())

    def seen_share_over(self, length_m: float) -> float:
        """The mean over the first metres of the way of the share that had been seen; at its end a robot sees on."""
        begin_m, shares = self.looks.T
        until_m = np.append(begin_m[1:], np.inf)
        return float(shares @ (np.minimum(until_m, length_m) - np.minimum(begin_m, length_m)) / length_m)

    @property
    def seen_m2(self) -> float:
        """The area that was seen."""
        return float(self.seen.sum() * self.node_m2)


def covered(plan: FloorPlan, way: Floats) -> Coverage | None:
    """Return the floor that a robot covers on its path (N, 3: x, y, heading); None where a body has no room at all.

    The floor that counts is what can be reached from the beginning. Seen is what lies ahead of a place on the way, up
    to 3 m away and 45 degrees aside, with nothing between; been to is what lies within a body's radius of the way.
    """
    floor = Ways(plan, BODY_RADIUS_M, reach=1).reachable((float(way[0, 0]), float(way[0, 1])))
    if not floor.any():
        return None
    seen, visited = np.zeros_like(floor), np.zeros_like(floor)
    here: Floats | None = None
    along_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way[:, :2], axis=0), axis=1))])
    looks = []
    for place, driven_m in zip(way, along_m, strict=True):
        visited |= plan.within((float(place[0]), float(place[1])), (0.0, 0.0), BODY_RADIUS_M)
        if here is None or _is_apart(place, here):
            here = place
            _look(plan, here, seen)
            looks.append((driven_m, (seen & floor).sum() / floor.sum()))
    return Coverage(floor, seen & floor, visited & floor, plan.resolution_m**2, np.array(looks))


def _is_apart(place: Floats, other: Floats) -> bool:
    turned_rad = abs(wrap_angle_rad(float(place[2] - other[2])))
    return math.dist(place[:2], other[:2]) >= _APART_M or turned_rad >= _APART_RAD


def _look(plan: FloorPlan, eye: Floats, seen: Mask) -> None:
    """Mark the nodes that are seen from a place (3,). Obstacles hide what is behind them."""
    angles_rad = eye[2] + np.linspace(-FIELD_OF_VIEW_RAD / 2, FIELD_OF_VIEW_RAD / 2, _RAYS)
    ranges_m = np.arange(0.0, SIGHT_M + 1e-9, plan.resolution_m / 2)
    directions = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
    points = eye[:2] + directions[:, None, :] * ranges_m[None, :, None]
    # A wall thinner than the grid lowers the clearance around it to less than this.
    opaque = plan.clearance_at(points.reshape(-1, 2)).reshape(_RAYS, -1) < 0.75 * plan.resolution_m
    reached = points[~np.logical_or.accumulate(opaque, axis=1)]
    nodes = np.rint((reached - plan.origin_xy) / plan.resolution_m).astype(np.intp)
    nodes = nodes[((nodes >= 0) & (nodes < seen.shape)).all(axis=1)]
    seen[nodes[:, 0], nodes[:, 1]] = True
