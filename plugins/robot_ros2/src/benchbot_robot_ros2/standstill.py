"""Detection of standstill from odometry."""

import math
from collections.abc import Iterable
from typing import Any

from benchbot_robot_ros2.ramp import Velocity
from benchbot_robot_ros2.streams import Sample

# Below this, a measured velocity is noise: gyroscopes and visual odometry never say exactly zero. A robot that brakes
# through 0.01 m/s at 1 m/s² stops within 0.05 mm.
STILL_MPS, STILL_RADPS = 0.01, 0.02
# For how long: odometry comes late, and one message may be an accident.
REST_S = 0.1


def measured_velocity(message: Any) -> Velocity:
    """Return the base's velocity in an Odometry message."""
    twist = message.twist.twist
    return Velocity(float(twist.linear.x), float(twist.angular.z), float(twist.linear.y))


def speed_mps(message: Any) -> float:
    """Return how fast the base moves in any direction on the floor; it has the sign of its motion along +x."""
    velocity = message.twist.twist.linear
    return math.copysign(math.hypot(velocity.x, velocity.y), velocity.x)


def still(message: Any) -> bool:
    """Return whether an Odometry message shows no motion."""
    return abs(speed_mps(message)) < STILL_MPS and abs(message.twist.twist.angular.z) < STILL_RADPS


def rested(odometry: Iterable[Sample], since_s: float) -> bool:
    """Return whether the messages that came after `since_s` end with standing still for long enough."""
    still_since_s = newest_s = since_s
    for sample in odometry:
        if sample.arrived_s >= since_s:
            newest_s = sample.arrived_s
            if not still(sample.message):
                still_since_s = newest_s
    return newest_s - still_since_s >= REST_S
