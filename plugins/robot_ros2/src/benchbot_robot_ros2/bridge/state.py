"""Publishers of the bridged robot's state: clock, odometry, true pose, inertial measurements, collision and scans."""

from typing import TYPE_CHECKING, Any

import numpy as np

from benchbot.plugin import Pose
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.clock import SharedTime
from benchbot_robot_ros2.bridge.description import urdf
from benchbot_robot_ros2.bridge.odometry_errors import EXACT_VARIANCE, Array, exact
from benchbot_robot_ros2.bridge.pace import Rate
from benchbot_robot_ros2.bridge.robot import (
    COLLISION,
    DESCRIPTION,
    GROUND_TRUTH,
    ODOMETRY,
    BridgedRobot,
    relative,
    topics,
)
from benchbot_robot_ros2.bridge.transforms import Transforms, mounts
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.encoders import encode
from benchbot_robot_ros2.messages import message_type, pose_message, set_stamp
from benchbot_robot_ros2.ramp import Velocity

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher


class StatePublisher:
    """Publishes the state of a world after each tick; `clock` is the time to publish, None of the system's."""

    def __init__(
        self,
        node: "Node",
        robot: BridgedRobot,
        *,
        clock: SharedTime | None,
        transforms: Transforms | None,
        laser_rate_hz: float,
    ) -> None:
        self._robot, self._clock, self._transforms = robot, clock, transforms
        self._laser_rate = Rate(laser_rate_hz)
        self._scan_time_s = 1 / laser_rate_hz
        self._odometry_type = message_type("nav_msgs/msg/Odometry")
        self._bool_type = message_type("std_msgs/msg/Bool")
        self._text_type = message_type("std_msgs/msg/String")
        profile = qos.sending(depth=10)
        self._odometry = node.create_publisher(self._odometry_type, ODOMETRY, profile)
        self._truth = node.create_publisher(self._odometry_type, GROUND_TRUTH, profile)
        self._collision = node.create_publisher(self._bool_type, COLLISION, profile)
        self._description = node.create_publisher(self._text_type, DESCRIPTION, qos.latched())
        self._sensors: dict[str, Publisher[Any]] = {}
        for channel in (*robot.scanners, "imu"):
            if robot.has(channel):
                topic = topics(channel)[""]
                self._sensors[channel] = node.create_publisher(message_type(topic.ros_type), relative(topic), profile)

    def announce(self, world: World) -> None:
        """Publish what never changes."""
        poses = mounts(self._robot, world)
        self._description.publish(self._text_type(data=urdf(self._robot, poses)))
        if self._transforms:
            self._transforms.publish_mounts(world.stamp_ns, poses)

    def publish(self, world: World) -> None:
        """Publish the state of this tick."""
        robot, stamp_ns, errors = self._robot, world.stamp_ns, world.odometry_errors
        pose, odometry = world.pose(), world.odometry()
        if self._clock:
            self._clock.publish()
        measured = self._moving(stamp_ns, robot.odometry_frame, odometry, errors.velocity)
        measured.pose.covariance, measured.twist.covariance = errors.pose_covariance(), errors.twist_covariance()
        self._odometry.publish(measured)
        truth = self._moving(stamp_ns, robot.map_frame, pose, world.velocity)
        truth.pose.covariance = truth.twist.covariance = exact()
        self._truth.publish(truth)
        self._collision.publish(self._bool_type(data=world.collided))
        if self._transforms:
            self._transforms.publish(stamp_ns, pose, odometry)
        self._publish_sensors(world)

    def _publish_sensors(self, world: World) -> None:
        due = {"imu"} | (set(self._robot.scanners) if self._laser_rate.due(world.stamp_ns) else set())
        heard = [
            channel
            for channel, publisher in self._sensors.items()
            if channel in due and publisher.get_subscription_count()
        ]
        for channel, value in world.observe(heard).items() if heard else ():
            frame = self._robot.sensor_frame(channel)
            message = encode(channel, value, stamp_ns=world.stamp_ns, frame_id=frame)[""]
            if channel == "laser":
                # All its beams are of one instant: time_increment stays zero.
                message.scan_time = max(self._scan_time_s, world.control_period_s)
            elif channel == "imu":
                noise = self._robot.declaration.get("imu", {}).get("noise", {})
                message.angular_velocity_covariance = _variance(noise, "angular_velocity_sigma_radps")
                message.linear_acceleration_covariance = _variance(noise, "linear_acceleration_sigma_mps2")
            self._sensors[channel].publish(message)

    def _moving(self, stamp_ns: int, frame: str, pose: Pose, velocity: Velocity) -> Any:
        """Return a nav_msgs/msg/Odometry: the pose in `frame`, the velocity in the base's own frame."""
        message = self._odometry_type(child_frame_id=self._robot.base_frame)
        message.header.frame_id = frame
        set_stamp(message, stamp_ns)
        message.pose.pose = pose_message(pose)
        twist = message.twist.twist
        twist.linear.x, twist.angular.z, twist.linear.y = map(float, velocity)
        return message


def _variance(noise: dict[str, float], key: str) -> Array:
    """Return the covariance (9,) of a vector whose components have independent errors."""
    return np.ravel(np.eye(3) * max(float(noise.get(key, 0.0)) ** 2, EXACT_VARIANCE))
