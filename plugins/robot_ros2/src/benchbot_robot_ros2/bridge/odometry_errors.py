"""The uncertainty of wheel odometry, as the covariances of nav_msgs/msg/Odometry say it."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import Pose
from benchbot_robot_ros2.ramp import REST, Velocity

Array = npt.NDArray[np.float64]

EXACT_VARIANCE = 1e-9
"""The variance of what is known exactly: the smallest that robot_localization takes as it is (ekf.cpp)."""

_PLANAR = np.array([0, 1, 5])
"""The places of x, y and the turn about z among x, y, z and the turns about x, y, z."""


class OdometryErrors:
    """The way of odometry since the last start, tick by tick, and the covariance of where it believes to be.

    The model is that of the simulators: of each control tick the way is off by the factor 1 + N(0, linear²), the turn
    by 1 + N(0, angular²), independently (`noise` of the robot's declaration). The way of a `holonomic` base has a part
    to its left, that of another has none. The covariance is carried on from tick to tick to first order (Thrun, Burgard
    and Fox, Probabilistic Robotics, 2005, section 7.4, without the measurement).
    """

    def __init__(self, noise: Mapping[str, Any], *, holonomic: bool = False) -> None:
        self._holonomic = holonomic
        self._linear, self._angular = (float(noise.get(key, 0.0)) for key in ("linear", "angular"))
        self.start(Pose())

    def start(self, pose: Pose) -> None:
        """Begin at a pose that is known exactly, at rest."""
        self._pose = pose
        self._covariance = np.zeros((3, 3))
        self.rest()

    def rest(self) -> None:
        """Stand still."""
        self.velocity = REST

    def follow(self, pose: Pose, duration_s: float) -> None:
        """Go on to where odometry believes to be after another tick."""
        step = self._pose.inverse() @ pose
        chord_x, chord_y, _ = step.translation_xyz
        turn_rad = step.yaw_rad
        half_rad = turn_rad / 2
        cos, sin = math.cos(half_rad), math.sin(half_rad)
        # An arc is as much longer than its chord as the half turn is larger than its sine.
        arc = half_rad / sin if abs(half_rad) > 1e-6 else 1.0
        way_m = (chord_x * cos + chord_y * sin) * arc
        side_m = (chord_y * cos - chord_x * sin) * arc if self._holonomic else 0.0
        heading_rad = self._pose.yaw_rad + half_rad
        across, along = math.sin(heading_rad), math.cos(heading_rad)
        step_x, step_y = way_m * along - side_m * across, way_m * across + side_m * along
        carried = np.array([[1, 0, -step_y], [0, 1, step_x], [0, 0, 1]])
        # One factor scales the whole way: its error lies along the step, for each metre of it.
        length_m = math.hypot(step_x, step_y)
        towards = (step_x / length_m, step_y / length_m) if length_m else (along, across)
        caused = np.array([[towards[0], -step_y / 2], [towards[1], step_x / 2], [0, 1]])
        variances = np.array([self._linear * length_m, self._angular * turn_rad]) ** 2
        self._covariance = carried @ self._covariance @ carried.T + (caused * variances) @ caused.T
        self._pose = pose
        self.velocity = REST
        if duration_s > 0:
            self.velocity = Velocity(way_m / duration_s, turn_rad / duration_s, side_m / duration_s)

    def pose_covariance(self) -> Array:
        """Return the covariance (36,) of x, y, z and the turns about x, y, z, in the frame of odometry."""
        return _spatial(self._covariance)

    def twist_covariance(self) -> Array:
        """Return the covariance (36,) of the velocity, in the frame of the base; one factor scales the way."""
        linear_mps, angular_radps, lateral_mps = self.velocity
        planar = np.diag([0.0, 0.0, (self._angular * angular_radps) ** 2])
        planar[:2, :2] = self._linear**2 * np.outer([linear_mps, lateral_mps], [linear_mps, lateral_mps])
        return _spatial(planar)


def exact() -> Array:
    """Return the covariance (36,) of what is known exactly."""
    return _spatial(np.zeros((3, 3)))


def _spatial(planar: Array) -> Array:
    """Return a covariance of x, y and yaw as one of six dimensions; a robot on a floor does not leave the plane."""
    covariance = np.eye(6) * EXACT_VARIANCE
    covariance[np.ix_(_PLANAR, _PLANAR)] += (planar + planar.T) / 2
    return covariance.ravel()
