"""A ROS 2 robot's declaration: which topics, services and safety devices it has, read and checked once."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self, TypeVar

import msgspec

from benchbot.plugin import ACTIONS, MANIPULATION, OBSERVATIONS, BenchbotError, Pose
from benchbot_robot_ros2.arm import Arm
from benchbot_robot_ros2.declaration_keys import (
    Connection,
    Declared,
    DriverSettings,
    MovedByNavigation,
    ReturnByNavigation,
    Topic,
)
from benchbot_robot_ros2.footprint import Footprint
from benchbot_robot_ros2.names import Names, prefix_in
from benchbot_robot_ros2.ros import Graph

T = TypeVar("T")

ARRAY = "std_msgs/msg/Float64MultiArray"
JOINT_COMMANDS = (ARRAY, "sensor_msgs/msg/JointState")
"""The types that setpoints of an arm may have: of ros2_control's position controllers, and with names."""


@dataclass(frozen=True)
class Ros2Robot:
    """A robot as the driver needs it; `mounts` are poses of the robot's frames in its base frame.

    Names of topics and services are full ones, and frames have the ids that messages name. `reported` and `map_name`
    are what solutions know frames by, of any robot of a fleet.
    """

    name: str
    graph: Graph
    names: Names
    map_name: str
    global_frame: str
    base_frame: str
    reported: tuple[str, ...]
    mounts: dict[str, Pose]
    camera_frame: str | None
    laser_frame: str | None
    lidar_frame: str | None
    imu_frame: str | None
    footprint: Footprint
    observations: dict[str, Connection]
    command: Topic
    arm: Arm | None
    arm_commands: dict[str, Topic]
    settings: DriverSettings

    @classmethod
    def from_declaration(cls, robot: Mapping[str, Any]) -> Self:
        """Read a robot's declaration; raises BenchbotError saying which key is wrong, and how."""
        name = str(robot.get("name"))
        settings = _convert(robot.get("driver", {}), DriverSettings, name, "driver")
        names = Names(name, settings.namespace, prefix_in(settings.namespace, settings.frame_prefix), settings.remap)
        connections = {
            channel: _convert(names.in_all(connection), Connection, name, f"connections.{channel}")
            for channel, connection in robot["connections"].items()
        }
        commands = {channel: connection for channel, connection in connections.items() if channel in ACTIONS}
        _check_sideways(name, robot)
        arm = _convert(robot["arm"], Arm, name, "arm") if "arm" in robot else None
        _check_navigation(name, settings)
        mounts = _convert(robot.get("frames", {}), dict[str, _Mount], name, "frames")

        def frame(sensor: str) -> str | None:
            declared = robot.get(sensor, {}).get("frame")
            return None if declared is None else names.frame(declared)

        return cls(
            name=name,
            graph=_graph(names, settings),
            names=names,
            map_name=str(robot["global_frame"]).removeprefix("/"),
            global_frame=names.frame(str(robot["global_frame"])),
            base_frame=names.frame(str(robot["robot_frame"])),
            reported=tuple(map(str, robot["poses"])),
            mounts={names.frame(declared): mount.pose() for declared, mount in mounts.items()},
            camera_frame=frame("camera"),
            laser_frame=frame("laser"),
            lidar_frame=frame("lidar"),
            imu_frame=frame("imu"),
            footprint=_convert(robot.get("footprint", {}), _Footprint, name, "footprint").made(name),
            observations={
                channel: connection for channel, connection in connections.items() if channel in OBSERVATIONS
            },
            command=_one_command(name, {channel: commands[channel] for channel in commands.keys() - MANIPULATION}),
            arm=arm,
            arm_commands=_arm_commands(name, arm, connections),
            # Defaults may be names, too.
            settings=msgspec.convert(names.in_all(msgspec.to_builtins(settings)), DriverSettings),
        )


class _Footprint(Declared, frozen=True):
    radius_m: float
    z_min_m: float = 0.03
    z_max_m: float = 2.0
    polygon: tuple[tuple[float, float], ...] = ()

    def made(self, robot: str) -> Footprint:
        try:
            return Footprint(self.radius_m, (self.z_min_m, self.z_max_m), self.polygon)
        except ValueError as error:
            raise _wrong(robot, "footprint", error) from error


class _Mount(Declared, frozen=True):
    xyz: tuple[float, float, float]
    rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def pose(self) -> Pose:
        return Pose.from_xyz_rpy_deg(self.xyz, self.rpy_deg)


