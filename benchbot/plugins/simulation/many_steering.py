"""The steering of many robots as arrays: which velocities lead to where each is to go, and how far it is off.

As `benchbot.core.motion` has it for one robot, in the same order of operations.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from benchbot.core import motion
from benchbot.plugin import MotionConfig
from benchbot.plugins.simulation import contact, dynamics
from benchbot.plugins.simulation.dynamics import DriveLimits
from benchbot.plugins.simulation.poses import Floats, Indices, Mask, Trigonometry

BENT_RAD = 1e-6
"""A turn by less than twice this is as good as straight."""


@dataclass(frozen=True)
class ActionNumbers:
    """All numbers that the course of an action depends on besides the robot's state: SI units, and shares."""

    period_s: float
    period_s2: float
    backwards_mps: float
    forwards_mps: float
    turning_radps: float
    planned_mps2: float
    planned_radps2: float
    position_tolerance_m: float
    angle_tolerance_rad: float
    phase_timeout_s: float
    drive_backwards_mps: float
    drive_forwards_mps: float
    drive_radps: float
    drive_mps2: float
    drive_radps2: float
    radius_m: float
    longest_substep_m: float = dynamics.LONGEST_SUBSTEP_M
    widest_substep_rad: float = dynamics.WIDEST_SUBSTEP_RAD
    fine_share: float = motion.FINE_SHARE
    rest_mps: float = motion.REST_MPS
    rest_radps: float = motion.REST_RADPS
    rest_timeout_s: float = motion.REST_TIMEOUT_S
    contact_tolerance_m: float = contact.CONTACT_TOLERANCE_M
    bent_rad: float = BENT_RAD
    pi: float = math.pi
    two_pi: float = 2 * math.pi
    k_heading: float = motion.K_HEADING
    k_lateral: float = motion.K_LATERAL

    @classmethod
    def of(cls, config: MotionConfig, limits: DriveLimits, radius_m: float, period_s: float) -> "ActionNumbers":
        """Return those of a robot's declaration."""
        backwards_mps, forwards_mps = (limit * config.speed_factor for limit in config.linear_limits_mps)
        return cls(
            period_s,
            period_s**2,
            backwards_mps,
            forwards_mps,
            config.angular_limit_radps * config.speed_factor,
            motion.PLANNED_SHARE * config.linear_acceleration_mps2,
            motion.PLANNED_SHARE * config.angular_acceleration_radps2,
            config.position_tolerance_m,
            config.angle_tolerance_rad,
            config.phase_timeout_s,
            *limits.linear_mps,
            limits.angular_radps,
            limits.linear_acceleration_mps2,
            limits.angular_acceleration_radps2,
            radius_m,
        )


@dataclass(frozen=True)
class Believed:
    """Poses as `Pose.planar` has them: places, and quaternions about the z axis."""

    x: Floats
    y: Floats
    sin: Floats
    cos: Floats
    yaw_rad: Floats


def believed(place: tuple[Floats, Floats, Floats], by: Trigonometry) -> Believed:
    """Return poses that are told as x, y and yaw."""
    x, y, heading_rad = place
    sin, cos = by.sin(heading_rad / 2), by.cos(heading_rad / 2)
    return Believed(x, y, sin, cos, by.atan2(2 * (cos * sin), 1 - 2 * (sin * sin)))


@dataclass
class Steering:
    """As `motion._straight` where `straight`, else as `motion._turn` by `angles_rad`, from the poses `begun`."""

    config: MotionConfig
    period_s: float
    by: Trigonometry
    straight: Mask
    begun: Believed
    distances_m: Floats
    angles_rad: Floats

    def __post_init__(self) -> None:
        self._turned_rad, self._last_yaw_rad = np.zeros(len(self.straight)), self.begun.yaw_rad.copy()

    def __call__(self, now: Believed, lanes: Indices) -> tuple[Floats, Floats, Floats]:
        """Return errors in units of tolerances and the commands, all (L,), of robots that are now there (L,)."""
        config = self.config
        straight = self.straight[lanes]
        error, linear_mps, angular_radps = np.zeros((3, len(lanes)))
        on_line, on_spot = np.flatnonzero(straight), np.flatnonzero(~straight)
        if len(on_line):
            error[on_line], linear_mps[on_line], angular_radps[on_line] = self._drive(
                lanes[on_line], Believed(*(getattr(now, each.name)[on_line] for each in fields(now)))
            )
        if len(on_spot):
            turning = lanes[on_spot]
            self._turned_rad[turning] += wrapped(now.yaw_rad[on_spot] - self._last_yaw_rad[turning])
            self._last_yaw_rad[turning] = now.yaw_rad[on_spot]
            remaining_rad = self.angles_rad[turning] - self._turned_rad[turning]
            error[on_spot] = abs(remaining_rad) / config.angle_tolerance_rad
            fastest_radps = _braking_speed(abs(remaining_rad), config.angular_acceleration_radps2, self.period_s)
            limit_radps = config.angular_limit_radps * config.speed_factor
            angular_radps[on_spot] = np.copysign(np.minimum(fastest_radps, limit_radps), remaining_rad)
        return error, linear_mps, angular_radps

    def _drive(self, lanes: Indices, now: Believed) -> tuple[Floats, Floats, Floats]:
        begun, config, by = self.begun, self.config, self.by
        back_sin, back_cos = -begun.sin[lanes], begun.cos[lanes]
        start_x, start_y = _rotated(back_sin, back_cos, begun.x[lanes], begun.y[lanes])
        x, y = _rotated(back_sin, back_cos, now.x, now.y)
        along_m, lateral_m = -start_x + x, -start_y + y
        sin, cos = back_cos * now.sin + back_sin * now.cos, back_cos * now.cos - back_sin * now.sin
        yaw_rad = by.atan2(2 * (cos * sin), 1 - 2 * (sin * sin))
        remaining_m = self.distances_m[lanes] - along_m
        backwards_mps, forwards_mps = (limit * config.speed_factor for limit in config.linear_limits_mps)
        speed_mps = _braking_speed(abs(remaining_m), config.linear_acceleration_mps2, self.period_s)
        linear_mps = np.where(
            remaining_m >= 0, np.minimum(speed_mps, forwards_mps), np.maximum(-speed_mps, backwards_mps)
        )
        angular_radps = -motion.K_HEADING * abs(linear_mps) * yaw_rad - motion.K_LATERAL * linear_mps * lateral_m
        limit_radps = config.angular_limit_radps * config.speed_factor
        return (
            abs(remaining_m) / config.position_tolerance_m,
            linear_mps,
            np.maximum(-limit_radps, np.minimum(limit_radps, angular_radps)),
        )


def wrapped(angle_rad: Floats) -> Floats:
    """Return angles within [-pi, pi)."""
    wrapped: Floats = (angle_rad + math.pi) % (2 * math.pi) - math.pi
    return wrapped


def _rotated(sin: Floats, cos: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return x and y turned about the z axis, in the order of operations of `Pose`; sine and cosine of half angles."""
    cross_x, cross_y = -(sin * y) + cos * x, sin * x + cos * y
    return x + 2 * -(sin * cross_y), y + 2 * (sin * cross_x)


def _braking_speed(remaining: Floats, acceleration: float, period_s: float) -> Floats:
    planned = motion.PLANNED_SHARE * acceleration
    speed: Floats = planned * (np.sqrt(period_s**2 + 2 * remaining / planned) - period_s)
    return speed
