"""A bridge in a process of its own, and a node that listens to it and calls it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tests.conftest  # the sample plug-in is installed for this process and its children
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.geometry import Pose
from benchbot.core.platform import PlatformSpec, Scene, Simulation
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.messages import message_type, pose_of

COMMAND = [sys.executable, "-m", "benchbot", "bridge", "ros2"]
SAMPLE = ("--robot", "sample_robot", "--env", "arena:1")
DEADLINE_S = 60.0

assert tests.conftest.SAMPLE_PLUGIN in sys.path

CATALOG = Catalog(plugin_manager.load())


@contextmanager
def bridge(*words: str, **variables: str) -> Iterator["subprocess.Popen[str]"]:
    """Start a bridge, wait until it is ready, and end it."""
    process = subprocess.Popen(
        [*COMMAND, *words], stderr=subprocess.PIPE, text=True, env={**os.environ, **variables}, start_new_session=True
    )
    assert process.stderr
    children: list[int] = []
    try:
        said = []
        for line in process.stderr:
            said.append(line)
            if "is a ROS 2 robot now" in line:
                break
        else:
            raise AssertionError("".join(said))
        children = children_of(process.pid)
        yield process
    finally:
        with suppress(ProcessLookupError):
            process.send_signal(signal.SIGTERM)
        try:
            process.wait(DEADLINE_S)
        finally:
            process.kill()
            for child in children:
                with suppress(ProcessLookupError):
                    os.kill(child, signal.SIGKILL)


def children_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def until(condition: Callable[[], Any], what: str) -> Any:
    """Wait for a condition, and return what it says."""
    deadline_s = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline_s:
        if found := condition():
            return found
        time.sleep(0.005)
    raise AssertionError(f"waited in vain: {what}")


@dataclass
class Listener:
    """Keeps the messages of the topics that it was asked to hear."""

    node: Any
    heard: dict[str, list[Any]] = field(default_factory=dict)

    def hear(self, topic: str, ros_type: str) -> list[Any]:
        """Subscribe to a topic, and return the list that its messages are put into."""
        if topic not in self.heard:
            self.heard[topic] = []
            self.node.create_subscription(message_type(ros_type), topic, self.heard[topic].append, 100)
            until(lambda: self.heard[topic], f"a message on {topic}")
        return self.heard[topic]

    def newer(self, topic: str, ros_type: str, stamp: int = -1) -> Any:
        """Return a message that was stamped later than `stamp`, by default later than now."""
        messages = self.hear(topic, ros_type)
        after = max(stamp, *map(time_of, messages))
        return until(lambda: [m for m in messages if time_of(m) > after], f"news on {topic}")[-1]

    def truth(self) -> Pose:
        """Return where the robot is now."""
        return pose_of(self.newer("/ground_truth/odom", "nav_msgs/msg/Odometry").pose.pose)

    def odometry(self) -> Pose:
        return pose_of(self.newer("/odom", "nav_msgs/msg/Odometry").pose.pose)

    def velocities(self) -> Any:
        """Return what publishes a velocity that the bridge hears: ahead, turning, to the left."""
        twist = message_type("geometry_msgs/msg/Twist")
        publisher = self.node.create_publisher(twist, "/cmd_vel", 1)
        until(publisher.get_subscription_count, "somebody obeys")
        return lambda *velocity: publisher.publish(_filled(twist(), *velocity))

    def set(self, **parameters: Any) -> None:
        """Set parameters of the bridge."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        messages = [Parameter(name, value=value).to_parameter_msg() for name, value in parameters.items()]
        answer = self.call(SetParameters, "/benchbot_bridge/set_parameters", SetParameters.Request(parameters=messages))
        assert all(result.successful for result in answer.results), answer

    def trigger(self, service: str) -> Any:
        """Call a Trigger."""
        from std_srvs.srv import Trigger

        return self.call(Trigger, service, Trigger.Request())

    def place(self, x: float, y: float, yaw_rad: float) -> Any:
        self.set(place_pose=[float(x), float(y), float(yaw_rad)])
        return self.trigger("/benchbot/place")

    def reset(self, **parameters: Any) -> Any:
        """Reset into `arena:1` with seed 0 and its own start, or what is asked for."""
        self.set(**{"environment": "arena:1", "seed": 0, "start_pose": [], **parameters})
        return self.trigger("/benchbot/reset")

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service, and return its response."""
        client = self.node.create_client(service_type, name)
        assert client.wait_for_service(DEADLINE_S)
        future = client.call_async(request)
        until(future.done, f"an answer of {name}")
        self.node.executor.create_task(self.node.destroy_client, client)
        return future.result()


@contextmanager
def listener() -> Iterator[Listener]:
    with ros.running_node("listener") as node:
        yield Listener(node)


def time_of(message: Any) -> int:
    """Return a message's stamp in nanoseconds, a clock's time."""
    stamp = message.clock if hasattr(message, "clock") else message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def simulator(environment: str, robot: str = "sample_robot") -> Simulation:
    """Return the simulator itself, in this process, in a scene."""
    declaration = CATALOG.get("robots", robot).data
    scene = CATALOG.environments(environment)[0]
    create = CATALOG.plugins.record("simulators", declaration["type"]).create
    platform: Simulation = create(PlatformSpec(declaration, "ground_truth", Path("unused")))
    platform.load(Scene(scene.data, scene.path.parent), seed=0)
    return platform


def _filled(twist: Any, linear: float, angular: float = 0.0, lateral: float = 0.0) -> Any:
    twist.linear.x, twist.angular.z, twist.linear.y = linear, angular, lateral
    return twist
