from typing import Any

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def observations() -> dict[str, Any]:
    """What a robot could observe in front of two chairs and a table, with depth and beams that are missing."""
    height, width = 60, 80
    depth = np.tile(np.linspace(1, 5, width, dtype=np.float32), (height, 1))
    depth[:10, :10], depth[:10, -10:], depth[-10:, :10] = np.nan, np.inf, -np.inf
    classes = np.zeros((height, width), np.uint8)
    classes[10:40, 5:50], classes[15:55, 55:75] = 19, 20
    instances = classes.astype(np.uint16) * 1000 + (classes > 0)
    instances[10:40, 30:50] += 1
    angles = np.linspace(-np.pi, np.pi, 90, endpoint=False)
    ranges = np.where(np.arange(90) % 10, 2 / np.maximum(abs(np.cos(angles)), abs(np.sin(angles))), np.inf)
    ranges[5] = np.nan
    half = np.sqrt(0.5)
    poses = {
        "base_link": ([1.0, 0.5, 0.0], [0.0, 0.0, half, half]),
        "lidar": ([1.0, 0.5, 0.6], [0.0, 0.0, half, half]),
        "camera_left": ([1.0, 0.5, 1.0], [-0.5, 0.5, -0.5, 0.5]),
        "camera": ([1.0, 0.5, 1.0], [-0.5, 0.5, -0.5, 0.5]),
    }
    return {
        "image_rgb": np.full((height, width, 3), (200, 120, 40), np.uint8),
        "image_depth": depth,
        "image_segment": {
            "class_segment_img": classes,
            "instance_segment_img": instances,
            "class_ids": {"chair": 19, "table": 20},
        },
        "laser": {"scans": np.stack([ranges, angles], 1), "range_min": 0.1, "range_max": 20.0},
        "lidar": {
            "frame_id": "velodyne",
            "ranges_m": np.array([[1.0, np.inf, 2.0], [np.nan, 3.0, -np.inf]], np.float32),
            "elevations_rad": np.array([-0.1, 0.1]),
            "azimuths_rad": np.array([-2.0, 0.0, 2.0]),
        },
        "poses": {
            name: {"parent_frame": "map", "translation_xyz": np.array(xyz), "rotation_xyzw": np.array(xyzw)}
            for name, (xyz, xyzw) in poses.items()
        },
        "scene_number": 0,
    }
