"""A bridged robot over real DDS: it moves, stops, tells the truth about itself and goes where it is told."""

import math
import operator
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

from benchbot.core.channels import FramePose
from benchbot.core.geometry import Pose
from benchbot_robot_ros2 import transforms
from benchbot_robot_ros2.bridge.robot import topics
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import pose_of
from plugins.robot_ros2.tests.bridge.bridged import SAMPLE, Listener, bridge, listener, simulator, time_of, until
from plugins.robot_ros2.tests.conftest import _free_domain

pytestmark = pytest.mark.xdist_group("robots 1")

ODOMETRY, TRUTH = ("/odom", "nav_msgs/msg/Odometry"), ("/ground_truth/odom", "nav_msgs/msg/Odometry")
COLLISION, CLOCK = ("/collision", "std_msgs/msg/Bool"), ("/clock", "rosgraph_msgs/msg/Clock")
SCAN = ("/scan", "sensor_msgs/msg/LaserScan")
START = Pose.planar(-2.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def robot() -> Iterator[Listener]:
    """The sample robot in the arena, listened to from another process; every test begins with a reset."""
    with pytest.MonkeyPatch.context() as patch, _free_domain() as (number, _):
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        with bridge(*SAMPLE, "--camera-rate-hz", "20", "--laser-rate-hz", "20"), listener() as listening:
            yield listening


@pytest.fixture(autouse=True)
def _at_the_start(robot: Listener) -> None:
    assert robot.reset().success


def velocity(message: Any) -> tuple[float, float]:
    twist = message.twist.twist
    return (twist.linear.x, twist.angular.z)


def test_one_command_holds_for_a_moment_then_the_robot_brakes_by_itself(robot: Listener) -> None:
    go, odometry = robot.velocities(), robot.hear(*TRUTH)

    def moved_and_rests() -> bool:
        return any(velocity(m)[0] for m in odometry) and not velocity(odometry[-1])[0]

    def obeys() -> bool:
        """One command, and a while for it; on a busy machine a lone message may get lost, there or back."""
        odometry.clear()
        go(0.1)
        deadline_s = time.monotonic() + 2.0
        while time.monotonic() < deadline_s and not moved_and_rests():
            time.sleep(0.005)
        return moved_and_rests()

    until(obeys, "it moves and rests")
    moving = [m for m in odometry if velocity(m)[0]]
    # Three ticks of 0.05 s obey; the fourth brakes with 2 m/s², and ends at rest.
    assert time_of(moving[-1]) - time_of(moving[0]) <= 0.15e9
    assert max(velocity(m)[0] for m in moving) == pytest.approx(0.1)
    assert robot.truth().translation_xyz[0] > START.translation_xyz[0] + 0.01


def test_what_is_no_number_is_no_command(robot: Listener) -> None:
    go, odometry = robot.velocities(), robot.hear(*ODOMETRY)
    go(math.nan)
    go(0.1, math.inf)
    last = time_of(odometry[-1])
    until(lambda: time_of(odometry[-1]) > last + 3e8, "time passes")

    assert not any(any(velocity(m)) for m in odometry if time_of(m) > last)
    assert robot.truth() == START


def test_steady_commands_drive_until_contact_which_is_remembered_until_the_next_reset(robot: Listener) -> None:
    go, collision = robot.velocities(), robot.hear(*COLLISION)
    assert robot.place(2.5, 0.0, 0.0).success
    until(lambda: not collision[-1].data, "nothing is touched")

    def driven_into_the_wall() -> bool:
        robot.newer(*ODOMETRY)
        go(0.5)
        return bool(collision[-1].data)

    until(driven_into_the_wall, "the wall is touched")
    truth = robot.newer(*TRUTH)
    assert truth.pose.pose.position.x == pytest.approx(2.8, abs=1e-3)
    collision.clear()
    until(lambda: len(collision) > 5, "time passes")
    assert all(message.data for message in collision)

    assert robot.reset().success
    until(lambda: not collision[-1].data, "the contact is forgotten")


def test_a_reset_begins_anew_but_for_the_time(robot: Listener) -> None:
    go, clock = robot.velocities(), robot.hear(*CLOCK)
    stamps = {name: robot.hear(name, kind) for name, kind in (ODOMETRY, TRUTH, SCAN)}
    for _ in range(2):
        until(lambda: go(0.3, 0.5) or robot.truth().translation_xyz[0] > -1.9, "the robot moves")
        assert robot.odometry() != Pose()
        answer = robot.reset()
        assert (answer.success, answer.message) == (True, "sample_robot is at the start of arena:1.")
        assert robot.truth() == START
        assert robot.odometry() == Pose()

    for messages in (clock, *stamps.values()):
        times = [time_of(message) for message in messages]
        assert times == sorted(times)
        assert len(set(times)) == len(times)
    assert time_of(stamps["/odom"][-1]) % 50_000_000 == 0


def test_odometry_starts_at_the_start_and_truth_is_in_the_map(robot: Listener) -> None:
    odometry, truth = robot.newer(*ODOMETRY), robot.newer(*TRUTH)

    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")
    assert (truth.header.frame_id, truth.child_frame_id) == ("map", "base_link")
    assert (pose_of(odometry.pose.pose), pose_of(truth.pose.pose)) == (Pose(), START)


def test_a_placed_robot_sees_from_there_but_its_wheels_did_not_notice(robot: Listener) -> None:
    answer = robot.place(0.3, 0.2, 0.4)
    assert (answer.success, answer.message) == (True, "sample_robot is at (0.3, 0.2) m, heading 22.9183 degrees.")

    truth = robot.truth()
    assert truth.translation_xyz == (0.3, 0.2, 0.0)
    assert truth.yaw_rad == pytest.approx(0.4)
    assert robot.odometry() == Pose()


def test_pictures_and_scans_are_what_the_simulator_observes_there(robot: Listener) -> None:
    assert robot.place(0.3, 0.2, 0.4).success
    truth = robot.newer(*TRUTH)
    now, platform = time_of(truth), simulator("arena:1")
    platform.place(pose_of(truth.pose.pose))

    channels = [name for name in platform_channels() if name.startswith("image_")]
    for channel, value in platform.observe(channels).items():
        parts = topics(channel)
        heard = {part: robot.hear(topic.ros_topic, topic.ros_type) for part, topic in parts.items()}
        stamped = parts.get("class_segment_img") or parts[""]
        stamp = time_of(robot.newer(stamped.ros_topic, stamped.ros_type, now))
        expected = encode(channel, value, stamp_ns=stamp, frame_id="camera")
        for part, message in expected.items():
            until(partial(operator.contains, heard[part], message), f"{channel} {part}")

    scan = robot.newer(*SCAN, now)
    observed = platform.observe(["laser"])["laser"]
    ranges_m, angles_rad = observed["scans"].T
    assert scan.header.frame_id == "lidar"
    assert np.allclose(scan.ranges, ranges_m, atol=1e-5)
    assert np.allclose(scan.angle_min + scan.angle_increment * np.arange(len(ranges_m)), angles_rad, atol=1e-5)
    assert (scan.range_min, scan.range_max) == pytest.approx((observed["range_min"], observed["range_max"]))


def platform_channels() -> list[str]:
    from benchbot.core import plugin_manager
    from benchbot.core.declarations.catalog import Catalog

    return list(Catalog(plugin_manager.load()).get("robots", "sample_robot").data["connections"])


def test_parameters_say_where_a_reset_leads(robot: Listener) -> None:
    class_ids = robot.hear("/camera/segmentation/class_ids", "std_msgs/msg/String")
    start = Pose.planar(1.0, 0.5, math.pi / 2)
    _, _, z, w = start.rotation_xyzw

    answer = robot.reset(environment="arena:2", seed=3, start_pose=[w, 0.0, 0.0, z, 1.0, 0.5, 0.0])

    assert (answer.success, answer.message) == (True, "sample_robot is at the start of arena:2.")
    truth = robot.truth()
    assert truth.translation_xyz == start.translation_xyz
    assert truth.yaw_rad == pytest.approx(start.yaw_rad)
    assert robot.odometry() == Pose()
    class_ids.clear()
    until(lambda: class_ids, "a picture of the other scene")
    assert class_ids[-1].data == '{"chair":2,"person":3}'


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"environment": "arena:7"}, "'arena:7' is not a known environment."),
        ({"environment": "arena:1:2"}, "names 2 scenes"),
        ({"environment": "faulty:load"}, "does not load"),
        ({"environment": 7}, "The parameter environment is wrong."),
        ({"seed": -1}, "The parameter seed is wrong."),
        ({"seed": "many"}, "The parameter seed is wrong."),
        ({"start_pose": [1.0, 0.0]}, "The parameter start_pose is wrong."),
        ({"start_pose": [0.0] * 7}, "quaternion that is not zero"),
        ({"start_pose": "here"}, "The parameter start_pose is wrong."),
    ],
)
def test_a_reset_that_cannot_be_is_explained_and_the_robot_lives_on(
    robot: Listener, wrong: dict[str, Any], words: str
) -> None:
    answer = robot.reset(**wrong)

    assert not answer.success
    assert words in answer.message
    assert robot.truth() == START


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        ([-1.0, -1.0, 0.0], "The robot does not fit there."),
        ([1.0, 0.0], "The parameter place_pose is wrong."),
        ([math.nan, 0.0, 0.0], "The parameter place_pose is wrong."),
        ("there", "The parameter place_pose is wrong."),
    ],
)
def test_a_place_that_cannot_be_is_explained_and_the_robot_stays(robot: Listener, pose: Any, words: str) -> None:
    robot.set(place_pose=pose)
    answer = robot.trigger("/benchbot/place")

    assert not answer.success
    assert words in answer.message
    assert robot.truth() == START


