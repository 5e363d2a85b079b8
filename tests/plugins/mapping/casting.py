"""What a camera and a laser see of boxes, cast here ray by ray."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchbot.api import Observations
from benchbot.core.channels import LaserScan
from benchbot.core.geometry import Pose

WIDTH, HEIGHT, FOCAL = 160, 90, 80.0
IDS = {"chair": 1, "table": 2}
# instance number, lower corner, upper corner
Box = tuple[int, tuple[float, float, float], tuple[float, float, float]]
BOXES: list[Box] = [
    (1001, (1.8, -0.3, 0.0), (2.4, 0.3, 0.9)),
    (1002, (0.2, 2.0, 0.0), (0.7, 2.5, 0.8)),
    (2001, (-2.6, -0.8, 0.1), (-1.6, 0.5, 0.7)),
]
# The optical frame of a camera that looks along the robot's x axis (REP-103): x right, y down, z forward.
OPTICAL = Pose(rotation_xyzw=(-0.5, 0.5, -0.5, 0.5))
TWO_ROOMS: list[Box] = [
    (0, (-1.6, -1.6, 0), (-1.5, 1.6, 2)),
    (0, (4.5, -1.6, 0), (4.6, 1.6, 2)),
    (0, (-1.5, -1.6, 0), (4.5, -1.5, 2)),
    (0, (-1.5, 1.5, 0), (4.5, 1.6, 2)),
    (0, (1.5, -1.5, 0), (1.6, 0.3, 2)),
    (0, (1.5, 1.3, 0), (1.6, 1.5, 2)),
]
"""The walls of two rooms with a door between them."""


def cast(boxes: Sequence[Box], camera: Pose) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
    """Return planar depth and instance numbers, (HEIGHT, WIDTH), seen from `camera`, an optical frame's pose."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u, float)], -1)
    directions = rays @ camera.matrix()[:3, :3].T
    origin = camera.matrix()[:3, 3]
    depth = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    numbers = np.zeros((HEIGHT, WIDTH), np.uint16)
    for number, lower, upper in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = (lower - origin) / directions, (upper - origin) / directions
        enter = np.minimum(near, far).max(-1)
        leave = np.maximum(near, far).min(-1)
        seen = (enter < leave) & (enter > 0) & (enter < depth)
        depth[seen], numbers[seen] = enter[seen], number
    return depth, numbers


def observe(boxes: Sequence[Box], camera: Pose, scene_number: int = 0) -> Observations:
    depth, numbers = cast(boxes, camera)
    matrix = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])
    return {
        "image_depth": depth,
        "image_depth_info": {
            "frame_id": "camera",
            "height": HEIGHT,
            "width": WIDTH,
            "matrix_intrinsics": matrix,
            "matrix_projection": np.eye(3, 4),
        },
        "image_segment": {
            "class_segment_img": (numbers // 1000).astype(np.uint8),
            "instance_segment_img": numbers,
            "class_ids": IDS,
        },
        "poses": {"camera": camera.record("map")},
        "scene_number": scene_number,
    }


def views(height_m: float = 1.05) -> list[Pose]:
    """Return camera poses: from each of four places the whole way round."""
    places = [(0.0, 0.0), (0.5, -1.5), (1.5, 1.5), (-1.0, 1.5)]
    yaws = np.arange(0, 2 * np.pi, np.pi / 6)
    return [Pose.planar(x, y, yaw, z=height_m) @ OPTICAL for x, y in places for yaw in yaws]


def scan(boxes: Sequence[Box], lidar: Pose, beams: int = 360) -> LaserScan:
    """Return a level laser scan from `lidar`: how far it is to the nearest box in each direction."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    level = np.stack([np.cos(angles), np.sin(angles), np.zeros(beams)], 1) @ lidar.matrix()[:3, :3].T
    origin = lidar.matrix()[:3, 3]
    ranges = np.full(beams, np.inf)
    for _, lower, upper in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = (lower - origin) / level, (upper - origin) / level
        enter, leave = np.fmin(near, far).max(1), np.fmax(near, far).min(1)
        ranges = np.where((enter < leave) & (enter > 0), np.minimum(ranges, enter), ranges)
    return {"scans": np.stack([ranges, angles], 1), "range_min": 0.1, "range_max": 20.0}
