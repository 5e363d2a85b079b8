"""The bridged robot: its declaration, its environment, and the names of its frames and topics in ROS 2."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import (
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
from benchbot_robot_ros2.declaration import Ros2Robot, Topic

NODE = "benchbot_bridge"
COMMAND, ODOMETRY, GROUND_TRUTH, COLLISION = "cmd_vel", "odom", "ground_truth/odom", "collision"
RESET, PLACE = "benchbot/reset", "benchbot/place"
ODOMETRY_FRAME = "odom"


class BridgedRobot(msgspec.Struct, frozen=True):
    """A simulated robot's declaration, and how it is presented.

    Names of topics and services are relative to `namespace`. `options` are the simulator's.
    """

    declaration: dict[str, Any]
    namespace: str
    options: dict[str, Any]
    cache_dir: str

    @property
    def name(self) -> str:
        """The robot's name."""
        return str(self.declaration["name"])

    @property
    def base_frame(self) -> str:
        """The frame of the base."""
        return str(self.declaration["robot_frame"])

    @property
    def map_frame(self) -> str:
        """The frame of the map."""
        return str(self.declaration["global_frame"])

    @property
    def camera_frame(self) -> str:
        """The camera's optical frame; the simulator calls it `camera` where the declaration does not name it."""
        return str(self.declaration.get("camera", {}).get("frame", "camera"))

    def scanner_frame(self, channel: str) -> str:
        """The frame of the laser scanner (`laser`) or of the lidar of many rings (`lidar`)."""
        return str(self.declaration.get(channel, {}).get("frame", "lidar"))

    @property
    def pictures(self) -> tuple[str, ...]:
        """The camera's channels that the robot has."""
        return tuple(channel for channel in self._channels if channel.startswith("image_"))

    @property
    def scanners(self) -> tuple[str, ...]:
        """The channels of scanners that the robot has."""
        return tuple(channel for channel in ("laser", "lidar") if channel in self._channels)

    @property
    def has_poses(self) -> bool:
        """True if the simulator reports the poses of the robot's frames."""
        return "poses" in self._channels

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
