"""Quality of service: subscriptions that fit what is published, and words for those that cannot."""

from typing import TYPE_CHECKING, Any

from benchbot_robot_ros2.declaration_keys import Topic

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.qos import QoSProfile

# rmw's own name for endpoints that no node has announced.
_UNKNOWN = "_NODE_NAME_UNKNOWN_"
UNNAMED = "(name unknown)"


def publishers(node: "Node", topic: Topic) -> list[Any]:
    """Return the graph's current publishers of a topic (rclpy's TopicEndpointInfo)."""
    return list(node.get_publishers_info_by_topic(topic.ros_topic))


def profile_for(node: "Node", topic: Topic) -> "QoSProfile":
    """Return the profile to subscribe a topic with: the declared one, and what is not declared matched to publishers.

    Best effort when a publisher offers no more, transient local when all of them keep their last messages for those who
    come late. Without a publisher the most modest profile, which every publisher satisfies
    (https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Quality-of-Service-Settings.html, compatibilities).
    """
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    offered = [info.qos_profile for info in publishers(node, topic) if info.topic_type == topic.ros_type]
    reliable = bool(offered) and all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in offered)
    kept = bool(offered) and all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in offered)
    reliability = topic.qos.reliability or ("reliable" if reliable else "best_effort")
    durability = topic.qos.durability or ("transient_local" if kept else "volatile")
    return QoSProfile(
        depth=topic.qos.depth,
        reliability=ReliabilityPolicy[reliability.upper()],
        durability=DurabilityPolicy[durability.upper()],
    )


def mismatch(node: "Node", topic: Topic, profile: "QoSProfile") -> str | None:
    """Say which publisher a subscription with `profile` hears nothing of, and why; None when it hears them all."""
    from rclpy.qos import QoSCompatibility, qos_check_compatible

    for info in publishers(node, topic):
        if info.topic_type != topic.ros_type:
            continue
        offered = info.qos_profile
        compatibility, reason = qos_check_compatible(offered, profile)
        if compatibility != QoSCompatibility.ERROR:
            continue
        differing = [
            f"{policy} {getattr(offered, policy).name.lower()}, "
            f"but {policy} {getattr(profile, policy).name.lower()} is asked for"
            for policy in ("reliability", "durability")
            if policy in _lacking(offered, profile)
        ]
        return f"the node {node_name(info)} publishes it with {' and '.join(differing) or f'other QoS ({reason})'}"
    return None


def wrong_type(node: "Node", topic: Topic) -> str | None:
    """Say which node publishes a topic as another type; None when there is no publisher, or one of the right type."""
    found = publishers(node, topic)
    if not found or any(info.topic_type == topic.ros_type for info in found):
        return None
    return f"the node {node_name(found[0])} publishes it as {found[0].topic_type}, not as {topic.ros_type}"


def node_name(info: Any) -> str:
    """Return the full name of an endpoint's node; what is not a ROS node, or not known yet, has none."""
    if info.node_name == _UNKNOWN:
        return UNNAMED
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def _lacking(offered: "QoSProfile", asked: "QoSProfile") -> set[str]:
    from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

    lacking = set()
    if asked.reliability == ReliabilityPolicy.RELIABLE and offered.reliability != ReliabilityPolicy.RELIABLE:
        lacking.add("reliability")
    if asked.durability == DurabilityPolicy.TRANSIENT_LOCAL and offered.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        lacking.add("durability")
    return lacking


def sending(depth: int) -> "QoSProfile":
    """Return the quality of service of what is sent: reliable, since that serves every subscriber.

    A best-effort publisher is not heard by those that ask for reliability, such as RViz and Nav2's by default.
    """
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE)


def latched() -> "QoSProfile":
    """Return the quality of service of what is sent once, to those who come late, too."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    return QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
