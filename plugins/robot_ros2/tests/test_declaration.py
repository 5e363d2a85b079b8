from pathlib import Path
from typing import Any

import pytest
import yaml

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import (
    LocalisedByOdometry,
    LocalisedByTopic,
    Qos,
    ReturnByOperator,
    ReturnByService,
)

SMALL = """\
name: cart
type: ros2
global_frame: map
robot_frame: base_link
poses: [base_link, camera]
frames: {camera: {xyz: [0.1, 0, 1], rpy_deg: [-90, 0, -90]}}
camera: {frame: camera}
footprint: {radius_m: 0.2}
connections:
  image_rgb:
    {connection: ros_to_api, ros_topic: /image, ros_type: sensor_msgs/msg/Image, qos: {reliability: best_effort}}
  poses: {connection: ros_to_api}
  move_angle: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/TwistStamped}
  move_next: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/TwistStamped}
driver:
  odometry: {ros_topic: /odom, ros_type: nav_msgs/msg/Odometry}
"""


@pytest.fixture
def small() -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load(SMALL)
    return document


def test_a_small_declaration_gets_careful_defaults(small: dict[str, Any]) -> None:
    robot = Ros2Robot.from_declaration(small)
    assert robot.command.ros_topic == "/cmd_vel"
    assert robot.observations["image_rgb"].parts()[""].qos == Qos(reliability="best_effort")
    assert robot.observations["poses"].parts() == {}
    assert robot.settings.localisation == LocalisedByOdometry()
    assert robot.settings.return_to_start == ReturnByOperator()
    assert robot.settings.safety.command_timeout_s < 0.2
    assert robot.settings.safety.obstacles == ("laser",)
    assert robot.camera_frame == "camera"


def test_the_bridged_carter_is_placed_by_a_service_and_localised_by_its_true_pose() -> None:
    robot = Ros2Robot.from_declaration(Catalog(load()).get("robots", "carter_ros2").data)
    assert isinstance(robot.settings.return_to_start, ReturnByService)
    assert isinstance(robot.settings.localisation, LocalisedByTopic)
    assert set(robot.observations["image_segment"].parts()) == {
        "class_segment_img",
        "instance_segment_img",
        "class_ids",
    }


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("driver.saftey", {}, "unknown field `saftey`"),
        ("driver.localisation", {"by": "magic"}, "magic"),
        ("driver.safety", {"dead_man": {"ros_topic": "/joy", "ros_type": "sensor_msgs/msg/Imu"}}, "ros_type"),
        ("driver.odometry", {"ros_topic": "/odom"}, "ros_type"),
        ("driver.timing", {"wait_s": "long"}, "wait_s"),
        ("footprint", {}, "radius_m"),
        ("frames", {"camera": {"xyz": [1, 2]}}, "length 3"),
        ("connections.image_rgb", {"connection": "ros_to_ros"}, "ros_to_ros"),
    ],
)
def test_a_wrong_key_is_named(small: dict[str, Any], path: str, value: object, said: str) -> None:
    *parents, key = path.split(".")
    target = small
    for parent in parents:
        target = target[parent]
    target[key] = value
    with pytest.raises(BenchbotError) as caught:
        Ros2Robot.from_declaration(small)
    assert path.split(".", maxsplit=1)[0] in caught.value.title
    assert said in caught.value.why


@pytest.mark.parametrize(
    "other",
    [
        {"connection": "api_to_ros", "ros_topic": "/elsewhere", "ros_type": "geometry_msgs/msg/TwistStamped"},
        {"connection": "api_to_ros", "ros_topic": "/cmd_vel", "ros_type": "geometry_msgs/msg/Twist"},
        {"connection": "api_to_ros"},
    ],
)
def test_all_actions_command_velocities_on_one_topic(small: dict[str, Any], other: dict[str, str]) -> None:
    small["connections"]["move_next"] = other
    with pytest.raises(BenchbotError, match="no one topic for velocity commands"):
        Ros2Robot.from_declaration(small)


def test_localisation_is_not_told_that_a_robot_is_where_navigation_only_tried_to_go(small: dict[str, Any]) -> None:
    small["driver"] |= {
        "localisation": {"by": "tf", "initial_pose": "/initialpose"},
        "return_to_start": {"by": "navigation"},
    }
    with pytest.raises(BenchbotError, match=r"wrong at 'driver\.localisation\.initial_pose'"):
        Ros2Robot.from_declaration(small)


def test_the_arm_of_the_documentation_is_declared_as_it_is_shown(small: dict[str, Any]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "ros2.md").read_text("utf-8")
    shown = yaml.safe_load(page.partition("### Arms")[2].partition("```yaml")[2].partition("```")[0])
    small["connections"] |= shown["connections"]
    robot = Ros2Robot.from_declaration(small | {"arm": shown["arm"]})
    assert robot.arm is not None
    assert list(robot.arm.joints) == ["shoulder", "elbow"]
    assert robot.arm_commands.keys() == {"move_joints", "move_gripper"}
    assert robot.command.ros_topic == "/cmd_vel"


def test_a_base_that_is_driven_sideways_says_how_fast(small: dict[str, Any]) -> None:
    small["connections"]["move_sideways"] = {"connection": "api_to_ros"} | small["connections"]["move_angle"]
    with pytest.raises(BenchbotError, match="'cart' cannot be driven sideways") as refused:
        Ros2Robot.from_declaration(small)
    assert "limits: {lateral_mps: 0.5}" in refused.value.fix
    assert Ros2Robot.from_declaration(small | {"limits": {"lateral_mps": 0.5}}).command.ros_topic == "/cmd_vel"
