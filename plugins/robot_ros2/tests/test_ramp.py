"""Velocities stay within the robot's limits and change as its accelerations allow."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.motion import MotionConfig
from benchbot_robot_ros2.ramp import REST, Velocity, clipped, ramped

MOTION = MotionConfig(
    linear_limits_mps=(-0.6, 1.5),
    lateral_limit_mps=0.5,
    angular_limit_radps=1.0,
    linear_acceleration_mps2=2.0,
    angular_acceleration_radps2=3.0,
)
velocities = st.builds(Velocity, st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5))
within_limits = st.builds(Velocity, st.floats(-0.6, 1.5), st.floats(-1, 1), st.floats(-0.5, 0.5))


@pytest.mark.parametrize(
    ("wanted", "allowed"),
    [
        *(((9, 0), (1.5, 0)), ((-9, 0), (-0.6, 0)), ((0, 9), (0, 1)), ((0, -9), (0, -1)), ((0.5, 0.5), (0.5, 0.5))),
        *(((0, 0, 9), (0, 0, 0.5)), ((0, 0, -9), (0, 0, -0.5)), ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))),
    ],
)
def test_commands_are_clipped(wanted: tuple[float, ...], allowed: tuple[float, ...]) -> None:
    assert clipped(Velocity(*wanted), MOTION) == Velocity(*allowed)


def test_the_speed_factor_scales_the_limits() -> None:
    half = MotionConfig(speed_factor=0.5, lateral_limit_mps=0.4)
    assert clipped(Velocity(9, 9, 9), half) == (0.75, 0.5, 0.2)


def test_a_base_that_is_not_holonomic_is_not_told_to_go_sideways() -> None:
    assert clipped(Velocity(0.1, 0.2, 0.3), MotionConfig()) == (0.1, 0.2, 0.0)


@given(within_limits, velocities, st.floats(0, 1))
def test_accelerations_are_kept(current: Velocity, wanted: Velocity, elapsed_s: float) -> None:
    after = ramped(current, clipped(wanted, MOTION), elapsed_s, MOTION)
    assert abs(after.linear_mps - current.linear_mps) <= 2.0 * elapsed_s + 1e-9
    assert abs(after.angular_radps - current.angular_radps) <= 3.0 * elapsed_s + 1e-9
    assert abs(after.lateral_mps - current.lateral_mps) <= 2.0 * elapsed_s + 1e-9
    assert -0.6 <= after.linear_mps <= 1.5
    assert abs(after.angular_radps) <= 1.0
    assert abs(after.lateral_mps) <= 0.5


@given(within_limits)
def test_a_robot_comes_to_rest_exactly_and_as_fast_as_it_can(velocity: Velocity) -> None:
    steps = 0
    while velocity != REST:
        velocity, steps = ramped(velocity, REST, 0.02, MOTION), steps + 1
        assert steps <= math.ceil(1.5 / 2.0 / 0.02) + 1
