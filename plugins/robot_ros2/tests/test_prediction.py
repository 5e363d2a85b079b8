import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry

from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig
from benchbot_robot_ros2.prediction import LONGEST_DEAD_TIME_S, Prediction
from benchbot_robot_ros2.ramp import REST, Velocity, ramped
from benchbot_robot_ros2.standstill import REST_S, rested
from benchbot_robot_ros2.streams import Sample

MOTION = MotionConfig()
TICK_S = 0.01


def _sample(arrived_s: float, velocity: Velocity) -> Sample:
    message = Odometry()
    message.twist.twist.linear.x, message.twist.twist.angular.z, message.twist.twist.linear.y = velocity
    return Sample(round(arrived_s * 1e9), 0, arrived_s, message)


def _driven(
    prediction: Prediction, dead_time_s: float, command: Velocity, until_s: float, motion: MotionConfig = MOTION
) -> tuple[list[Sample], Pose]:
    """Drive an ideal base whose odometry comes late; return that and the way that it does not show yet."""
    prediction.note(command, 0.0)
    velocity, pose, states = REST, Pose(), []
    for number in range(round(until_s / TICK_S)):
        velocity = ramped(velocity, command, TICK_S, motion)
        turned = velocity.angular_radps * TICK_S
        way, side = velocity.linear_mps * TICK_S, velocity.lateral_mps * TICK_S
        cos, sin = math.cos(turned / 2), math.sin(turned / 2)
        pose = pose @ Pose.planar(way * cos - side * sin, way * sin + side * cos, turned)
        states.append(((number + 1) * TICK_S, velocity, pose))
    samples = [_sample(time_s + dead_time_s, seen) for time_s, seen, _ in states if time_s + dead_time_s <= until_s]
    shown = states[len(samples) - 1][2] if samples else Pose()
    return samples, shown.inverse() @ pose


def test_late_odometry_is_carried_on_to_where_the_base_is() -> None:
    prediction = Prediction(MOTION)
    samples, unseen = _driven(prediction, 0.2, Velocity(0.4, 0.5), 1.5)

    ahead, velocity = prediction.carry_on(samples, 1.5)

    assert prediction.dead_time_s == pytest.approx(0.2, abs=0.03)
    assert ahead.translation_xyz == pytest.approx(unseen.translation_xyz, abs=0.01)
    assert ahead.yaw_rad == pytest.approx(unseen.yaw_rad, abs=0.02)
    assert velocity == pytest.approx((0.4, 0.5, 0.0))


def test_a_base_at_rest_is_where_its_odometry_says() -> None:
    prediction = Prediction(MOTION)
    samples, _ = _driven(prediction, 0.1, Velocity(0.4, 0.0), 1.0)
    prediction.note(REST, 1.0)
    noise = [_sample(3.0, Velocity(0.004, -0.01))]

    assert prediction.carry_on([*samples, *noise], 3.05) == (Pose(), REST)
    assert prediction.carry_on([], 3.05) == (Pose(), REST)


@pytest.mark.parametrize("speed_mps", [0.02, -0.02])
def test_a_start_that_is_hardly_one_is_not_measured(speed_mps: float) -> None:
    prediction = Prediction(MOTION)
    prediction.note(Velocity(speed_mps, 0.0), 0.0)
    prediction.carry_on([_sample(0.4, Velocity(speed_mps, 0.0))], 0.4)

    assert prediction.dead_time_s == 0.0


@given(st.floats(0.0, 5.0), st.floats(-0.6, 1.5), st.floats(-1.0, 1.0))
@example(5e-324, 0.5, 0.0)
def test_what_is_carried_on_is_bounded(late_s: float, linear_mps: float, angular_radps: float) -> None:
    prediction = Prediction(MOTION)
    prediction.note(Velocity(linear_mps, angular_radps), 0.0)
    samples = [_sample(late_s, Velocity(linear_mps, angular_radps))]

    ahead, velocity = prediction.carry_on(samples, late_s)

    assert prediction.dead_time_s <= LONGEST_DEAD_TIME_S
    assert math.hypot(*ahead.translation_xyz) <= 1.5 * LONGEST_DEAD_TIME_S + 1e-6
    assert abs(velocity.angular_radps) <= 1.0


def test_rest_is_standing_still_for_a_while() -> None:
    still, moving = Velocity(0.001, 0.0), Velocity(0.2, 0.0)
    braking = [_sample(1.0, moving), _sample(1.05, moving), _sample(1.1, still)]

    assert not rested(braking, 0.9)
    assert not rested([], 0.9)
    assert rested([*braking, _sample(1.05 + REST_S, still)], 0.9)
    assert not rested([_sample(1.0, still), _sample(1.5, still)], 1.45)


@pytest.mark.parametrize("lateral_mps", [0.3, -0.3])
def test_a_base_that_is_pushed_aside_is_neither_at_rest_nor_where_it_was(lateral_mps: float) -> None:
    pushed = _sample(1.0, REST)
    pushed.message.twist.twist.linear.y = lateral_mps
    assert not rested([_sample(0.0, REST), pushed], 0.0)

    ahead, _ = Prediction(MOTION).carry_on([pushed], 1.2)
    assert ahead.translation_xyz == pytest.approx((0.0, 0.2 * lateral_mps, 0.0))


@pytest.mark.parametrize("lateral_mps", [0.4, -0.4])
def test_a_base_that_drives_sideways_is_carried_on_to_where_it_is(lateral_mps: float) -> None:
    holonomic = MotionConfig(lateral_limit_mps=0.5)
    prediction = Prediction(holonomic)
    samples, hidden = _driven(prediction, 0.2, Velocity(0.0, 0.3, lateral_mps), 1.0, holonomic)

    ahead, velocity = prediction.carry_on(samples, 1.0)
    assert prediction.dead_time_s == pytest.approx(0.2, abs=0.03)
    assert ahead.translation_xyz == pytest.approx(hidden.translation_xyz, abs=0.02)
    assert ahead.yaw_rad == pytest.approx(hidden.yaw_rad, abs=0.02)
    assert velocity == pytest.approx((0.0, 0.3, lateral_mps))


def test_a_base_that_another_drives_leaves_the_measured_dead_time_as_it_is() -> None:
    prediction = Prediction(MOTION)
    samples, _ = _driven(prediction, 0.2, Velocity(0.4, 0.0), 1.5)
    prediction.carry_on(samples, 1.5)
    measured_s = prediction.dead_time_s
    prediction.note(REST, 1.5)

    prediction.note(Velocity(0.3, 0.0), 5.0, is_seen=True)
    prediction.carry_on([_sample(5.01, Velocity(0.3, 0.0))], 5.02)

    assert prediction.dead_time_s == measured_s > 0.1
