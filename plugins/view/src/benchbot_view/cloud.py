"""The cloud of the points that were seen: made of depth pictures, thinned out, in the map frame."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import Pose
from benchbot.viewing import Camera

MOST_POINTS = 60_000
VOXELS_M = (0.03, 0.05, 0.08, 0.12, 0.2, 0.4)
FARTHEST_M = 20.0
CEILING_M = 2.2
"""Points above are left out: who looks from above wants to see the floor."""
STRIDE = 4

Points = NDArray[np.float64]


class Cloud:
    """Points of all frames, one for each voxel, with the frame that saw it first."""

    def __init__(self) -> None:
        self._parts: list[tuple[Points, NDArray[np.uint8], int, int]] = []

    def add(self, depth: NDArray[Any], camera: Camera, base: Pose, rgb: Any, number: int, scene: int) -> None:
        """Add what a depth picture shows, in the colours of the camera's picture, of one observation of a scene."""
        points, pixels = _points(depth, camera, base)
        pixels = _scaled(pixels, depth, rgb)
        kept = points[:, 2] < CEILING_M
        points, pixels = points[kept], pixels[kept]
        _, first = np.unique(np.floor(points / VOXELS_M[0]).astype(np.int32), axis=0, return_index=True)
        colors = np.full((len(points), 3), 150, np.uint8) if rgb is None else _colors(np.asarray(rgb), pixels)
        self._parts.append((points[first], colors[first], number, scene))

    def write(self, path: Path) -> bool:
        """Write the cloud, thinned out; return whether there is one."""
        if not self._parts:
            return False
        points = np.concatenate([part[0] for part in self._parts])
        colors = np.concatenate([part[1] for part in self._parts])
        numbers = np.concatenate([np.full(len(part[0]), part[2], np.uint16) for part in self._parts])
        scenes = np.concatenate([np.full(len(part[0]), part[3], np.uint8) for part in self._parts])
        for side_m in VOXELS_M:
            cells = np.column_stack([scenes, np.floor(points / side_m).astype(np.int32)])
            _, first = np.unique(cells, axis=0, return_index=True)
            if len(first) <= MOST_POINTS:
                break
        first = np.sort(first)[:MOST_POINTS]
        low = points[first].min(0)
        scale_m = max(float(np.ptp(points[first], axis=0).max()) / 65535, 1e-6)
        quantized = np.round((points[first] - low) / scale_m).astype("<u2")
        document = {
            "low": low.round(6).tolist(),
            "scale_m": scale_m,
            "points": base64_of(quantized),
            "colors": base64_of(colors[first]),
            "frames": base64_of(numbers[first].astype("<u2")),
            "scenes": base64_of(scenes[first]),
        }
        path.write_text(json.dumps(document), "utf-8")
        return True


def _colors(rgb: NDArray[np.uint8], pixels: NDArray[np.intp]) -> NDArray[np.uint8]:
    return rgb[pixels[:, 0].clip(max=rgb.shape[0] - 1), pixels[:, 1].clip(max=rgb.shape[1] - 1), :3]


def _scaled(pixels: NDArray[np.intp], depth: NDArray[Any], rgb: Any) -> NDArray[np.intp]:
    """Return where pixels of depth are in a picture that may be larger."""
    return pixels if rgb is None else pixels * max(np.asarray(rgb).shape[1] // depth.shape[1], 1)


def _points(depth: NDArray[Any], camera: Camera, base: Pose) -> tuple[Points, NDArray[np.intp]]:
    """Return points in the map frame, (N, 3), and their pixels, (N, 2), row and column: of every few pixels one."""
    stride = max(round(STRIDE * depth.shape[1] / camera.width), 1)
    rows, columns = np.mgrid[stride // 2 : depth.shape[0] : stride, stride // 2 : depth.shape[1] : stride]
    distances = depth[rows, columns].astype(float)
    valid = np.isfinite(distances) & (distances > 0.05) & (distances < FARTHEST_M)
    rows, columns, distances = rows[valid], columns[valid], distances[valid]
    # A picture may be smaller than the declaration says.
    scale = depth.shape[1] / camera.width
    x = (columns + 0.5 - camera.cx * scale) / (camera.fx * scale) * distances
    y = (rows + 0.5 - camera.cy * scale) / (camera.fy * scale) * distances
    rotation, translation = matrix(base @ camera.mount)
    return np.stack([x, y, distances], 1) @ rotation.T + translation, np.stack([rows, columns], 1)


def matrix(pose: Pose) -> tuple[Points, Points]:
    """Return the rotation and the translation of a pose."""
    origin = np.array(pose.translation_xyz)
    axes = [np.array((pose @ Pose(axis)).translation_xyz) - origin for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    return np.stack(axes, 1), origin


def base64_of(array: NDArray[Any]) -> str:
    """Return the bytes of an array as text."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
