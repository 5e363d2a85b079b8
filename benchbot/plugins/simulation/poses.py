"""Poses of many things as arrays, to the last bit those of `benchbot.core.geometry.Pose`."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from benchbot.plugin import Pose

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Trigonometry:
    """Functions of arrays of float64: `EXACT` those of the C library, as `math` has them, `QUICK` numpy's.

    They may differ in the last bit.
    """

    sin: Callable[[Floats], Floats]
    cos: Callable[[Floats], Floats]
    atan2: Callable[[Floats, Floats], Floats]


def _each(function: Callable[..., float]) -> Callable[..., Floats]:
    def applied(*arrays: Floats) -> Floats:
        return np.fromiter(map(function, *(array.tolist() for array in arrays)), np.float64, len(arrays[0]))

    return applied


EXACT = Trigonometry(_each(math.sin), _each(math.cos), _each(math.atan2))
QUICK = Trigonometry(np.sin, np.cos, np.arctan2)


@dataclass(frozen=True, eq=False)
class Poses(Sequence[Pose]):
    """N rigid transforms: translations (N, 3) in metres, unit quaternions (N, 4) x, y, z, w."""

    translation_xyz: Floats
    rotation_xyzw: Floats

    @classmethod
    def planar(cls, x: Floats, y: Floats, yaw_rad: Floats, z: Floats, by: Trigonometry) -> "Poses":
        """Return the poses of what stands upright at (x, y, z), all (N,), heading `yaw_rad` from +x, CCW."""
        nothing, half_rad = np.zeros(len(x)), yaw_rad / 2
        return cls(np.stack([x, y, z], 1), np.stack([nothing, nothing, by.sin(half_rad), by.cos(half_rad)], 1))

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.translation_xyz)

    @overload
    def __getitem__(self, index: int) -> Pose: ...
    @overload
    def __getitem__(self, index: Any) -> "Poses": ...
    def __getitem__(self, index: Any) -> Any:
        """Return one pose, or those that numpy would choose."""
        if isinstance(index, int):
            return Pose(tuple(self.translation_xyz[index].tolist()), tuple(self.rotation_xyzw[index].tolist()))
        return Poses(self.translation_xyz[index], self.rotation_xyzw[index])

    def __matmul__(self, mount: Pose) -> "Poses":
        """Return where `mount`, a pose in the frame of each, is in the frame that these are in."""
        ax, ay, az, aw = self.rotation_xyzw.T
        bx, by, bz, bw = mount.rotation_xyzw
        rotation = (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
        x, y, z = mount.translation_xyz
        cx, cy, cz = ay * z - az * y + aw * x, az * x - ax * z + aw * y, ax * y - ay * x + aw * z
        turned = (x + 2 * (ay * cz - az * cy), y + 2 * (az * cx - ax * cz), z + 2 * (ax * cy - ay * cx))
        return Poses(self.translation_xyz + np.stack(turned, 1), np.stack(rotation, 1))

    def yaws_rad(self, by: Trigonometry) -> Floats:
        """Return the headings (N,) about the z axis."""
        x, y, z, w = self.rotation_xyzw.T
        return by.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    def rows(self) -> Floats:
        """Return positions and quaternions (N, 7)."""
        return np.concatenate([self.translation_xyz, self.rotation_xyzw], 1)

    def matrices(self) -> Floats:
        """Return the homogeneous matrices (N, 4, 4)."""
        x, y, z, w = self.rotation_xyzw.T
        matrices = np.zeros((len(self), 4, 4))
        for row, values in enumerate(
            (
                (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
            )
        ):
            for column, value in enumerate(values):
                matrices[:, row, column] = value
        matrices[:, :3, 3] = self.translation_xyz
        matrices[:, 3, 3] = 1.0
        return matrices


def matrices(poses: Sequence[Pose]) -> Floats:
    """Return the homogeneous matrices (N, 4, 4) of poses."""
    return poses.matrices() if isinstance(poses, Poses) else np.stack([pose.matrix() for pose in poses])
