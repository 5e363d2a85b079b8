"""Publishers of the bridged robot's state: clock, odometry, true pose, transforms, collision and scans."""

import importlib
from typing import TYPE_CHECKING, Any

from benchbot.plugin import Pose
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.pace import Rate
from benchbot_robot_ros2.bridge.robot import (
    COLLISION,
    GROUND_TRUTH,
    ODOMETRY,
    ODOMETRY_FRAME,
    BridgedRobot,
    relative,
    topics,
)
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import message_type, pose_message, set_stamp, transform_message

if TYPE_CHECKING:
    from rclpy.node import Node


class StatePublisher:
    """Publishes the state of a world after each tick; `simulated` time goes to /clock."""

    def __init__(self, node: "Node", robot: BridgedRobot, *, simulated: bool, laser_rate_hz: float) -> None:
        self._robot = robot
        self._laser_rate = Rate(laser_rate_hz)
        self._odometry_type = message_type("nav_msgs/msg/Odometry")
        self._bool_type = message_type("std_msgs/msg/Bool")
        self._clock_type = message_type("rosgraph_msgs/msg/Clock")
        profile = qos.sending(depth=10)
        self._odometry = node.create_publisher(self._odometry_type, ODOMETRY, profile)
        self._truth = node.create_publisher(self._odometry_type, GROUND_TRUTH, profile)
        self._collision = node.create_publisher(self._bool_type, COLLISION, profile)
        self._clock = node.create_publisher(self._clock_type, "/clock", profile) if simulated else None
        self._scans = {}
        for channel in robot.scanners:
            topic = topics(channel)[""]
            self._scans[channel] = node.create_publisher(message_type(topic.ros_type), relative(topic), profile)
        self._transforms = Transforms(node, robot) if transforms_installed() else None

    def announce(self, world: World) -> None:
        """Publish what never changes."""
        if self._transforms:
            self._transforms.publish_mounts(world)

    def publish(self, world: World) -> None:
        """Publish the state of this tick."""
        robot, stamp_ns = self._robot, world.stamp_ns
        pose, odometry = world.pose(), world.odometry()
        if self._clock:
            clock = self._clock_type()
            clock.clock.sec, clock.clock.nanosec = divmod(stamp_ns, 1_000_000_000)
            self._clock.publish(clock)
        self._odometry.publish(self._moving(stamp_ns, ODOMETRY_FRAME, odometry, world.velocity))
        self._truth.publish(self._moving(stamp_ns, robot.map_frame, pose, world.velocity))
        self._collision.publish(self._bool_type(data=world.collided))
        if self._transforms:
            self._transforms.publish(stamp_ns, pose, odometry)
        if self._scans and self._laser_rate.due(stamp_ns):
            heard = [channel for channel, scans in self._scans.items() if scans.get_subscription_count()]
            for channel, scan in world.observe(heard).items():
                message = encode(channel, scan, stamp_ns=stamp_ns, frame_id=robot.scanner_frame(channel))[""]
                self._scans[channel].publish(message)

    def _moving(self, stamp_ns: int, frame: str, pose: Pose, velocity: tuple[float, float]) -> Any:
        """Return a nav_msgs/msg/Odometry: the pose in `frame`, the velocity in the base's own frame."""
        message = self._odometry_type(child_frame_id=self._robot.base_frame)
        message.header.frame_id = frame
        set_stamp(message, stamp_ns)
        message.pose.pose = pose_message(pose)
        message.twist.twist.linear.x, message.twist.twist.angular.z = map(float, velocity)
        return message


def transforms_installed() -> bool:
    """Return whether tf2_msgs is there; PyPI does not have it, a ROS 2 installation does."""
    try:
        importlib.import_module("tf2_msgs.msg")
    except ImportError:
        return False
    return True


class Transforms:
    """The robot's transforms as REP-105 has them: map -> odom -> base, and its frames below the base."""

    def __init__(self, node: "Node", robot: BridgedRobot) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile

        self._robot = robot
        self._type = importlib.import_module("tf2_msgs.msg").TFMessage
        self._transform_type = message_type("geometry_msgs/msg/TransformStamped")
        # What tf2_ros's broadcasters use.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._static = node.create_publisher(self._type, "/tf_static", latched)
        self._moving = node.create_publisher(self._type, "/tf", QoSProfile(depth=100))

    def publish_mounts(self, world: World) -> None:
        """Publish where the robot's frames are on its base, as the simulator has them."""
        base = self._robot.base_frame
        if not self._robot.has_poses:
            return
        poses = {
            frame: Pose(tuple(record["translation_xyz"]), tuple(record["rotation_xyzw"]))
            for frame, record in world.observe(["poses"])["poses"].items()
        }
        to_base = world.pose().inverse()
        mounts = [
            self._transform(world.stamp_ns, base, frame, to_base @ pose)
            for frame, pose in poses.items()
            if frame not in (base, "initial_pose")
        ]
        self._static.publish(self._type(transforms=mounts))

    def publish(self, stamp_ns: int, pose: Pose, odometry: Pose) -> None:
        """Publish the base's pose by odometry, and the drift of odometry."""
        robot = self._robot
        drift = self._transform(stamp_ns, robot.map_frame, ODOMETRY_FRAME, pose @ odometry.inverse())
        travelled = self._transform(stamp_ns, ODOMETRY_FRAME, robot.base_frame, odometry)
        self._moving.publish(self._type(transforms=[drift, travelled]))

    def _transform(self, stamp_ns: int, parent: str, child: str, pose: Pose) -> Any:
        message = self._transform_type(child_frame_id=child, transform=transform_message(pose))
        message.header.frame_id = parent
        set_stamp(message, stamp_ns)
        return message
