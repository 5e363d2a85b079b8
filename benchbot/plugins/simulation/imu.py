"""The inertial measurement unit of a simulated robot: gyroscope and accelerometer, without a compass."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from benchbot.plugin import InertialMeasurement, Pose
from benchbot.plugins.simulation.declared import check_keys, optional

GRAVITY_MPS2 = 9.80665


@dataclass(frozen=True)
class Motion:
    """The motion of the base: velocities now, and their changes in its own frame over the last tick.

    They are along its +x (`linear`), about its +z (`angular`) and along its +y (`lateral`).
    """

    linear_mps: float = 0.0
    angular_radps: float = 0.0
    linear_mps2: float = 0.0
    angular_radps2: float = 0.0
    lateral_mps: float = 0.0
    lateral_mps2: float = 0.0

    def after(self, linear_mps: float, angular_radps: float, duration_s: float, lateral_mps: float = 0.0) -> "Motion":
        """Return the motion at the end of a tick with these velocities."""
        if not duration_s > 0:
            return self
        return Motion(
            linear_mps,
            angular_radps,
            (linear_mps - self.linear_mps) / duration_s,
            (angular_radps - self.angular_radps) / duration_s,
            lateral_mps,
            (lateral_mps - self.lateral_mps) / duration_s,
        )


@dataclass(frozen=True)
class InertialNoise:
    """Normal errors of each axis, independent from tick to tick; there is no bias."""

    angular_velocity_sigma_radps: float = 0.0
    linear_acceleration_sigma_mps2: float = 0.0

    def __post_init__(self) -> None:
        if not (0 <= self.angular_velocity_sigma_radps < np.inf and 0 <= self.linear_acceleration_sigma_mps2 < np.inf):
            raise ValueError(f"{self} is negative or not finite")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a unit's `noise`; raises TypeError or ValueError when it is not one."""
        return cls(**{str(key): float(value) for key, value in values.items()})


@dataclass(frozen=True)
class Imu:
    """A unit that measures in its frame; without a compass, which would tell robots of noisy odometry their heading."""

    frame: str
    noise: InertialNoise = InertialNoise()

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a robot's `imu` mapping; raises KeyError, TypeError or ValueError when it is not one."""
        check_keys("imu", values, cls)
        noise = optional(values, "noise", InertialNoise.from_mapping)
        return cls(frame=str(values["frame"]), noise=noise or InertialNoise())

    def measure(self, motion: Motion, mount: Pose, random: np.random.Generator) -> InertialMeasurement:
        """Return angular velocity and specific force where the unit is mounted: at rest +9.80665 m/s² upwards."""
        from_base = mount.matrix()[:3, :3].T
        turn = np.array([0.0, 0.0, motion.angular_radps])
        turning = np.array([0.0, 0.0, motion.angular_radps2])
        lever = np.array(mount.translation_xyz)
        # The base's velocity turns with it: hence the centripetal parts across it.
        turn_radps = motion.angular_radps
        force = np.array(
            [
                motion.linear_mps2 - motion.lateral_mps * turn_radps,
                motion.lateral_mps2 + motion.linear_mps * turn_radps,
                GRAVITY_MPS2,
            ]
        )
        force += np.cross(turning, lever) + np.cross(turn, np.cross(turn, lever))
        errors = random.standard_normal((2, 3))
        return {
            "orientation_xyzw": np.full(4, np.nan),
            "angular_velocity_radps": from_base @ turn + self.noise.angular_velocity_sigma_radps * errors[0],
            "linear_acceleration_mps2": from_base @ force + self.noise.linear_acceleration_sigma_mps2 * errors[1],
        }
