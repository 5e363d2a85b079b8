"""What `benchbot doctor --robot` finds in a robot's transforms."""

from typing import Any

import pytest
import yaml

from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.doctor import transform_checks
from benchbot_robot_ros2.transforms import TransformTree

CART = """\
name: cart
type: ros2
global_frame: map
robot_frame: base_link
poses: [base_link, initial_pose, lidar, camera_optical]
frames: {lidar: {xyz: [0, 0, 0.3]}}
camera: {frame: camera_optical}
footprint: {radius_m: 0.2}
connections:
  move_angle: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/Twist}
driver:
  odometry: {ros_topic: /odom, ros_type: nav_msgs/msg/Odometry}
"""


def cart(**driver: Any) -> Ros2Robot:
    declaration = yaml.safe_load(CART)
    declaration["driver"] |= driver
    return Ros2Robot.from_declaration(declaration)


def findings(robot: Ros2Robot, tree: TransformTree | None, *, published: bool = True) -> dict[str, Finding]:
    found = {finding.subject: finding for finding in transform_checks.check(robot, tree, published=published)}
    assert all(finding.fix for finding in found.values() if finding.level is not Level.OK)
    return found


@pytest.mark.parametrize(
    ("tree", "says"), [(None, "tf2_msgs is not installed"), (TransformTree(), "nothing publishes")]
)
def test_without_transforms_mounts_must_be_declared(tree: TransformTree | None, says: str) -> None:
    found = findings(cart(), tree, published=False)
    assert found["transforms"].level is Level.WARNING
    assert says in found["transforms"].detail
    assert found["frame camera_optical"].level is Level.BROKEN
    assert "frame lidar" not in found


def test_without_transforms_nobody_is_localised_by_them() -> None:
    found = findings(cart(localisation={"by": "tf"}), None, published=False)
    assert found["transforms"].level is Level.BROKEN


def test_the_measured_mount_is_printed_for_the_declaration() -> None:
    tree = TransformTree()
    tree.set_transform("base_link", "lidar", Pose.from_xyz_rpy_deg((0, 0, 0.35)), None)
    tree.set_transform("base_link", "head", Pose.from_xyz_rpy_deg((0.1, 0, 1)), None)
    tree.set_transform("head", "camera_optical", Pose.from_xyz_rpy_deg((0, 0, 0), (-90, 0, -90)), None)
    found = findings(cart(), tree)
    assert "declared 5.0 cm" in found["frame lidar"].detail
    assert "lidar: {xyz: [0.0000, 0.0000, 0.3500]" in found["frame lidar"].fix
    assert "camera_optical: {xyz: [0.1000, 0.0000, 1.0000], rpy_deg: [-90.00" in found["frame camera_optical"].fix


def test_a_frame_that_nobody_knows_is_broken_only_where_it_is_not_declared() -> None:
    tree = TransformTree()
    tree.set_transform("base_link", "other", Pose(), None)
    found = findings(cart(), tree)
    assert found["frame lidar"].level is Level.WARNING
    assert found["frame camera_optical"].level is Level.BROKEN


def test_a_frame_in_another_tree_is_broken_though_it_is_declared() -> None:
    tree = TransformTree()
    tree.set_transform("base_link", "camera_optical", Pose(), None)
    tree.set_transform("mast", "lidar", Pose(), None)
    found = findings(cart(), tree)["frame lidar"]
    assert found.level is Level.BROKEN
    assert "they are in two trees" in found.detail


@pytest.mark.parametrize(("stamp_ns", "level"), [(None, Level.BROKEN), (1, Level.WARNING)])
def test_a_fixed_sensor_that_is_declared_to_look_elsewhere_is_broken_one_that_moves_is_not(
    stamp_ns: int | None, level: Level
) -> None:
    tree = TransformTree()
    tree.set_transform("base_link", "lidar", Pose.from_xyz_rpy_deg((0, 0, 0.3), (0, 0, 180)), stamp_ns)
    found = findings(cart(), tree)["frame lidar"]
    assert found.level is level
    assert "180.0 degrees" in found.detail


def test_localisation_by_tf_needs_the_way_from_the_map_to_the_base() -> None:
    tree = TransformTree()
    tree.set_transform("odom", "base_link", Pose(), 1)
    robot = cart(localisation={"by": "tf"})
    assert findings(robot, tree)["transforms"].level is Level.BROKEN
    tree.set_transform("map", "odom", Pose(), 1)
    assert findings(robot, tree)["transforms"].level is Level.OK