def _graph(names: Names, settings: DriverSettings) -> Graph:
    moving, static = names.resolved("/tf"), names.resolved("/tf_static")
    return Graph(settings.namespace, names.resolved("/clock"), (moving, static), settings.domain, settings.rmw)


def _convert(value: Any, kind: type[T], robot: str, key: str) -> T:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise _wrong(robot, key, error) from error


def _wrong(robot: str, key: str, error: Exception) -> BenchbotError:
    why = str(error)
    return BenchbotError(
        f"The robot '{robot}' cannot be driven: its declaration is wrong at '{key}'.",
        f"{why[:1].upper()}{why[1:]}.",
        "The keys are explained in docs/ros2.md; a whole declaration: benchbot show robot carter_ros2",
    )


def _check_sideways(name: str, robot: Mapping[str, Any]) -> None:
    """Raise BenchbotError for a base that is to drive sideways, and does not say how fast."""
    if "move_sideways" in robot["connections"] and "lateral_mps" not in robot.get("limits", {}):
        raise BenchbotError(
            f"The robot '{name}' cannot be driven sideways.",
            "It connects move_sideways, and its limits have no lateral_mps.",
            "Add the fastest speed to both sides, in m/s: limits: {lateral_mps: 0.5}",
        )


def _check_navigation(robot: str, settings: DriverSettings) -> None:
    """Raise BenchbotError where something else that is declared does not go with navigation."""
    if settings.safety.take_over is not None and isinstance(settings.motion, MovedByNavigation):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'driver.safety.take_over'.",
            "It is moved by navigation, which nothing tells that a person has the robot: its goal would go on, and be "
            "given up.",
            "Leave take_over out and let twist_mux put the joystick first, or declare motion: {by: velocity}.",
        )
    if settings.initial_pose is not None and isinstance(settings.return_to_start, ReturnByNavigation):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'driver.localisation.initial_pose'.",
            "It returns to its start by navigation, which needs to know where it is before, and ends somewhere near: "
            "told that it is exactly there, localisation would be wrong from then on.",
            "Leave initial_pose out and tell Nav2 once where the robot is, or declare another return_to_start.",
        )


def _one_command(robot: str, commands: Mapping[str, Connection]) -> Topic:
    """Return the one topic that all of a robot's actions command velocities on."""
    topics = {connection.parts().get("") for connection in commands.values()}
    topic = topics.pop() if len(topics) == 1 else None
    if topic is None or topic.ros_type not in ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"):
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: it has no one topic for velocity commands.",
            f"Its actions: {', '.join(commands) or 'none'}. All must name the same ros_topic, of the ros_type "
            "geometry_msgs/msg/Twist or geometry_msgs/msg/TwistStamped.",
            "Write for each: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/Twist}",
        )
    return topic


def _arm_commands(robot: str, arm: Arm | None, connections: Mapping[str, Connection]) -> dict[str, Topic]:
    """Return the topics of an arm's setpoints by action."""
    asked = [channel for channel in connections if channel in MANIPULATION or channel == "joint_states"]
    if asked and arm is None:
        raise BenchbotError(
            f"The robot '{robot}' cannot be driven: its declaration is wrong at 'arm'.",
            f"connections has {' and '.join(asked)}, and no key 'arm' says which joints these are of.",
            "Write: arm: {joints: {shoulder: {radps: 1.0, radps2: 2.0}, …}, gripper: [left_finger, right_finger]}",
        )
    commands = {}
    for action in (channel for channel in asked if channel in MANIPULATION):
        topic = connections[action].parts().get("")
        why, fix = None, "Correct it (docs/ros2.md, Arms), or leave the action out."
        if action == "move_end_effector":
            why = "Over ROS 2 an arm is moved by its joints: nothing here knows its kinematics."
            fix = "Leave the action out, and let the solution find the joints and move them by move_joints."
        elif topic is None or topic.ros_type not in JOINT_COMMANDS:
            why = f"It needs a ros_topic of the ros_type {' or '.join(JOINT_COMMANDS)}."
        elif "joint_states" not in connections:
            why = "Where the arm is, has to be known: there is no connections.joint_states."
        if why is not None or topic is None:
            raise BenchbotError(
                f"The robot '{robot}' cannot be driven: its declaration is wrong at 'connections.{action}'.",
                str(why),
                fix,
            )
        commands[action] = topic
    return commands
