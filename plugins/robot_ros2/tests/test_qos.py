from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool, String

from benchbot_robot_ros2 import qos, ros
from benchbot_robot_ros2.declaration_keys import Qos, Topic
from plugins.robot_ros2.tests.unicycle import until

if TYPE_CHECKING:
    from rclpy.node import Node

TEXT = Topic(ros_topic="/text", ros_type="std_msgs/msg/String")
RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
KEPT, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE


@pytest.fixture
def node(domain: int) -> Iterator["Node"]:
    with ros.running_node("listener") as node:
        yield node


def _publish(node: "Node", *offers: tuple[ReliabilityPolicy, DurabilityPolicy], kind: type = String) -> None:
    for reliability, durability in offers:
        node.create_publisher(kind, "/text", QoSProfile(depth=1, reliability=reliability, durability=durability))
    until(lambda: len(qos.publishers(node, TEXT)) == len(offers))


@pytest.mark.parametrize(
    ("offers", "expected"),
    [
        ([], (BEST_EFFORT, VOLATILE)),
        ([(RELIABLE, VOLATILE)], (RELIABLE, VOLATILE)),
        ([(BEST_EFFORT, VOLATILE)], (BEST_EFFORT, VOLATILE)),
        ([(RELIABLE, KEPT)], (RELIABLE, KEPT)),
        ([(RELIABLE, KEPT), (BEST_EFFORT, VOLATILE)], (BEST_EFFORT, VOLATILE)),
        ([(RELIABLE, KEPT), (RELIABLE, VOLATILE)], (RELIABLE, VOLATILE)),
    ],
)
def test_a_profile_hears_every_publisher(
    node: "Node",
    offers: list[tuple[ReliabilityPolicy, DurabilityPolicy]],
    expected: tuple[ReliabilityPolicy, DurabilityPolicy],
) -> None:
    _publish(node, *offers)

    profile = qos.profile_for(node, TEXT)

    assert (profile.reliability, profile.durability) == expected
    assert profile.depth == 5
    assert qos.mismatch(node, TEXT, profile) is None


def test_what_is_declared_is_kept_and_named_when_it_does_not_fit(node: "Node") -> None:
    _publish(node, (BEST_EFFORT, VOLATILE))
    asked = Topic(
        ros_topic="/text",
        ros_type="std_msgs/msg/String",
        qos=Qos(reliability="reliable", durability="transient_local", depth=2),
    )

    profile = qos.profile_for(node, asked)

    assert (profile.reliability, profile.durability, profile.depth) == (RELIABLE, KEPT, 2)
    assert qos.mismatch(node, asked, profile) == (
        "the node /listener publishes it with reliability best_effort, but reliability reliable is asked for "
        "and durability volatile, but durability transient_local is asked for"
    )


def test_another_type_is_named(node: "Node") -> None:
    assert qos.wrong_type(node, TEXT) is None
    _publish(node, (RELIABLE, VOLATILE), kind=Bool)

    assert (
        qos.wrong_type(node, TEXT) == "the node /listener publishes it as std_msgs/msg/Bool, not as std_msgs/msg/String"
    )
    assert qos.mismatch(node, TEXT, qos.profile_for(node, TEXT)) is None
