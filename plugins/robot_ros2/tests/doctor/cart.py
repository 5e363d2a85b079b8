"""A robot on real DDS for the tests of its diagnosis, and the diagnosis of it."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image, Joy, LaserScan
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from benchbot.core.findings import Finding, Level
from benchbot.core.platform import PlatformSpec
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.doctor import diagnosis

CART = """\
name: cart
type: ros2
global_frame: map
robot_frame: base_link
poses: [base_link, camera_optical, lidar]
frames:
  camera_optical: {xyz: [0.1, 0, 1], rpy_deg: [-90, 0, -90]}
  lidar: {xyz: [0, 0, 0.3]}
camera: {frame: camera_optical}
laser: {frame: lidar}
footprint: {radius_m: 0.2}
connections:
  image_rgb: {connection: ros_to_api, ros_topic: /camera/image_raw, ros_type: sensor_msgs/msg/Image}
  image_rgb_info: {connection: ros_to_api, ros_topic: /camera/camera_info, ros_type: sensor_msgs/msg/CameraInfo}
  laser: {connection: ros_to_api, ros_topic: /scan, ros_type: sensor_msgs/msg/LaserScan}
  poses: {connection: ros_to_api}
  move_angle: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/Twist}
driver:
  odometry: {ros_topic: /odom, ros_type: nav_msgs/msg/Odometry}
  return_to_start: {by: service, ros_service: /reset}
  safety: {e_stop: {ros_topic: /e_stop, ros_type: std_msgs/msg/Bool}}
"""
SECONDS, TICK_S = 1.0, 0.05


class Cart:
    """A robot that publishes at 20 Hz; what it does is changed before it starts."""

    def __init__(self) -> None:
        self.types: dict[str, Any] = {
            "/camera/image_raw": Image,
            "/camera/camera_info": CameraInfo,
            "/scan": LaserScan,
            "/odom": Odometry,
            "/e_stop": Bool,
        }
        self.qos: dict[str, QoSProfile] = {}
        self.stamp_offset_s = 0.0
        self.stamp_drift = 0.0  # seconds for each second
        self.encoding = "rgb8"
        self.laser_frame = "lidar"
        self.pressed = False
        self.silent: set[str] = set()
        self.every: dict[str, int] = {}  # ticks between two messages
        self.listens: dict[str, Any] = {"/cmd_vel": Twist}
        self.services = ["/reset"]
        self.also: dict[str, Any] = {}
        self.transforms = False
        self.ticks = self.heard_ticks = 0
        # What is done to the robot's node so many ticks of 0.05 s after somebody listens to its odometry.
        self.later: dict[int, Callable[[Node], Any]] = {}

    @contextlib.contextmanager
    def running(self) -> Iterator[Node]:
        with ros.running_node("cart") as node:
            for name, kind in self.listens.items():
                node.create_subscription(kind, name, lambda _: None, 1)
            for name in self.services:
                node.create_service(Trigger, name, lambda _, response: response)
            for name, kind in self.also.items():
                node.create_publisher(kind, name, 1)
            publishers = {
                name: node.create_publisher(kind, name, self.qos.get(name, 1)) for name, kind in self.types.items()
            }
            if self.transforms:
                tell_mounts(node)

            def tick() -> None:
                self.ticks += 1
                self.heard_ticks += bool(node.count_subscribers("/odom"))
                if (change := self.later.pop(self.heard_ticks, None)) is not None:
                    change(node)
                for name, publisher in publishers.items():
                    if name not in self.silent and self.ticks % self.every.get(name, 1) == 0:
                        publisher.publish(self.message(node, self.types[name]))

            node.create_timer(TICK_S, tick)
            yield node

    def message(self, node: Node, kind: Any) -> Any:
        message = kind()
        if hasattr(message, "header"):
            drift_s = self.stamp_drift * self.ticks * TICK_S
            stamp_ns = node.get_clock().now().nanoseconds + int((self.stamp_offset_s + drift_s) * 1e9)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        if kind is Image:
            message.header.frame_id = "camera_optical"
            message.width, message.height, message.step, message.encoding = 8, 6, 24, self.encoding
            message.data = bytes(8 * 6 * 3)
        elif kind is CameraInfo:
            message.header.frame_id = "camera_optical"
            message.width, message.height = 8, 6
            message.k = [8.0, 0.0, 4.0, 0.0, 8.0, 3.0, 0.0, 0.0, 1.0]
            message.p = [8.0, 0.0, 4.0, 0.0, 0.0, 8.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        elif kind is LaserScan:
            message.header.frame_id = self.laser_frame
            message.angle_min, message.angle_max, message.angle_increment = -3.14, 3.14, 0.0628
            message.range_min, message.range_max, message.ranges = 0.1, 10.0, [2.0] * 101
        elif kind is Odometry:
            message.header.frame_id, message.child_frame_id = "odom", "base_link"
        elif kind is Joy:
            message.buttons = [1, 0]
        elif kind is Bool:
            message.data = self.pressed
        return message


def tell_mounts(node: Node) -> None:
    """Publish the cart's mounts as they are declared."""
    told = []
    for name, xyz, rotation in (
        ("camera_optical", (0.1, 0.0, 1.0), (-0.5, 0.5, -0.5, 0.5)),
        ("lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)),
    ):
        one = TransformStamped(child_frame_id=name)
        one.header.frame_id = "base_link"
        where = one.transform
        where.translation.x, where.translation.y, where.translation.z = xyz
        where.rotation.x, where.rotation.y, where.rotation.z, where.rotation.w = rotation
        told.append(one)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(TFMessage, "/tf_static", latched).publish(TFMessage(transforms=told))


def examine(changes: dict[str, Any] | None = None, seconds: float = SECONDS) -> dict[str, list[Finding]]:
    """Return the findings by subject; what is wrong always comes with a fix."""
    declaration = yaml.safe_load(CART)
    declaration["driver"].update((changes or {}).get("driver", {}))
    declaration["stops_before_contact"] = (changes or {}).get("stops_before_contact", False)
    spec = PlatformSpec(declaration, "ground_truth", Path("unused"), {"seconds": seconds})
    findings: dict[str, list[Finding]] = {}
    for finding in diagnosis.diagnose(spec):
        assert finding.level is Level.OK or finding.fix, finding
        findings.setdefault(finding.subject, []).append(finding)
    return findings


def worst(findings: list[Finding]) -> Finding:
    return max(findings, key=lambda finding: list(Level).index(finding.level))


def broken(findings: dict[str, list[Finding]]) -> list[str]:
    return [finding.subject for group in findings.values() for finding in group if finding.level is Level.BROKEN]
