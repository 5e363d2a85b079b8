"""The bridged robot: its declaration, its environment, and the names of its frames and topics in ROS 2."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import (
    MANIPULATION,
    BenchbotError,
    Catalog,
    Declaration,
    PlatformSpec,
    Plugins,
    Scene,
    Simulation,
    misfits,
    read_declaration,
)
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Topic

NODE = "benchbot_bridge"
COMMAND, ODOMETRY, GROUND_TRUTH, COLLISION = "cmd_vel", "odom", "ground_truth/odom", "collision"
DESCRIPTION = "robot_description"
COMPRESSED_TYPE = "sensor_msgs/msg/CompressedImage"
RESET, PLACE = "benchbot/reset", "benchbot/place"
BASE_FOOTPRINT = "base_footprint"


class BridgedRobot(msgspec.Struct, frozen=True):
    """A simulated robot's declaration, and how it is presented.

    Names of topics and services are relative to `namespace`, those of all frames begin with `frame_prefix`. `options`
    are the simulator's. `stamped` velocities are geometry_msgs/msg/TwistStamped.
    """

    declaration: dict[str, Any]
    namespace: str
    options: dict[str, Any]
    cache_dir: str
    frame_prefix: str = ""
    stamped: bool = False

    @property
    def name(self) -> str:
        """The robot's name."""
        return str(self.declaration["name"])

    def frame(self, name: object) -> str:
        """Return a frame's name in ROS 2."""
        return f"{self.frame_prefix}{name}"

    @property
    def base_frame(self) -> str:
        """The frame of the base."""
        return self.frame(self.declaration["robot_frame"])

    @property
    def odometry_frame(self) -> str:
        """The frame of odometry, which begins where the robot does."""
        return self.frame("odom")

    @property
    def map_frame(self) -> str:
        """The frame of the map."""
        return self.frame(self.declaration["global_frame"])

    def sensor_frame(self, channel: str) -> str:
        """Return the frame that a channel's messages are in.

        Where the declaration does not name it, the simulator calls that of pictures `camera` and that of scans `lidar`.
        """
        sensor = "camera" if channel in self.pictures else channel
        default = {"camera": "camera", "imu": self.declaration["robot_frame"]}.get(sensor, "lidar")
        return self.frame(self.declaration.get(sensor, {}).get("frame", default))

    @property
    def transform_topics(self) -> tuple[str, str]:
        """The topics of moving and of static transforms.

        One tree for a domain, whose frames have prefixes; in a namespace without prefix a tree of its own, as Nav2's
        launch files remap it.
        """
        return ("tf", "tf_static") if self.namespace and not self.frame_prefix else ("/tf", "/tf_static")

    @property
    def command_type(self) -> str:
        """The type of velocity commands."""
        return f"geometry_msgs/msg/Twist{'Stamped' if self.stamped else ''}"

    @property
    def pictures(self) -> tuple[str, ...]:
        """The camera's channels that the robot has."""
        return tuple(channel for channel in self._channels if channel.startswith("image_"))

    @property
    def scanners(self) -> tuple[str, ...]:
        """The channels of scanners that the robot has."""
        return tuple(channel for channel in ("laser", "lidar") if channel in self._channels)

    def has(self, channel: str) -> bool:
        """Return whether the simulator observes a channel."""
        return channel in self._channels

    @property
    def unpresented(self) -> tuple[str, ...]:
        """The channels of an arm that the robot has and no ROS 2 software is shown."""
        silent = MANIPULATION | {"joint_states"}
        return tuple(channel for channel in self.declaration["connections"] if channel in silent)

    @property
    def _channels(self) -> tuple[str, ...]:
        return tuple(channel for channel in _presented().observations if channel in self.declaration["connections"])

    def create(self, plugins: Plugins) -> Simulation:
        """Return the robot's simulator; raises BenchbotError when it cannot put a robot anywhere."""
        spec = PlatformSpec(self.declaration, "ground_truth", Path(self.cache_dir), self.options)
        simulator = plugins.record("simulators", self.declaration["type"])
        platform: Simulation = simulator.create(spec)
        if not hasattr(platform, "place"):
            raise BenchbotError(
                f"The robot '{self.name}' cannot be bridged.",
                f"Its simulator '{simulator.name}' has no method place, which puts a robot anywhere.",
                "Ask the simulator's author to implement benchbot.core.platform.Simulation.",
            )
        return platform


@cache
def _presented() -> Ros2Robot:
    with as_file(files("benchbot_robot_ros2") / "robots" / "carter_lidar_ros2.yaml") as path:
        return Ros2Robot.from_declaration(read_declaration(path))


def topics(channel: str) -> Mapping[str, Topic]:
    """Return the topics of an observation, by the part that each carries: those of the robot carter_lidar_ros2."""
    return _presented().observations[channel].parts()


def compressed_topics(robot: BridgedRobot) -> dict[str, str]:
    """Return the topics of compressed pictures by their channels, as image_transport names them."""
    names = {"image_rgb": "compressed", "image_depth": "compressedDepth"}
    return {
        channel: f"{relative(topics(channel)[''])}/{names[channel]}" for channel in robot.pictures if channel in names
    }


def relative(topic: Topic) -> str:
    """Return a topic's name without the leading slash, so that it is resolved in the node's namespace."""
    return topic.ros_topic.removeprefix("/")


def find_robot(catalog: Catalog, name: str) -> Declaration:
    """Return a simulated robot; raises BenchbotError for an unknown one, and one that is not simulated."""
    robot = catalog.get("robots", name)
    simulators = catalog.plugins.pool("simulators")
    kind = robot.data["type"]
    if kind in simulators:
        return robot
    simulated = [name for name, other in catalog.pool("robots").items() if other.data.get("type") in simulators]
    fix = "Choose a simulated robot with --robot."
    if kind not in catalog.plugins.pool("robot_drivers"):
        fix += f" Or install what simulates this one: pip install benchbot-{kind.replace('_', '-')}"
    raise BenchbotError(
        f"The robot '{name}' cannot be bridged.",
        f"The bridge presents simulated robots, and no installed simulator runs robots of type '{kind}'. "
        f"Simulators: {', '.join(sorted(simulators)) or 'none'}; simulated robots: "
        f"{', '.join(sorted(simulated)) or 'none'}.{catalog.plugins.broken_hint()}",
        fix,
    )


def scene_name(scene: Scene) -> str:
    """Return a scene's name, name:variant."""
    return f"{scene.environment['name']}:{scene.environment['variant']}"


def find_scene(catalog: Catalog, robot: Mapping[str, Any], environment: str) -> Scene:
    """Return the scene `name:variant`; raises BenchbotError when there is none, or the robot cannot be in it."""
    scenes = catalog.environments(environment)
    if len(scenes) != 1:
        raise BenchbotError(
            f"'{environment}' names {len(scenes)} scenes.",
            "A bridged robot is in one scene at a time; the service benchbot/reset takes it to another.",
            f"Name one: {scenes[0].name}",
        )
    for misfit in misfits(robot, scenes[0]):
        raise misfit
    return Scene(scenes[0].data, scenes[0].path.parent)
