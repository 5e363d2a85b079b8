"""Which declared robot drives a bridged one: the one that asks for nothing that the bridge does not offer."""

from typing import Any

import pytest

from benchbot_robot_ros2.bridge import fitting
from benchbot_robot_ros2.bridge.robot import BridgedRobot
from plugins.robot_ros2.tests.bridge.bridged import CATALOG


def bridged(name: str, namespace: str = "", frame_prefix: str = "", *, stamped: bool = False, **changes: Any) -> Any:
    data = {**CATALOG.get("robots", name).data, **changes}
    return BridgedRobot(data, namespace, {}, "unused", frame_prefix, stamped)


def drivers(robot: BridgedRobot, *, simulated: bool = True, transforms: bool = True) -> dict[str, list[str]]:
    return fitting.drivers(CATALOG, robot, simulated=simulated, transforms=transforms)


@pytest.mark.parametrize("name", ["carter", "carter_lowres", "carter_realistic"])
def test_a_robot_without_a_lidar_is_driven_by_the_one_that_asks_for_none(name: str) -> None:
    found = drivers(bridged(name))
    assert next(iter(found.items())) == ("carter_ros2", [])
    assert found["carter_lidar_ros2"] == ["/points (sensor_msgs/msg/PointCloud2)"]


def test_a_robot_with_a_lidar_is_driven_by_the_one_that_observes_it() -> None:
    # carter_ros2 would drive it, too, and not see its lidar.
    assert next(iter(drivers(bridged("carter_lidar")).items())) == ("carter_lidar_ros2", [])


def test_a_robot_in_a_namespace_is_driven_by_that_member_of_the_fleet() -> None:
    found = drivers(bridged("carter", "tb1", "tb1/"))
    assert next(iter(found.items())) == ("carter_ros2@tb1", [])
    assert "carter_ros2" not in found


def test_robots_of_other_places_are_not_asked() -> None:
    assert drivers(bridged("sample_robot")) == {}
    assert {"turtlebot4", "jackal"}.isdisjoint(drivers(bridged("carter")))


@pytest.mark.parametrize(
    ("robot", "how", "lacks"),
    [
        (bridged("carter", "tb1"), {}, "robot_frame: tb1/base_link, not base_link"),
        (bridged("carter", "", "tb1/"), {}, "robot_frame: base_link, not tb1/base_link"),
        (bridged("carter", "", "tb1/"), {}, "the frame lidar of laser, which is tb1/lidar"),
        (bridged("carter", stamped=True), {}, "/cmd_vel (geometry_msgs/msg/Twist)"),
        (bridged("carter"), {"simulated": False}, "driver.use_sim_time: true"),
        (bridged("carter", connections={"laser": {}, "poses": {}}), {}, "/imu (sensor_msgs/msg/Imu)"),
        (bridged("carter", frames={"lidar": {"xyz": [0, 0, 0.3]}}), {}, "another place of the frame lidar"),
        (bridged("carter", footprint={"radius_m": 0.5}), {}, "footprint.radius_m: 0.3, less than that of the robot"),
        (
            bridged("carter", speed_factor=0.5, limits={"linear_mps": [-0.1, 0.2]}),
            {},
            "limits above those of the robot",
        ),
    ],
)
def test_what_a_driver_asks_in_vain_is_said(robot: BridgedRobot, how: dict[str, bool], lacks: str) -> None:
    name = f"carter_ros2@{robot.namespace}" if robot.namespace else "carter_ros2"
    assert lacks in drivers(robot, **how)[name]
