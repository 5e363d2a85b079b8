"""Observations that conform, of nothing in particular: what recorders and agents are tried on without a robot."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from benchbot.core.geometry import Pose

HEIGHT, WIDTH, FOCAL_PX = 48, 64, 32.0
LABELS = ("bottle", "chair")
BEAMS = 36
FRAMES = ("base_link", "initial_pose", "camera", "lidar")
CAMERA_IN_BASE = Pose((0.1, 0.0, 0.5), (-0.5, 0.5, -0.5, 0.5))


def observations(channels: Iterable[str], base: Pose, random: np.random.Generator) -> dict[str, Any]:
    """Return a value of each channel, made anew at each call, as a robot at `base` in the map frame might see it."""
    depth_m = random.uniform(0.5, 8.0, (HEIGHT, WIDTH)).astype(np.float32)
    depth_m[0] = np.inf
    depth_m[:, 0] = np.nan
    classes = random.integers(0, len(LABELS) + 1, (HEIGHT, WIDTH)).astype(np.uint8)
    azimuths_rad = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
    ranges_m = random.uniform(1.0, 8.0, BEAMS)
    ranges_m[0] = np.inf
    poses = {"base_link": base, "initial_pose": Pose(), "camera": base @ CAMERA_IN_BASE, "lidar": base}
    every: dict[str, Any] = {
        "image_rgb": random.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8),
        "image_depth": depth_m,
        "image_segment": {
            "class_segment_img": classes,
            "instance_segment_img": classes.astype(np.uint16) * 1000 + (classes > 0),
            "class_ids": {name: number for number, name in enumerate(LABELS, 1)},
        },
        "laser": {"scans": np.stack([ranges_m, azimuths_rad], 1), "range_min": 0.1, "range_max": 10.0},
        "lidar": {
            "frame_id": "lidar",
            "ranges_m": np.tile(ranges_m.astype(np.float32), (4, 1)),
            "elevations_rad": np.linspace(-0.2, 0.2, 4),
            "azimuths_rad": azimuths_rad,
        },
        "imu": {
            "orientation_xyzw": np.array(base.rotation_xyzw),
            "angular_velocity_radps": np.zeros(3),
            "linear_acceleration_mps2": np.array([0.0, 0.0, 9.81]),
        },
        "poses": {name: pose.record("map") for name, pose in poses.items()},
        "goal": np.array([1.0, 0.5]),
    }
    every |= {name: _camera_model() for name in ("image_rgb_info", "image_depth_info", "image_segment_info")}
    return {name: every[name] for name in channels}


def _camera_model() -> dict[str, Any]:
    intrinsics = np.array([[FOCAL_PX, 0.0, WIDTH / 2], [0.0, FOCAL_PX, HEIGHT / 2], [0.0, 0.0, 1.0]])
    return {
        "frame_id": "camera",
        "height": HEIGHT,
        "width": WIDTH,
        "matrix_intrinsics": intrinsics,
        "matrix_projection": np.hstack([intrinsics, np.zeros((3, 1))]),
    }
