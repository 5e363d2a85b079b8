"""The motion of a base, differential or holonomic: velocity and acceleration limits, integrated as short arcs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

from benchbot.plugin import MotionConfig

LONGEST_SUBSTEP_M = 0.01
WIDEST_SUBSTEP_RAD = math.radians(1.0)


@dataclass(frozen=True, slots=True)
class State:
    """The pose of the base (m, m, rad, map frame) and its velocity (m/s along its +x and +y, rad/s about +z)."""

    x: float
    y: float
    yaw_rad: float
    linear_mps: float = 0.0
    angular_radps: float = 0.0
    lateral_mps: float = 0.0


@dataclass(frozen=True)
class DriveLimits:
    """The limits of the drive, all enforced: velocities (backwards negative) and accelerations.

    `lateral_mps` is that of a holonomic base, to both sides, with the linear acceleration; 0 for a differential one.
    """

    linear_mps: tuple[float, float]
    angular_radps: float
    linear_acceleration_mps2: float
    angular_acceleration_radps2: float
    lateral_mps: float = 0.0

    @classmethod
    def from_motion(cls, motion: MotionConfig) -> Self:
        """Return the limits with which a robot's motion is planned, as those of its drive."""
        backwards, forwards = motion.linear_limits_mps
        return cls(
            (backwards * motion.speed_factor, forwards * motion.speed_factor),
            motion.angular_limit_radps * motion.speed_factor,
            motion.linear_acceleration_mps2,
            motion.angular_acceleration_radps2,
            motion.lateral_limit_mps * motion.speed_factor,
        )

    def clipped(self, linear_mps: float, angular_radps: float) -> tuple[float, float]:
        """Return the nearest command within the velocity limits."""
        backwards, forwards = self.linear_mps
        return (
            min(max(linear_mps, backwards), forwards),
            min(max(angular_radps, -self.angular_radps), self.angular_radps),
        )

    def braking_s(self, state: State) -> float:
        """Return how long it takes to come to rest."""
        return max(
            abs(state.linear_mps) / self.linear_acceleration_mps2,
            abs(state.lateral_mps) / self.linear_acceleration_mps2,
            abs(state.angular_radps) / self.angular_acceleration_radps2,
        )

    def reach_m(self, state: State, linear_mps: float, duration_s: float, lateral_mps: float = 0.0) -> float:
        """Return the longest way that a command held for a while, and then braking, can lead."""
        # Along each axis the way is at most this; together at most their sum.
        fastest_mps = max(abs(state.linear_mps), abs(linear_mps)) + max(abs(state.lateral_mps), abs(lateral_mps))
        return fastest_mps * duration_s + fastest_mps**2 / (2 * self.linear_acceleration_mps2)


def drive(
    state: State,
    linear_mps: float,
    angular_radps: float,
    duration_s: float,
    limits: DriveLimits,
    lateral_mps: float = 0.0,
) -> Iterator[State]:
    """Yield the states on the way of one command, at most 1 cm and 1 degree apart, the last one at its end.

    The velocities ramp towards the command with the limits' accelerations; way and turn are their exact integrals.
    """
    linear_mps, angular_radps = limits.clipped(linear_mps, angular_radps)
    lateral_mps = min(max(lateral_mps, -limits.lateral_mps), limits.lateral_mps)
    fastest_mps = math.hypot(max(abs(state.linear_mps), abs(linear_mps)), max(abs(state.lateral_mps), abs(lateral_mps)))
    fastest_radps = max(abs(state.angular_radps), abs(angular_radps))
    count = math.ceil(
        max(
            1.0,
            fastest_mps * duration_s / LONGEST_SUBSTEP_M,
            fastest_radps * duration_s / WIDEST_SUBSTEP_RAD,
        )
    )
    start, way_m, side_m, turned_rad = state, 0.0, 0.0, 0.0
    for index in range(1, count + 1):
        elapsed_s = duration_s * (index / count)
        linear, way_so_far_m = _ramp(start.linear_mps, linear_mps, limits.linear_acceleration_mps2, elapsed_s)
        angular, turned_so_far_rad = _ramp(
            start.angular_radps, angular_radps, limits.angular_acceleration_radps2, elapsed_s
        )
        lateral, side_so_far_m = _ramp(start.lateral_mps, lateral_mps, limits.linear_acceleration_mps2, elapsed_s)
        x, y, yaw_rad = along_arc(
            (state.x, state.y, state.yaw_rad),
            way_so_far_m - way_m,
            turned_so_far_rad - turned_rad,
            side_so_far_m - side_m,
        )
        way_m, side_m, turned_rad = way_so_far_m, side_so_far_m, turned_so_far_rad
        state = State(x, y, yaw_rad, linear, angular, lateral)
        yield state


def drive_and_brake(
    state: State,
    linear_mps: float,
    angular_radps: float,
    duration_s: float,
    limits: DriveLimits,
    lateral_mps: float = 0.0,
) -> Iterator[State]:
    """Yield the states on the way of one command and of the braking to rest that follows it."""
    for ahead in drive(state, linear_mps, angular_radps, duration_s, limits, lateral_mps):
        state = ahead
        yield state
    yield from drive(state, 0.0, 0.0, limits.braking_s(state), limits)


def along_arc(
    pose: tuple[float, float, float], way_m: float, turn_rad: float, side_m: float = 0.0
) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) at the end of an arc of constant curvature, `side_m` of it to the base's left."""
    x, y, yaw_rad = pose
    half_rad = turn_rad / 2
    # The chord of an arc is its length times sin(h) / h, at half the turn from the heading.
    share = math.sin(half_rad) / half_rad if abs(half_rad) > 1e-6 else 1.0
    chord_m, beside_m = way_m * share, side_m * share
    cos, sin = math.cos(yaw_rad + half_rad), math.sin(yaw_rad + half_rad)
    return (
        x + chord_m * cos - beside_m * sin,
        y + chord_m * sin + beside_m * cos,
        yaw_rad + turn_rad,
    )


def _ramp(start: float, target: float, acceleration: float, elapsed_s: float) -> tuple[float, float]:
    """Return the velocity after a while of ramping from `start` to `target`, and its integral."""
    ramp_s = abs(target - start) / acceleration
    if elapsed_s >= ramp_s:
        return target, (start + target) / 2 * ramp_s + target * (elapsed_s - ramp_s)
    velocity = start + math.copysign(acceleration * elapsed_s, target - start)
    return velocity, (start + velocity) / 2 * elapsed_s
