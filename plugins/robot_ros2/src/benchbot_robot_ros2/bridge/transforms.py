"""The robot's transforms as REP-105 has them: map -> odom -> base, and its frames below the base."""

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from benchbot.plugin import Pose
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.robot import BASE_FOOTPRINT, BridgedRobot
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.messages import message_type, set_stamp, transform_message

if TYPE_CHECKING:
    from rclpy.node import Node


def transforms_installed() -> bool:
    """Return whether tf2_msgs is there; PyPI does not have it, a ROS 2 installation does."""
    try:
        importlib.import_module("tf2_msgs.msg")
    except ImportError:
        return False
    return True


def mounts(robot: BridgedRobot, world: World) -> dict[str, Pose]:
    """Return the poses of the robot's frames on its base by their names in ROS 2, as the simulator has them.

    The base's projection on the floor (REP-120, `base_footprint`), by which AMCL and slam_toolbox know a robot unless
    they are told otherwise, is the base itself: that of a simulated robot is on the floor.
    """
    base = robot.declaration["robot_frame"]
    found = {BASE_FOOTPRINT: Pose()}
    for frame, mount in robot.declaration.get("frames", {}).items():
        found[frame] = Pose.from_xyz_rpy_deg(mount["xyz"], mount.get("rpy_deg", (0.0, 0.0, 0.0)))
    if robot.has("poses"):
        to_base = world.pose().inverse()
        for frame, record in world.observe(["poses"])["poses"].items():
            found[frame] = to_base @ Pose(tuple(record["translation_xyz"]), tuple(record["rotation_xyzw"]))
    return {robot.frame(frame): pose for frame, pose in found.items() if frame not in (base, "initial_pose")}


class Transforms:
    """Publishes transforms; that of the map to odometry only where nobody else localises the robot."""

    def __init__(self, node: "Node", robot: BridgedRobot, *, map_transform: bool) -> None:
        from rclpy.qos import QoSProfile

        self._robot, self._map_transform = robot, map_transform
        self._type = importlib.import_module("tf2_msgs.msg").TFMessage
        self._transform_type = message_type("geometry_msgs/msg/TransformStamped")
        moving, static = robot.transform_topics
        # What tf2_ros's broadcasters use.
        self._moving = node.create_publisher(self._type, moving, QoSProfile(depth=100))
        self._static = node.create_publisher(self._type, static, qos.latched())

    def publish_mounts(self, stamp_ns: int, poses: Mapping[str, Pose]) -> None:
        """Publish where the robot's frames are on its base."""
        base = self._robot.base_frame
        transforms = [self._transform(stamp_ns, base, frame, pose) for frame, pose in poses.items()]
        self._static.publish(self._type(transforms=transforms))

    def publish(self, stamp_ns: int, pose: Pose, odometry: Pose) -> None:
        """Publish the base's pose by odometry, and the drift of odometry."""
        robot = self._robot
        travelled = self._transform(stamp_ns, robot.odometry_frame, robot.base_frame, odometry)
        transforms = [travelled]
        if self._map_transform:
            drift = pose @ odometry.inverse()
            transforms.insert(0, self._transform(stamp_ns, robot.map_frame, robot.odometry_frame, drift))
        self._moving.publish(self._type(transforms=transforms))

    def _transform(self, stamp_ns: int, parent: str, child: str, pose: Pose) -> Any:
        message = self._transform_type(child_frame_id=child, transform=transform_message(pose))
        message.header.frame_id = parent
        set_stamp(message, stamp_ns)
        return message
