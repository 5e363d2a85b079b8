"""Rigid poses and angles: map frame z up (REP-103), quaternions xyzw unless a name says otherwise."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from benchbot.core.channels import FramePose

if TYPE_CHECKING:  # most processes that know poses make no matrices, and numpy takes as long to import as all of these
    import numpy as np
    from numpy.typing import NDArray

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Pose:
    """A rigid transform: translation in metres and a unit quaternion (x, y, z, w)."""

    translation_xyz: Vector3 = (0.0, 0.0, 0.0)
    rotation_xyzw: Quaternion = (0.0, 0.0, 0.0, 1.0)

    @classmethod
    def planar(cls, x: float, y: float, yaw_rad: float, z: float = 0.0) -> Self:
        """Return the pose of something standing upright at (x, y, z), heading `yaw_rad` from +x, CCW."""
        return cls((x, y, z), (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)))

    @classmethod
    def from_wxyz_xyz(cls, values: Sequence[float]) -> Self:
        """Return the pose of a v2 declaration: `[qw, qx, qy, qz, x, y, z]`, normalised."""
        if len(values) != 7:
            raise ValueError(f"a pose has 7 numbers [qw, qx, qy, qz, x, y, z], not {len(values)}")
        w, x, y, z, *translation = (float(value) for value in values)
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        if not norm > 0:
            raise ValueError("a pose's quaternion has length zero")
        return cls((translation[0], translation[1], translation[2]), (x / norm, y / norm, z / norm, w / norm))

    @classmethod
    def from_xyz_rpy_deg(cls, xyz: Sequence[float], rpy_deg: Sequence[float] = (0.0, 0.0, 0.0)) -> "Pose":
        """Return the pose of a mount: metres, and roll, pitch, yaw about the static x, y and z axes in degrees."""
        x, y, z = (float(value) for value in xyz)
        roll, pitch, yaw = (math.radians(float(value)) / 2 for value in rpy_deg)
        about_x = Pose(rotation_xyzw=(math.sin(roll), 0.0, 0.0, math.cos(roll)))
        about_y = Pose(rotation_xyzw=(0.0, math.sin(pitch), 0.0, math.cos(pitch)))
        about_z = Pose((x, y, z), (0.0, 0.0, math.sin(yaw), math.cos(yaw)))
        return about_z @ about_y @ about_x

    @classmethod
    def from_matrix(cls, matrix: "NDArray[np.float64]") -> Self:
        """Return the pose of a 4x4 homogeneous matrix."""
        import numpy as np

        r = matrix[:3, :3]
        # Shepperd's method: divide by the largest of the four candidates, so that nothing cancels.
        trace = float(np.trace(r))
        candidates = (r[0, 0], r[1, 1], r[2, 2], trace)
        largest = int(np.argmax(candidates))
        if largest == 3:
            q = (r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + trace)
        else:
            i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
            values = [0.0, 0.0, 0.0, r[k, j] - r[j, k]]
            values[i] = 1 - trace + 2 * r[i, i]
            values[j] = r[i, j] + r[j, i]
            values[k] = r[i, k] + r[k, i]
            q = (values[0], values[1], values[2], values[3])
        norm = math.sqrt(sum(float(value) ** 2 for value in q))
        x, y, z, w = (float(value) / norm for value in q)
        translation = matrix[:3, 3]
        return cls((float(translation[0]), float(translation[1]), float(translation[2])), (x, y, z, w))

    @property
    def yaw_rad(self) -> float:
        """Heading about the z axis, in [-pi, pi)."""
        x, y, z, w = self.rotation_xyzw
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def rpy_rad(self) -> Vector3:
        """Roll, pitch and yaw about the static x, y and z axes."""
        x, y, z, w = self.rotation_xyzw
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
        return (roll, pitch, self.yaw_rad)

    def matrix(self) -> "NDArray[np.float64]":
        """Return the 4x4 homogeneous matrix, float64."""
        import numpy as np

        x, y, z, w = self.rotation_xyzw
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = self.translation_xyz
        return matrix

    def record(self, parent_frame: str) -> FramePose:
        """Return the pose as the channel `poses` has it: metres, radians, float64."""
        import numpy as np

        return {
            "parent_frame": parent_frame,
            "translation_xyz": np.array(self.translation_xyz, np.float64),
            "rotation_rpy": np.array(self.rpy_rad, np.float64),
            "rotation_xyzw": np.array(self.rotation_xyzw, np.float64),
        }

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return self ∘ other: `other` expressed in the frame of which `self` is a pose."""
        ax, ay, az, aw = self.rotation_xyzw
        bx, by, bz, bw = other.rotation_xyzw
        rotation = (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
        x, y, z = self._rotated(other.translation_xyz)
        tx, ty, tz = self.translation_xyz
        return Pose((tx + x, ty + y, tz + z), rotation)

    def inverse(self) -> "Pose":
        """Return the pose that undoes this one."""
        x, y, z, w = self.rotation_xyzw
        turned_back = Pose((0.0, 0.0, 0.0), (-x, -y, -z, w))
        tx, ty, tz = turned_back._rotated(self.translation_xyz)
        return Pose((-tx, -ty, -tz), turned_back.rotation_xyzw)

    def _rotated(self, vector: Vector3) -> Vector3:
        qx, qy, qz, qw = self.rotation_xyzw
        x, y, z = vector
        # v + 2 q × (q × v + w v)
        cx, cy, cz = qy * z - qz * y + qw * x, qz * x - qx * z + qw * y, qx * y - qy * x + qw * z
        return (x + 2 * (qy * cz - qz * cy), y + 2 * (qz * cx - qx * cz), z + 2 * (qx * cy - qy * cx))


def wrap_angle_rad(angle_rad: float) -> float:
    """Return the same direction in [-pi, pi)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi
