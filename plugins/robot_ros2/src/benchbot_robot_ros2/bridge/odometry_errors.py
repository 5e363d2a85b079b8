"""The uncertainty of wheel odometry, as the covariances of nav_msgs/msg/Odometry say it."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import Pose

Array = npt.NDArray[np.float64]

EXACT_VARIANCE = 1e-9
"""The variance of what is known exactly: the smallest that robot_localization takes as it is (ekf.cpp)."""

_PLANAR = np.array([0, 1, 5])
"""The places of x, y and the turn about z among x, y, z and the turns about x, y, z."""


class OdometryErrors:
    """The way of odometry since the last start, tick by tick, and the covariance of where it believes to be.

    The model is that of the simulators: of each control tick the way is off by the factor 1 + N(0, linear²), the turn
    by 1 + N(0, angular²), independently (`noise` of the robot's declaration). The covariance is carried on from tick to
    tick to first order (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 7.4, without the measurement).
    """

    def __init__(self, noise: Mapping[str, Any]) -> None:
        self._linear, self._angular = (float(noise.get(key, 0.0)) for key in ("linear", "angular"))
        self.start(Pose())

    def start(self, pose: Pose) -> None:
        """Begin at a pose that is known exactly, at rest."""
        self._pose = pose
        self._covariance = np.zeros((3, 3))
        self.rest()

    def rest(self) -> None:
        """Stand still."""
        self.velocity = (0.0, 0.0)

    def follow(self, pose: Pose, duration_s: float) -> None:
        """Go on to where odometry believes to be after another tick."""
        step = self._pose.inverse() @ pose
        chord_x, chord_y, _ = step.translation_xyz
        turn_rad = step.yaw_rad
        half_rad = turn_rad / 2
        chord_m = chord_x * math.cos(half_rad) + chord_y * math.sin(half_rad)
        # An arc is as much longer than its chord as the half turn is larger than its sine.
        way_m = chord_m * (half_rad / math.sin(half_rad) if abs(half_rad) > 1e-6 else 1.0)
        heading_rad = self._pose.yaw_rad + half_rad
        across, along = math.sin(heading_rad), math.cos(heading_rad)
        carried = np.array([[1, 0, -way_m * across], [0, 1, way_m * along], [0, 0, 1]])
        caused = np.array([[along, -way_m * across / 2], [across, way_m * along / 2], [0, 1]])
        variances = np.array([self._linear * way_m, self._angular * turn_rad]) ** 2
        self._covariance = carried @ self._covariance @ carried.T + (caused * variances) @ caused.T
        self._pose = pose
        self.velocity = (way_m / duration_s, turn_rad / duration_s) if duration_s > 0 else (0.0, 0.0)

    def pose_covariance(self) -> Array:
        """Return the covariance (36,) of x, y, z and the turns about x, y, z, in the frame of odometry."""
        return _spatial(self._covariance)

    def twist_covariance(self) -> Array:
        """Return the covariance (36,) of the velocity, in the frame of the base; it does not slide sideways."""
        linear_mps, angular_radps = self.velocity
        return _spatial(np.diag([(self._linear * linear_mps) ** 2, 0.0, (self._angular * angular_radps) ** 2]))


def exact() -> Array:
    """Return the covariance (36,) of what is known exactly."""
    return _spatial(np.zeros((3, 3)))


def _spatial(planar: Array) -> Array:
    """Return a covariance of x, y and yaw as one of six dimensions; a robot on a floor does not leave the plane."""
    covariance = np.eye(6) * EXACT_VARIANCE
    covariance[np.ix_(_PLANAR, _PLANAR)] += (planar + planar.T) / 2
    return covariance.ravel()
