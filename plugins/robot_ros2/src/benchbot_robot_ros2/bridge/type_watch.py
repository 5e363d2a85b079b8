"""What keeps other nodes from hearing the bridge, or the bridge them: told once, as soon as the graph shows it."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.clock import CLOCK, SharedTime
from benchbot_robot_ros2.bridge.robot import (
    COMMAND,
    COMPRESSED_TYPE,
    BridgedRobot,
    compressed_topics,
    relative,
    topics,
)

if TYPE_CHECKING:
    from rclpy.node import Node

TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")


class TypeWatch:
    """Looks for nodes that use the bridge's topics with other types, its name or its clock."""

    def __init__(
        self, node: "Node", robot: BridgedRobot, tell: Callable[[str], None], clock: SharedTime | None = None
    ) -> None:
        self._node, self._robot, self._tell, self._clock = node, robot, tell, clock
        self._told: set[str] = set()
        self._published = {publisher.topic_name: _type_name(publisher.msg_type) for publisher in node.publishers}
        for channel in robot.pictures:
            for topic in topics(channel).values():
                self._published[node.resolve_topic_name(relative(topic))] = topic.ros_type
        for name in compressed_topics(robot).values():
            self._published[node.resolve_topic_name(name)] = COMPRESSED_TYPE

    def look(self) -> None:
        """Tell what was not told yet."""
        for line in (*self._names(), *self._clocks(), *self._commands(), *self._listeners()):
            if line not in self._told:
                self._told.add(line)
                self._tell(line)

    def _names(self) -> Iterator[str]:
        ours = self._node.get_name(), self._node.get_namespace()
        if self._node.get_node_names_and_namespaces().count(ours) > 1:
            yield (
                f"Another node is called {self._node.get_fully_qualified_name()}, too. Two bridges of one name obey "
                "the same velocities and publish on the same topics: start one with --namespace NAME, or in another "
                "ROS_DOMAIN_ID."
            )

    def _clocks(self) -> Iterator[str]:
        found = [qos.node_name(info) for info in self._node.get_publishers_info_by_topic(CLOCK)]
        if self._clock and self._clock.follows:
            yield f"Another node publishes {CLOCK}: this robot's time is that."
            if not found:
                yield f"No node publishes {CLOCK} any more: this robot's time stands still. Start its bridge again."
        elif self._clock:
            for name in sorted({*found} - {self._node.get_fully_qualified_name()}):
                yield (
                    f"The node {name} publishes {CLOCK}, and this bridge does: time jumps for all who use it. End one "
                    "of the two; a bridge that is started second follows the first."
                )

    def _commands(self) -> Iterator[str]:
        name, ours = self._node.resolve_topic_name(COMMAND), self._robot.command_type
        for info in self._node.get_publishers_info_by_topic(name):
            if info.topic_type == ours:
                continue
            option = "without --stamped" if self._robot.stamped else "with --stamped"
            start = f"Start the bridge {option}, or let" if info.topic_type in TWISTS else "Let"
            yield (
                f"The node {qos.node_name(info)} publishes {info.topic_type} on {name}, and this bridge obeys {ours}: "
                f"the robot does not hear it. {start} the node publish {ours} (Nav2's parameter: "
                f"enable_stamped_cmd_vel: {str(self._robot.stamped).lower()})."
            )

    def _listeners(self) -> Iterator[str]:
        for name, ours in self._published.items():
            for info in self._node.get_subscriptions_info_by_topic(name):
                if info.topic_type != ours:
                    yield (
                        f"The node {qos.node_name(info)} expects {info.topic_type} on {name}, and this bridge "
                        f"publishes {ours}: the node hears nothing. Let it subscribe to {ours}, or to another topic."
                    )


def _type_name(message_type: type[Any]) -> str:
    return f"{message_type.__module__.partition('.')[0]}/msg/{message_type.__name__}"
