"""The topic of a base's velocity commands: its publisher, and its subscribers."""

from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, FailureClass
from benchbot_robot_ros2.declaration_keys import Topic
from benchbot_robot_ros2.qos import node_name
from benchbot_robot_ros2.ramp import Velocity

if TYPE_CHECKING:
    from rclpy.node import Node


class VelocityPublisher:
    """Publishes velocities, reliably, as geometry_msgs/msg/Twist or TwistStamped; only the newest counts."""

    def __init__(self, node: "Node", topic: Topic, base_frame: str) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        self._node = node
        self._topic = topic
        self._base_frame = base_frame
        self._type = message_type(topic)
        profile = QoSProfile(
            depth=1,
            reliability=ReliabilityPolicy[(topic.qos.reliability or "reliable").upper()],
            durability=DurabilityPolicy[(topic.qos.durability or "volatile").upper()],
        )
        self._publisher = node.create_publisher(self._type, topic.ros_topic, profile)

    def publish(self, velocity: Velocity) -> None:
        """Publish a velocity; a stamped one carries the node's time and the base frame."""
        message = self._type()
        twist = _twist(message)
        twist.linear.x, twist.angular.z, twist.linear.y = map(float, velocity)
        if twist is not message:
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.header.frame_id = self._base_frame
        self._publisher.publish(message)

    @property
    def heard(self) -> bool:
        """True if the topic has a subscriber."""
        return bool(self._publisher.get_subscription_count())

    def acknowledged(self, wait_s: float) -> bool:
        """Wait until all who listen reliably have acknowledged the last velocity; say whether they have."""
        from rclpy.duration import Duration

        return bool(self._publisher.wait_for_all_acked(Duration(seconds=wait_s)))

    def unheard(self, robot: str, waited_s: float) -> BenchbotError:
        """Return the error for a robot that does not listen, with the reason why."""
        name, ours = self._topic.ros_topic, self._topic.ros_type
        listeners = self._node.get_subscriptions_info_by_topic(name)
        others = sorted({f"{node_name(info)} expects {info.topic_type}" for info in listeners})
        if not listeners:
            why = f"In {waited_s:g} s no node subscribed to {name} ({ours})."
            fix = "Switch the robot's base on, see that it is in this ROS_DOMAIN_ID, and compare: ros2 topic list"
        elif all(info.topic_type != ours for info in listeners):
            why = f"BenchBot publishes {ours} on {name}, but {'; '.join(others)}."
            fix = f"Write the type that the base expects as ros_type of {name} in the robot's declaration."
        else:
            why = (
                f"The quality of service on {name} does not fit: BenchBot offers {_qos(self._publisher.qos_profile)}, "
                + "; ".join(f"{node_name(info)} asks for {_qos(info.qos_profile)}" for info in listeners)
                + "."
            )
            fix = f"Write what the base asks for in the robot's declaration, as qos of {name}."
        return BenchbotError(
            f"The robot '{robot}' does not listen to velocity commands.", why, fix, failure=FailureClass.PLATFORM
        )


def message_type(topic: Topic) -> type[Any]:
    """Return the class of a velocity topic's messages."""
    from geometry_msgs.msg import Twist, TwistStamped

    stamped = topic.ros_type == "geometry_msgs/msg/TwistStamped"
    return TwistStamped if stamped else Twist  # type: ignore[no-any-return]


def velocity_of(message: Any) -> Velocity:
    """Return the velocity that a Twist or TwistStamped commands."""
    twist = _twist(message)
    return Velocity(twist.linear.x, twist.angular.z, twist.linear.y)


def _twist(message: Any) -> Any:
    return getattr(message, "twist", message)


def _qos(profile: Any) -> str:
    reliability, durability = (getattr(profile, key).name.lower() for key in ("reliability", "durability"))
    return f"{reliability}, {durability}"
