"""Velocities on their topic: the messages, and who does not listen to them and why."""

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot_robot_ros2.ros import running_node
from plugins.robot_ros2.tests.guard import guarded
from plugins.robot_ros2.tests.guard.guarded import Base, Driving, declaration


def test_a_robot_that_does_not_listen_is_an_error(domain: int) -> None:
    with (
        pytest.raises(BenchbotError, match="does not listen") as caught,
        guarded.guarded(declaration(timing={"wait_s": 0.5})),
    ):
        pass
    assert "no node subscribed to /cmd_vel" in caught.value.why
    assert caught.value.failure is FailureClass.PLATFORM
    assert not caught.value.ends_run


def test_a_base_that_expects_another_type_is_named(domain: int) -> None:
    from geometry_msgs.msg import TwistStamped

    with running_node("stamped_base") as node:
        Base(node, TwistStamped)
        with (
            pytest.raises(BenchbotError, match="does not listen") as caught,
            guarded.guarded(declaration(timing={"wait_s": 4.0})),
        ):
            pass
    assert "/stamped_base expects geometry_msgs/msg/TwistStamped" in caught.value.why


def test_a_base_that_asks_for_other_quality_of_service_is_named(domain: int) -> None:
    from geometry_msgs.msg import Twist
    from rclpy.qos import DurabilityPolicy

    with running_node("demanding_base") as node:
        Base(node, Twist, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        with (
            pytest.raises(BenchbotError, match="does not listen") as caught,
            guarded.guarded(declaration(timing={"wait_s": 4.0})),
        ):
            pass
        assert "/demanding_base asks for reliable, transient_local" in caught.value.why
        with guarded.guarded(declaration(command={"qos": {"durability": "transient_local"}})) as guard:
            assert guard.tripped is None


def test_stamped_velocities_carry_time_and_frame(domain: int) -> None:
    from geometry_msgs.msg import TwistStamped

    with running_node("base") as node:
        base = Base(node, TwistStamped)
        robot = declaration(command={"ros_type": "geometry_msgs/msg/TwistStamped"})
        with guarded.guarded(robot) as guard, Driving(guard):
            base.until_moving()
        newest = base.messages[-1].header
        assert newest.frame_id == "base_link"
        now_s = node.get_clock().now().nanoseconds / 1e9
        assert newest.stamp.sec == pytest.approx(now_s, abs=guarded.DEADLINE_S)
