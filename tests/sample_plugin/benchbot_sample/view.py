"""What the sample robot sees: a pinhole camera over a flat world, drawn in closed form."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchbot.core.geometry import Pose
from benchbot_sample.world import World

WIDTH, HEIGHT, FOCAL = 48, 32, 24.0
CAMERA_HEIGHT_M, OBSTACLE_HEIGHT_M, RANGE_MAX_M = 0.5, 1.0, 10.0

CAMERA_TO_BASE = Pose((0.0, 0.0, CAMERA_HEIGHT_M), (-0.5, 0.5, -0.5, 0.5))
"""The camera's optical frame (x right, y down, z forward) in the base frame."""

INTRINSICS = np.array([[FOCAL, 0.0, WIDTH / 2], [0.0, FOCAL, HEIGHT / 2], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class View:
    """One exposure: `rgb` (H, W, 3) uint8, planar `depth_m` (H, W) float32, `obstacle` (H, W) label index or -1."""

    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    obstacle: NDArray[np.int64]


def look(world: World, x: float, y: float, yaw_rad: float) -> View:
    """Return what the camera sees from the base pose."""
    sideways = (np.arange(WIDTH) - WIDTH / 2) / FOCAL
    down = (np.arange(HEIGHT) - HEIGHT / 2)[:, None] / FOCAL
    range_m, hit = world.cast(x, y, yaw_rad - np.arctan(sideways))
    depth_m = range_m / np.hypot(1.0, sideways)
    with np.errstate(invalid="ignore", divide="ignore"):
        floor_m = np.where(down > 0, CAMERA_HEIGHT_M / down, math.inf)
        top_m = CAMERA_HEIGHT_M - depth_m[None] * down
    wall = np.isfinite(depth_m)[None] & (top_m >= 0) & (top_m <= OBSTACLE_HEIGHT_M)
    depth = np.where(wall, depth_m[None], np.broadcast_to(floor_m, (HEIGHT, WIDTH)))
    depth = np.where(depth > RANGE_MAX_M, np.inf, depth)
    obstacle = np.where(wall & np.isfinite(depth), hit[None], -1)
    hue = (obstacle + 1) * 2.399963 + 0.3
    colour = 0.5 + 0.5 * np.stack([np.cos(hue), np.cos(hue + 2.094), np.cos(hue + 4.189)], -1)
    shade = 1.0 / (1.0 + 0.2 * np.where(np.isfinite(depth), depth, RANGE_MAX_M))
    return View((255 * colour * shade[..., None]).astype(np.uint8), depth.astype(np.float32), obstacle)
