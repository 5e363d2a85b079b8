"""ROS 2 messages: their classes by name, their stamps, and the poses in them."""

import importlib
import math
import re
from typing import Any

from ament_index_python import get_resource
from geometry_msgs import msg as geometry_msgs

from benchbot.plugin import BenchbotError, Pose, did_you_mean
from benchbot_robot_ros2 import ros

# https://design.ros2.org/articles/legacy_interface_definition.html: names of packages and of interfaces.
_TYPE = re.compile(r"([a-z](?:_?[a-z0-9])*)/msg/([A-Z][A-Za-z0-9]*)")
_NANOSECONDS = 1_000_000_000


def message_type(ros_type: str) -> type[Any]:
    """Return the class of a message type, such as `sensor_msgs/msg/Image`.

    Only packages that are registered as ROS interfaces (in ament's resource index) are imported. Raises BenchbotError
    when the name is malformed, its package is not installed or has no such message.
    """
    match = _TYPE.fullmatch(ros_type)
    if match is None:
        package, _, name = ros_type.partition("/")
        guess = f"{package}/msg/{name.rpartition('/')[2]}"
        hint = f" Did you mean '{guess}'?" if _TYPE.fullmatch(guess) else ""
        raise BenchbotError(
            f"'{ros_type}' is not the name of a ROS 2 message type.",
            f"A message type is written package/msg/Name.{hint}",
            "Correct the ros_type in the robot's declaration; on the robot, 'ros2 topic list -t' prints the types.",
        )
    package, name = match.groups()
    known = _messages_of(package)
    if name not in known:
        raise BenchbotError(
            f"There is no message type '{ros_type}'.",
            f"The installed package {package} has no message {name}.{did_you_mean(name, known)}",
            f"Correct the ros_type; the messages of {package}: {', '.join(known) or 'none'}.",
        )
    try:
        found: type[Any] = getattr(importlib.import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError) as error:
        raise BenchbotError(
            f"The message type '{ros_type}' is installed, but Python cannot load it.",
            f"{error}.",
            "Install it for this Python, or start this Python with the ROS 2 installation sourced that has it.",
        ) from error
    return found


def _messages_of(package: str) -> list[str]:
    ros.prepare()
    try:
        content, _ = get_resource("rosidl_interfaces", package)
    except LookupError as error:
        debian = f"ros-jazzy-{package.replace('_', '-')}"
        raise BenchbotError(
            f"The ROS 2 package {package} is not installed.",
            f"No message of it can be used: the resource index of AMENT_PREFIX_PATH does not list {package}.",
            f"pip install {debian}, or where PyPI does not have it: apt install {debian}, and source /opt/ros/jazzy.",
        ) from error
    return sorted(line[4:-4] for line in content.split() if line.startswith("msg/") and line.endswith(".msg"))


def stamp_ns(message: Any) -> int | None:
    """Return a message's time in nanoseconds, from its header; None when it has no header."""
    header = getattr(message, "header", None)
    return None if header is None else int(header.stamp.sec) * _NANOSECONDS + int(header.stamp.nanosec)


def set_stamp(message: Any, ns: int) -> None:
    """Write a time in nanoseconds into the header of a message that has one."""
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, _NANOSECONDS)


def pose_of(message: Any) -> Pose:
    """Return the pose in a geometry_msgs Pose or Transform, its quaternion normalised.

    Raises ValueError when a number is not finite or the quaternion is no rotation.
    """
    if isinstance(message, geometry_msgs.Transform):
        place, turn = message.translation, message.rotation
    else:
        place, turn = message.position, message.orientation
    xyz, quaternion = (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)
    norm = math.hypot(*quaternion)
    if not (all(map(math.isfinite, xyz)) and 0 < norm < math.inf):
        raise ValueError(f"the position {xyz} with the quaternion xyzw {quaternion} is no pose")
    x, y, z, w = (value / norm for value in quaternion)
    return Pose(xyz, (x, y, z, w))


def pose_message(pose: Pose) -> Any:
    """Return a geometry_msgs/msg/Pose."""
    x, y, z = map(float, pose.translation_xyz)
    return geometry_msgs.Pose(position=geometry_msgs.Point(x=x, y=y, z=z), orientation=_quaternion(pose))


def transform_message(pose: Pose) -> Any:
    """Return a geometry_msgs/msg/Transform."""
    x, y, z = map(float, pose.translation_xyz)
    return geometry_msgs.Transform(translation=geometry_msgs.Vector3(x=x, y=y, z=z), rotation=_quaternion(pose))


def _quaternion(pose: Pose) -> Any:
    x, y, z, w = map(float, pose.rotation_xyzw)
    return geometry_msgs.Quaternion(x=x, y=y, z=z, w=w)
