"""From pixels to points in the map frame and back: pinhole cameras, with and without the distortion of a lens.

Lengths are metres. The optical frame of a camera has x right, y down, z forward; the map frame has z up. Depth is z in
the optical frame, not the distance to the camera. Pixel (u, v) is column u, row v, and its centre is at integers.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchbot.plugin import BenchbotError, CameraModel, FailureClass, FramePose, Observations, did_you_mean
from benchbot.plugins.mapping.lens import Doubles, coefficients_of, distort, undistort

Floats = NDArray[np.float32]

NEAREST_M, FARTHEST_M = 0.05, 12.0


@dataclass(frozen=True)
class PointCloud:
    """Points on surfaces that a depth camera saw from one pose, in the map frame.

    `points` float32 (N, 3), metres; `colors` uint8 (N, 3), sRGB, None without a colour picture; `rows` and `columns`
    (N,) are the pixels that show them, so that `labels[cloud.rows, cloud.columns]` are labels of the points.
    """

    points: Floats
    colors: NDArray[np.uint8] | None
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]


def point_cloud(observations: Observations, farthest_m: float = FARTHEST_M) -> PointCloud:
    """Return the points of `image_depth` from `NEAREST_M` to `farthest_m`, with the colours of `image_rgb`.

    A colour picture of another size or camera model is looked up where the points appear in it; points outside of it
    are left out. Raises BenchbotError for an observation that the task does not give.
    """
    depth_m, info, pose = depth_view(observations)
    check_size(depth_m, info)
    rows, columns = np.nonzero((depth_m > NEAREST_M) & (depth_m < farthest_m))
    inside = pixel_rays(info).reshape(*depth_m.shape, 3)[rows, columns] * depth_m[rows, columns, None]
    points = in_map_frame(inside, pose)
    if "image_rgb" not in observations:
        return PointCloud(points, None, rows, columns)
    picture = observations["image_rgb"]
    color_info = observations.get("image_rgb_info", info)
    check_size(picture, color_info)
    if _same_camera(info, color_info):
        return PointCloud(points, picture[rows, columns], rows, columns)
    if info["frame_id"] != color_info["frame_id"]:
        raise BenchbotError(
            "Colour and depth are of two cameras.",
            f"Depth is in the frame '{info['frame_id']}', colour in '{color_info['frame_id']}'.",
            "Have the robot publish depth that is registered to colour; or map without colours, from an observation "
            "that lacks image_rgb.",
        )
    pixels, _ = project(inside, color_info)
    u, v = np.rint(pixels).T
    shown = (u >= 0) & (u < color_info["width"]) & (v >= 0) & (v < color_info["height"])
    colors = picture[v[shown].astype(int), u[shown].astype(int)]
    return PointCloud(points[shown], colors, rows[shown], columns[shown])


def depth_view(observations: Observations) -> tuple[Floats, CameraModel, FramePose]:
    """Return depth picture, camera model and pose of the camera, all of one observation.

    A pose that was kept from another step is a pose of another time: use that of the picture's own observation.
    """
    needed(observations, "image_depth", "image_depth_info", "poses")
    poses = observations["poses"]
    if "camera" not in poses:
        raise BenchbotError(
            "The pose of the camera is not observed.",
            f"Among 'poses' are: {', '.join(sorted(poses)) or 'none'}.",
            "Choose a robot with a camera; 'benchbot show robot NAME' names the frames of one.",
            failure=FailureClass.AGENT,
        )
    return observations["image_depth"], observations["image_depth_info"], poses["camera"]


def needed(observations: Observations, *names: str) -> None:
    """Raise BenchbotError for the first observation that is needed and not there."""
    for name in names:
        if name not in observations:
            raise BenchbotError(
                f"The observation '{name}' is needed here, and the task does not give it.",
                f"There are: {', '.join(sorted(observations))}.{did_you_mean(name, list(observations))}",
                "Choose a task that has it ('benchbot show task NAME' says), or leave this step out.",
                failure=FailureClass.AGENT,
            )


def check_size(picture: NDArray[Any], info: CameraModel) -> None:
    """Raise BenchbotError unless a picture (H, W, …) has the size of its camera model."""
    height, width = picture.shape[:2]
    if (height, width) != (info["height"], info["width"]):
        raise BenchbotError(
            "A picture has another size than its camera model.",
            f"It has {width} x {height} pixels, and the model {info['width']} x {info['height']}.",
            "Give the model of this very picture; of one that you have scaled, scale the intrinsics as well.",
            failure=FailureClass.AGENT,
        )


def unproject(depth_m: Floats, info: CameraModel, pose: FramePose | None = None) -> Floats:
    """Return the point that each pixel shows, (H, W, 3), NaN where depth is invalid.

    Points are in the map frame with the `pose` of the camera's optical frame, else in the optical frame itself.
    """
    check_size(depth_m, info)
    valid = np.isfinite(depth_m) & (depth_m > 0)
    depths = np.where(valid, depth_m, np.float32(np.nan))
    points = pixel_rays(info) * depths.reshape(-1, 1)
    return (points if pose is None else in_map_frame(points, pose)).reshape(*depth_m.shape, 3)


def project(points: ArrayLike, info: CameraModel, pose: FramePose | None = None) -> tuple[Doubles, Doubles]:
    """Return where points (N, 3) appear: pixels (u, v), (N, 2), and depth in metres, (N,).

    The inverse of `unproject`. Pixels of points that are not in front of the camera are NaN; those outside of the
    picture are returned as they are.
    """
    given = np.asarray(points, np.float64).reshape(-1, 3)
    inside = given if pose is None else in_frame(given, pose)
    depth_m = inside[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.where(depth_m[:, None] > 0, inside[:, :2] / depth_m[:, None], np.nan)
    x, y = distort(flat[:, 0], flat[:, 1], coefficients_of(info))
    matrix = np.asarray(info["matrix_intrinsics"], np.float64)
    return np.stack([x, y, np.ones_like(x)], -1) @ matrix[:2].T, depth_m


def pixel_rays(info: CameraModel) -> Floats:
    """Return each pixel's ray, (H * W, 3) with z = 1, in the optical frame: times depth, it is the pixel's point.

    Row by row, from the upper left. Not to be written to: it is the same array for the same camera.
    """
    matrix = np.asarray(info["matrix_intrinsics"], np.float64)
    return _rays(info["height"], info["width"], matrix.tobytes(), coefficients_of(info).tobytes())


@lru_cache(maxsize=4)
def _rays(height: int, width: int, matrix: bytes, coefficients: bytes) -> Floats:
    v, u = np.mgrid[0:height, 0:width]
    inverse = np.linalg.inv(np.frombuffer(matrix).reshape(3, 3))
    x, y, _ = (np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3) @ inverse.T).T
    x, y = undistort(x, y, np.frombuffer(coefficients))
    rays: Floats = np.stack([x, y, np.ones_like(x)], axis=-1).astype(np.float32)
    rays.flags.writeable = False
    return rays


def in_map_frame(points: NDArray[Any], pose: FramePose) -> NDArray[Any]:
    """Return points (N, 3) of a frame in the map frame, given the frame's pose."""
    rotation = rotation_matrix(pose["rotation_xyzw"]).astype(points.dtype)
    turned: NDArray[Any] = _rotated(points, rotation) + np.asarray(pose["translation_xyz"], points.dtype)
    return turned


