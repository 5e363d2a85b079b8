"""The camera's process: takes pictures from where the bridged robot is, and publishes them.

Started as `python -m benchbot_robot_ros2.bridge.camera_process SOCKET_FD LIFELINE_FD` by `camera`. A process of its
own, since a ray tracer holds Python's lock while it renders, and the robot must not be held up. It never outlives the
bridge: the kernel ends it with SIGIO when the lifeline (a pipe whose other end only the bridge holds) breaks, even in
the middle of a picture.
"""

import fcntl
import os
import signal
import socket
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.plugin import BenchbotError, Observations, Simulation, load_plugins
from benchbot_robot_ros2 import qos, ros
from benchbot_robot_ros2.bridge import camera_channel
from benchbot_robot_ros2.bridge.camera_channel import Failed, Load, Look, Ready, Start
from benchbot_robot_ros2.bridge.pace import Rate
from benchbot_robot_ros2.bridge.robot import COMPRESSED_TYPE, NODE, BridgedRobot, compressed_topics, relative, topics
from benchbot_robot_ros2.compression import compress
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import message_type

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher

NICENESS = 5


def main() -> None:
    """Serve the bridge until it closes its end of the socket."""
    # Ctrl-C reaches this process through the bridge only.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = socket.socket(fileno=int(sys.argv[1]))
    _die_with(int(sys.argv[2]))
    # The robot's control loop comes first.
    os.nice(NICENESS)
    start = camera_channel.receive(connection)
    if isinstance(start, Start):
        with ros.node(f"{NODE}_camera", namespace=start.robot.namespace) as node:
            _serve(connection, start, node)


def _die_with(lifeline: int) -> None:
    fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(lifeline, fcntl.F_SETFL, fcntl.fcntl(lifeline, fcntl.F_GETFL) | os.O_ASYNC)


def _serve(connection: socket.socket, start: Start, node: "Node") -> None:
    platform: Simulation | None = None
    rate = Rate(start.rate_hz)
    album = Album(node, start.robot)
    while (message := camera_channel.receive_newest(connection)) is not None:
        if isinstance(message, Load):
            try:
                if platform is None:
                    platform = start.robot.create(load_plugins())
                platform.load(message.scene(), message.seed)
                # The first picture takes long: kernels are compiled, and light is worked out.
                platform.observe(start.robot.pictures)
            except BenchbotError as error:
                camera_channel.send(connection, Failed.of(error))
            else:
                rate = Rate(start.rate_hz)
                camera_channel.send(connection, Ready())
        elif isinstance(message, Look) and platform is not None and rate.due(message.stamp_ns):
            platform.place(message.base)
            album.publish(platform, message.stamp_ns)


class Observing(Protocol):
    """The part of a platform that takes pictures."""

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the requested channels, all of the same instant."""


class Album:
    """Publishes pictures on the topics of their channels."""

    def __init__(self, node: "Node", robot: BridgedRobot) -> None:
        # A late subscriber gets the next picture instead of an old one.
        profile = qos.sending(depth=1)
        self._robot = robot
        self._publishers: dict[str, dict[str, Publisher[Any]]] = {
            channel: {
                part: node.create_publisher(message_type(topic.ros_type), relative(topic), profile)
                for part, topic in topics(channel).items()
            }
            for channel in robot.pictures
        }
        self._compressed = {
            channel: node.create_publisher(message_type(COMPRESSED_TYPE), name, profile)
            for channel, name in compressed_topics(robot).items()
        }

    def publish(self, camera: Observing, stamp_ns: int) -> None:
        """Take a picture and publish those of its channels that have subscribers."""
        wanted = [
            channel
            for channel in self._publishers
            if any(publisher.get_subscription_count() for publisher in self._all(channel))
        ]
        for channel, value in camera.observe(wanted).items() if wanted else ():
            frame_id = self._robot.sensor_frame(channel)
            for part, message in encode(channel, value, stamp_ns=stamp_ns, frame_id=frame_id).items():
                self._publishers[channel][part].publish(message)
            compressed = self._compressed.get(channel)
            if compressed and compressed.get_subscription_count():
                picture: Any = value
                compressed.publish(compress(channel, picture, stamp_ns=stamp_ns, frame_id=frame_id))

    def _all(self, channel: str) -> "Iterable[Publisher[Any]]":
        compressed = self._compressed.get(channel)
        return [*self._publishers[channel].values(), *([compressed] if compressed else [])]


if __name__ == "__main__":
    main()
