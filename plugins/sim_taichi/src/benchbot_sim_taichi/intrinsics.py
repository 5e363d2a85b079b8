"""Cameras: their intrinsics, and their records for kernels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot.simulation import Distortion
from benchbot_sim_taichi.tables import CAMERA_STRIDE


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera, in pixels.

    Pixel (u, v) covers [u, u + 1) x [v, v + 1) of the continuous image plane, so its centre is at (u + 0.5, v + 0.5)
    and a centred camera has `cx = width / 2`. (ROS and OpenCV count pixel centres at integers: their cx is ours minus
    0.5.)
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: Distortion | None = None

    @classmethod
    def from_horizontal_fov(cls, width: int, height: int, hfov_deg: float) -> "Intrinsics":
        """Square pixels, optical axis through the centre."""
        focal = width / (2.0 * np.tan(np.radians(hfov_deg) / 2.0))
        return cls(width, height, float(focal), float(focal), width / 2.0, height / 2.0)


def camera_records(
    camera_poses: npt.NDArray[np.floating],
    intrinsics: Intrinsics | Sequence[Intrinsics],
    exposure: npt.NDArray[np.float64] | float = 1.0,
) -> npt.NDArray[np.float32]:
    """(N * 25,), as kernels take it: rotation by rows, position, fx, fy, cx, cy, exposure of red, green, blue.

    Then 1 where the lens distorts, else 0, and k1, k2, p1, p2, k3.
    """
    records = np.ones((len(camera_poses), CAMERA_STRIDE), np.float32)
    records[:, 0:9] = camera_poses[:, :3, :3].reshape(-1, 9)
    records[:, 9:12] = camera_poses[:, :3, 3]
    lenses = [intrinsics] if isinstance(intrinsics, Intrinsics) else intrinsics
    if len(records):
        records[:, 12:16] = [(lens.fx, lens.fy, lens.cx, lens.cy) for lens in lenses]
        records[:, 16:19] = exposure
        records[:, 19:25] = [_distortion_record(lens) for lens in lenses]
    return records.ravel()


def common_size(
    camera_poses: npt.NDArray[np.floating], intrinsics: Intrinsics | Sequence[Intrinsics]
) -> tuple[int, int]:
    """Width and height of all pictures of a batch of (N, 4, 4) poses; raises BenchbotError where there is no such."""
    if camera_poses.ndim != 3 or camera_poses.shape[1:] != (4, 4):
        raise BenchbotError(
            f"These are no camera poses: an array of shape {camera_poses.shape}",
            "A batch takes one 4 x 4 matrix for each of its N cameras.",
            "Give an array of shape (N, 4, 4), such as np.stack([pose.matrix() for pose in poses]).",
        )
    if isinstance(intrinsics, Intrinsics):
        return intrinsics.width, intrinsics.height
    if len(intrinsics) != len(camera_poses):
        raise BenchbotError(
            f"There are {len(camera_poses)} camera poses but {len(intrinsics)} intrinsics",
            "Either all cameras of a batch share one, or each has its own.",
            "Give one Intrinsics, or as many as there are poses.",
        )
    sizes = sorted({(lens.width, lens.height) for lens in intrinsics})
    if len(sizes) > 1:
        raise BenchbotError(
            "The cameras of this batch differ in size: " + ", ".join(f"{width} x {height}" for width, height in sizes),
            "The pictures of a batch come as one array.",
            "Take the pictures of each size in a batch of their own.",
        )
    return sizes[0] if sizes else (0, 0)


def _distortion_record(lens: Intrinsics) -> tuple[float, ...]:
    return (1.0, *lens.distortion.coefficients().tolist()) if lens.distortion else (0.0,) * 6