def in_frame(points: NDArray[Any], pose: FramePose) -> NDArray[Any]:
    """Return points (N, 3) of the map frame in a frame, given the frame's pose: the inverse of `in_map_frame`."""
    rotation = rotation_matrix(pose["rotation_xyzw"]).astype(points.dtype)
    moved: NDArray[Any] = points - np.asarray(pose["translation_xyz"], points.dtype)
    return _rotated(moved, rotation.T)


def rotation_matrix(xyzw: Iterable[float]) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3) of a unit quaternion (x, y, z, w)."""
    x, y, z, w = xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def planar(pose: FramePose, axis: int = 0) -> tuple[float, float, float]:
    """Return x, y in metres and the heading, in radians, of one of a frame's axes; a camera looks along 2, its z."""
    x, y, _ = pose["translation_xyz"]
    forwards = rotation_matrix(pose["rotation_xyzw"])[:, axis]
    return float(x), float(y), math.atan2(forwards[1], forwards[0])


def _rotated(points: NDArray[Any], rotation: NDArray[Any]) -> NDArray[Any]:
    """Return points (N, 3) rotated, by columns: a product of matrices this narrow takes numpy 16 times as long."""
    x, y, z = points.T
    return np.stack([row[0] * x + row[1] * y + row[2] * z for row in rotation], axis=-1)


def _same_camera(one: CameraModel, other: CameraModel) -> bool:
    return (
        (one["width"], one["height"]) == (other["width"], other["height"])
        and one["frame_id"] == other["frame_id"]
        and np.array_equal(one["matrix_intrinsics"], other["matrix_intrinsics"])
        and np.array_equal(coefficients_of(one), coefficients_of(other))
    )
