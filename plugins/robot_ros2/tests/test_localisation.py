import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry

from benchbot.core.geometry import Pose
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Topic
from benchbot_robot_ros2.localisation import Localisation, base_pose, between
from benchbot_robot_ros2.messages import pose_message, set_stamp
from benchbot_robot_ros2.robot_clock import RobotClock
from benchbot_robot_ros2.streams import Stream
from plugins.robot_ros2.tests.unicycle import declaration, until

Tell = Callable[[float, Pose], None]


class Listening:
    """Two streams of poses, and what publishes them."""

    def __init__(self, robot: Any, node: Any) -> None:
        changed = threading.Condition()
        clock = RobotClock(node, simulated=False, changed=changed)

        def connect(topic: str, kind: type, ros_type: str) -> tuple[Stream, Tell]:
            publisher = robot.create_publisher(kind, topic, 10)
            stream = Stream(node, Topic(ros_topic=topic, ros_type=ros_type), clock, changed)

            def tell(stamp_s: float, pose: Pose) -> None:
                message = kind()
                set_stamp(message, round(stamp_s * 1e9))
                message.pose.pose = pose_message(pose)

                def arrived() -> bool:
                    publisher.publish(message)
                    return stream.newest is not None and stream.newest.stamp_ns == round(stamp_s * 1e9)

                until(arrived)

            return stream, tell

        self.odometry, self.tell_odometry = connect("/odom", Odometry, "nav_msgs/msg/Odometry")
        self.place, self.tell_place = connect(
            "/amcl_pose", PoseWithCovarianceStamped, "geometry_msgs/msg/PoseWithCovarianceStamped"
        )


@pytest.fixture
def listening(domain: int) -> Iterator[Listening]:
    with ros.running_node("robot") as robot, ros.running_node("listener") as node:
        yield Listening(robot, node)


@pytest.fixture
def robot() -> Ros2Robot:
    return Ros2Robot.from_declaration(declaration())


def _close(pose: Pose, x: float, y: float, yaw_deg: float) -> None:
    assert pose.translation_xyz == pytest.approx((x, y, 0.0), abs=1e-9)
    assert math.degrees(pose.yaw_rad) == pytest.approx(yaw_deg, abs=1e-6)


def test_dead_reckoning_starts_where_the_scene_does(listening: Listening, robot: Ros2Robot) -> None:
    localisation = Localisation(robot, listening.odometry)
    listening.tell_odometry(1.0, Pose.planar(7.0, 7.0, math.pi / 2))
    localisation.start(Pose.planar(2.0, 1.0, 0.0))
    _close(localisation.pose(), 2.0, 1.0, 0.0)

    listening.tell_odometry(1.1, Pose.planar(7.0, 7.5, math.pi))

    _close(localisation.odometry(), 2.5, 1.0, 90.0)
    _close(localisation.pose(), 2.5, 1.0, 90.0)


def test_a_place_that_comes_late_corrects_odometry(listening: Listening, robot: Ros2Robot) -> None:
    localisation = Localisation(robot, listening.odometry, listening.place)
    listening.tell_odometry(1.0, Pose.planar(0.0, 0.0, 0.0))
    localisation.start(Pose())
    listening.tell_odometry(1.2, Pose.planar(0.2, 0.0, 0.0))
    # Of the moment when odometry said 0.1.
    listening.tell_place(1.1, Pose.planar(5.0, 5.0, math.pi / 2))

    _close(localisation.pose(), 5.0, 5.1, 90.0)
    _close(localisation.odometry(), 0.2, 0.0, 0.0)

    listening.tell_odometry(1.3, Pose.planar(0.3, 0.0, 0.0))
    _close(localisation.pose(), 5.0, 5.2, 90.0)
    _close(localisation.way(1_250_000_000), 0.05, 0.0, 0.0)


def test_it_is_lost_in_words_when_a_pose_is_none(listening: Listening, robot: Ros2Robot) -> None:
    localisation = Localisation(robot, listening.odometry)
    listening.tell_odometry(1.0, Pose((math.nan, 0.0, 0.0)))

    with pytest.raises(ValueError, match="is no pose"):
        localisation.odometry()


angles = st.floats(-math.pi, math.pi)


@given(angles, st.floats(-0.5, 0.5), st.floats(0.0, 1.0))
def test_between_two_near_poses_the_way_is_even(yaw_rad: float, turned_rad: float, share: float) -> None:
    first = Pose.planar(1.0, 2.0, yaw_rad)
    second = first @ Pose.planar(0.2, 0.0, turned_rad)

    found = first.inverse() @ between(first, second, share)

    assert found.translation_xyz[0] == pytest.approx(0.2 * share, abs=1e-9)
    assert found.yaw_rad == pytest.approx(share * turned_rad, abs=0.005)


def test_poses_are_found_in_every_message_that_has_one() -> None:
    message = Odometry()
    message.pose.pose = pose_message(Pose.planar(1.0, 2.0, 0.5))
    assert base_pose(message).translation_xyz == (1.0, 2.0, 0.0)