def test_transforms_lead_from_the_map_through_odometry_to_the_camera(robot: Listener) -> None:
    tree = transforms.listen(robot.node)
    assert tree is not None
    go = robot.velocities()
    assert robot.place(0.3, 0.2, 0.4).success
    until(lambda: go(0.3, 0.5) or robot.odometry().yaw_rad > 0.2, "the robot has turned")
    odometry, truth = robot.newer(*ODOMETRY), robot.newer(*TRUTH)

    def pose(target: str, source: str, stamp_ns: int) -> Pose | None:
        try:
            return tree.lookup(target, source, stamp_ns)
        except LookupError:
            return None

    for frame, message in (("odom", odometry), ("map", truth)):
        found = until(partial(pose, frame, "base_link", time_of(message)), f"{frame} to base_link")
        assert close(found, pose_of(message.pose.pose))
    platform = simulator("arena:1")
    mount = platform.pose().inverse() @ recorded(platform.observe(["poses"])["poses"]["camera"])
    assert close(tree.lookup("base_link", "camera", None), mount)
    assert close(tree.lookup("base_link", "lidar", None), Pose())


def close(first: Pose, second: Pose) -> bool:
    return bool(np.allclose(first.matrix(), second.matrix(), atol=1e-9))


def recorded(record: FramePose) -> Pose:
    (x, y, z), (qx, qy, qz, qw) = record["translation_xyz"], record["rotation_xyzw"]
    return Pose((x, y, z), (qx, qy, qz, qw))
