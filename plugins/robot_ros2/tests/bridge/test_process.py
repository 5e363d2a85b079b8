"""How a bridge begins and ends: by a signal, by kill -9, by the end of its camera; and in the system's time."""

import os
import signal
import time
from collections.abc import Iterable
from typing import Any

import pytest

from benchbot.core import plugin_manager
from benchbot.core.channels import Observations
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import Simulation
from benchbot.process import is_running
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.bridge.camera_process import Album
from benchbot_robot_ros2.bridge.robot import BridgedRobot
from benchbot_robot_ros2.messages import message_type
from plugins.robot_ros2.tests.bridge.bridged import (
    SAMPLE,
    bridge,
    children_of,
    listener,
    simulator,
    time_of,
    until,
)

ODOMETRY = ("/odom", "nav_msgs/msg/Odometry")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_order(domain: int, number: signal.Signals) -> None:
    with bridge(*SAMPLE) as process:
        (camera,) = children_of(process.pid)
        process.send_signal(number)

        assert process.wait(60) == 0
        assert not is_running(camera)
        assert process.stderr
        assert process.stderr.read().endswith("The bridge has ended.\n")


def test_kill_9_leaves_no_process(domain: int) -> None:
    with bridge(*SAMPLE) as process:
        (camera,) = children_of(process.pid)
        process.kill()
        process.wait()

        until(lambda: not is_running(camera), "the camera is gone")


def test_without_its_camera_the_bridge_says_so_and_ends(domain: int) -> None:
    with bridge(*SAMPLE) as process:
        (camera,) = children_of(process.pid)
        os.kill(camera, signal.SIGKILL)

        assert process.wait(60) == 3
        assert process.stderr
        said = process.stderr.read()
        assert "The camera's process ended." in said
        assert "SIGKILL" in said


def test_a_camera_that_hangs_holds_up_neither_the_robot_nor_the_end(domain: int) -> None:
    with bridge(*SAMPLE) as process, listener() as robot:
        (camera,) = children_of(process.pid)
        os.kill(camera, signal.SIGSTOP)
        for _ in range(5):
            robot.newer(*ODOMETRY)
        process.terminate()

        assert process.wait(60) == 0
        assert not is_running(camera)


def test_a_bridge_ends_whose_time_stands_still(domain: int) -> None:
    with bridge(*SAMPLE) as leader, bridge(*SAMPLE, "--namespace", "tb2") as follower:
        leader.terminate()
        assert leader.wait(60) == 0
        time.sleep(0.5)
        follower.terminate()
        assert follower.wait(60) == 0


def test_the_second_signal_ends_it_in_a_reset_that_hangs(domain: int) -> None:
    from std_srvs.srv import Trigger

    with bridge(*SAMPLE) as process, listener() as robot:
        (camera,) = children_of(process.pid)
        odometry = robot.hear(*ODOMETRY)
        client = robot.node.create_client(Trigger, "/benchbot/reset")
        assert client.wait_for_service(60)
        os.kill(camera, signal.SIGSTOP)
        client.call_async(Trigger.Request())

        def stands_still() -> bool:
            heard = len(odometry)
            time.sleep(0.5)
            return len(odometry) == heard

        until(stands_still, "the reset waits for the camera")
        process.terminate()
        time.sleep(0.5)
        assert process.poll() is None
        process.terminate()
        assert process.wait(60) == 0
        assert not is_running(camera)


def test_wall_time_is_the_systems_and_has_no_clock_topic(domain: int) -> None:
    before_ns = time.time_ns()
    with bridge(*SAMPLE, "--wall-time", "--namespace", "robot_1") as process, listener() as robot:
        stamp_ns = time_of(robot.newer("/robot_1/odom", "nav_msgs/msg/Odometry"))
        assert before_ns < stamp_ns < time.time_ns()
        expected = {"/robot_1/scan", "/robot_1/cmd_vel", "/robot_1/camera/color/image_raw"}
        until(lambda: expected <= dict(robot.node.get_topic_names_and_types()).keys(), "its topics")
        until(lambda: ("benchbot_bridge", "/robot_1") in robot.node.get_node_names_and_namespaces(), "its node")
        assert "/clock" not in dict(robot.node.get_topic_names_and_types())
        assert process.poll() is None


def test_an_invalid_namespace_is_explained(domain: int) -> None:
    with pytest.raises(AssertionError, match="'robot-1' is not a namespace"), bridge(*SAMPLE, "--namespace", "robot-1"):
        pass


def test_only_what_somebody_subscribes_to_is_pictured(domain: int) -> None:
    sample = BridgedRobot(Catalog(plugin_manager.load()).get("robots", "sample_robot").data, "", {}, "unused")
    camera = Recalling(simulator("arena:1"))
    with ros.node("camera") as node, listener() as somebody:
        album = Album(node, sample)
        album.publish(camera, 1)
        assert camera.asked == []
        heard: list[Any] = []
        image, info = message_type("sensor_msgs/msg/Image"), message_type("sensor_msgs/msg/CameraInfo")
        somebody.node.create_subscription(image, "/camera/depth/image_raw", heard.append, 1)
        somebody.node.create_subscription(info, "/camera/depth/camera_info", heard.append, 1)

        def seen() -> bool:
            album.publish(camera, 2)
            return len(heard) > 1

        until(seen, "a picture")

    assert camera.asked[-1] == ("image_depth", "image_depth_info")
    assert not any("image_rgb" in channels for channels in camera.asked)


class Recalling:
    """A simulator that remembers what it was asked to observe."""

    def __init__(self, simulation: Simulation) -> None:
        self.asked: list[tuple[str, ...]] = []
        self._simulation = simulation

    def observe(self, channels: Iterable[str]) -> Observations:
        self.asked.append(tuple(channels))
        return self._simulation.observe(self.asked[-1])
