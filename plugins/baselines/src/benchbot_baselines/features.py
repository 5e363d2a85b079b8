"""The input of the segmenter: one function for training and for robots, so that both see the same bytes."""

import numpy as np
from numpy.typing import NDArray

CHANNELS = ("red", "green", "blue", "nearness", "height", "normal_forwards", "normal_left", "normal_up")
"""Nearness is 0.5 m over depth, height above the floor 0 to 3 m, normals those of the surface towards the camera."""
NEAREST_M, TALLEST_M = 0.5, 3.0
STRIDE = 16
"""Heights and widths are multiples of it; labels come out at half of both."""


def input_size(height: int, width: int, wanted_width: int = 320) -> tuple[int, int]:
    """Return the height and width of the input for a picture, of about its shape."""
    return max(round(wanted_width * height / width / STRIDE), 1) * STRIDE, wanted_width


def sampled(length: int, count: int) -> NDArray[np.intp]:
    """Return the rows, or columns, of `length` that `count` are taken from, evenly."""
    return ((np.arange(count) + 0.5) * length / count).astype(np.intp)


def features(rgb: NDArray[np.uint8], points: NDArray[np.floating], depth_m: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return `CHANNELS` (8, h, w) of colours (h, w, 3), points (h, w, 3) and depth (h, w).

    Points are in metres from the place on the floor below the camera, x where it looks, y left, z up. Where depth is
    not above 0 they count for nothing.
    """
    valid = np.isfinite(depth_m) & (depth_m > 0)
    safe = np.where(valid[..., None], points, 0.0).astype(np.float32)
    across, down = np.zeros_like(safe), np.zeros_like(safe)
    across[:, 1:-1] = safe[:, 2:] - safe[:, :-2]
    down[1:-1] = safe[2:] - safe[:-2]
    normals = np.cross(down, across)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where((lengths > 0) & valid[..., None], normals / np.maximum(lengths, 1e-9), 0)
    near = np.where(valid, NEAREST_M / np.maximum(np.where(valid, depth_m, 1), NEAREST_M), 0)
    height = np.where(valid, np.clip(safe[..., 2] / TALLEST_M, 0, 1), 0)
    measured = np.stack([near, height, *np.moveaxis(0.5 + 0.5 * normals, -1, 0)])
    return np.concatenate([np.moveaxis(rgb, -1, 0), np.rint(measured * 255).astype(np.uint8)])


def levelled(camera_to_map: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the optical frame to one with x where the camera looks, and z up."""
    forward = np.asarray(camera_to_map, np.float64)[:3, 2]
    yaw = np.arctan2(forward[1], forward[0])
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    return np.asarray(turn @ np.asarray(camera_to_map, np.float64)[:3, :3])
