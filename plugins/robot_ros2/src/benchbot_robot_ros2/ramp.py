"""Velocity commands within a robot's limits: clipped to its speeds, and approached with its accelerations."""

from typing import NamedTuple

from benchbot.plugin import MotionConfig


class Velocity(NamedTuple):
    """A velocity of the base: m/s along its +x, rad/s about its +z, m/s along its +y if it is holonomic (REP-103)."""

    linear_mps: float
    angular_radps: float
    lateral_mps: float = 0.0


REST = Velocity(0.0, 0.0)


def clipped(wanted: Velocity, motion: MotionConfig) -> Velocity:
    """Return the nearest velocity within the robot's speeds."""
    backwards_mps, forwards_mps = motion.linear_limits_mps
    limit_radps = motion.angular_limit_radps * motion.speed_factor
    lateral_limit_mps = motion.lateral_limit_mps * motion.speed_factor
    return Velocity(
        min(max(wanted.linear_mps, backwards_mps * motion.speed_factor), forwards_mps * motion.speed_factor),
        min(max(wanted.angular_radps, -limit_radps), limit_radps),
        min(max(wanted.lateral_mps, -lateral_limit_mps), lateral_limit_mps),
    )


def ramped(current: Velocity, wanted: Velocity, elapsed_s: float, motion: MotionConfig) -> Velocity:
    """Return the velocity after a while of approaching `wanted`, each part with its own acceleration."""
    return Velocity(
        _towards(current.linear_mps, wanted.linear_mps, motion.linear_acceleration_mps2 * elapsed_s),
        _towards(current.angular_radps, wanted.angular_radps, motion.angular_acceleration_radps2 * elapsed_s),
        _towards(current.lateral_mps, wanted.lateral_mps, motion.linear_acceleration_mps2 * elapsed_s),
    )


def _towards(current: float, wanted: float, step: float) -> float:
    # Exactly what is wanted when it is in reach, so that a robot at rest is at 0 and not at 1e-17.
    return wanted if abs(wanted - current) <= step else current + (step if wanted > current else -step)
