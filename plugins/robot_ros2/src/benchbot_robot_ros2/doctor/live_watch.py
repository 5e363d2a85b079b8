"""Watching a live graph for a while: which declared topics bring messages, how often and how old."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError
from benchbot_robot_ros2 import messages, qos
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTopic, Topic
from benchbot_robot_ros2.observing import frame_of

if TYPE_CHECKING:
    from rclpy.node import Node

POLL_S = 0.05
CONTROL_RATE_HZ = 5.0


@dataclass(frozen=True)
class Use:
    """A declared topic and what it is for.

    `frame_id` is the frame that its messages must name. Feedback that comes less often than `rate_hz` is too slow.
    `optional` topics need not bring a message while they are watched.
    """

    role: str
    topic: Topic
    frame_id: str | None = None
    rate_hz: float | None = None
    optional: bool = False


@dataclass(eq=False)
class Stream:
    """The messages received on a topic: arrival times and stamps (None without one), and the last message.

    The first one came at `since_s` by `time.monotonic()`.
    """

    use: Use
    arrivals_ns: list[tuple[int, int | None]] = field(default_factory=list)
    last: Any = None
    error: BenchbotError | None = None
    since_s: float = math.inf

    @property
    def rate_hz(self) -> float | None:
        """Messages per second of the node's time, None when there are too few to tell."""
        times = [received for received, _ in self.arrivals_ns]
        if len(times) < 2 or times[-1] <= times[0]:
            return None
        return (len(times) - 1) * 1e9 / (times[-1] - times[0])

    @property
    def age_s(self) -> float | None:
        """Median of receive time minus stamp, None without stamps; negative when stamps lie in the future."""
        ages = sorted(received - stamp for received, stamp in self.arrivals_ns if stamp is not None)
        return ages[len(ages) // 2] / 1e9 if ages else None


def uses(robot: Ros2Robot) -> Iterator[Use]:
    """Yield every topic that the robot publishes according to its declaration."""
    for channel, connection in robot.observations.items():
        for part, topic in connection.parts().items():
            frame_id = frame_of(channel, robot)
            stops = channel in robot.settings.safety.obstacles or (channel == "joint_states" and robot.arm_commands)
            rate_hz = CONTROL_RATE_HZ if stops else None
            yield Use(f"{channel}.{part}" if part else channel, topic, frame_id, rate_hz)
    settings, safety = robot.settings, robot.settings.safety
    yield Use("odometry", settings.odometry, rate_hz=CONTROL_RATE_HZ)
    if isinstance(settings.localisation, LocalisedByTopic):
        where = settings.localisation
        topic = Topic(ros_topic=where.ros_topic, ros_type=where.ros_type, qos=where.qos)
        # One that is told where the robot starts may say nothing before.
        yield Use("localisation", topic, robot.global_frame, optional=settings.initial_pose is not None)
    if safety.e_stop is not None:
        # Many publish only when the button changes.
        yield Use("e_stop", safety.e_stop, optional=True)
    if safety.dead_man is not None:
        held = safety.dead_man
        yield Use("dead_man", Topic(ros_topic=held.ros_topic, ros_type=held.ros_type), rate_hz=1 / held.timeout_s)
    if safety.take_over is not None:
        hand = safety.take_over
        yield Use("take_over", Topic(ros_topic=hand.ros_topic, ros_type=hand.ros_type), rate_hz=1 / hand.timeout_s)
    if safety.collision is not None:
        yield Use("collision", safety.collision, optional=True)
    if safety.battery is not None:
        yield Use("battery", safety.battery)


def others(node: "Node", seconds: float) -> list[str]:
    """Wait at most so long for any other node, and return the full names of those that are there."""
    deadline = time.monotonic() + seconds
    while not (found := names(node)) and time.monotonic() < deadline:
        time.sleep(POLL_S)
    return found


def names(node: "Node") -> list[str]:
    """Return the full names of the other nodes that are known now."""
    full_names = (f"{namespace.rstrip('/')}/{name}" for name, namespace in node.get_node_names_and_namespaces())
    return sorted(name for name in full_names if name != node.get_fully_qualified_name())


def watch(
    node: "Node", wanted: list[Use], seconds: float, patience_s: float, enough: Callable[[list[Stream]], bool]
) -> list[Stream]:
    """Subscribe to each topic as soon as it has a publisher, and return what came in after so many seconds.

    Returns earlier when what came in is `enough`. For a first message on a topic that is published, as that of a slow
    camera, `patience_s` are waited.
    """
    streams = [Stream(use) for use in wanted]
    waiting = list(streams)
    began_s = time.monotonic()
    while (passed_s := time.monotonic() - began_s) < seconds or (passed_s < patience_s and _slow(streams, waiting)):
        if enough(streams):
            break
        waiting = [stream for stream in waiting if not _subscribed(node, stream)]
        time.sleep(POLL_S)
    return streams


def _slow(streams: list[Stream], waiting: list[Stream]) -> bool:
    heard_of = (stream for stream in streams if stream not in waiting and stream.error is None)
    return any(stream.last is None and not stream.use.optional for stream in heard_of)


def _subscribed(node: "Node", stream: Stream) -> bool:
    topic = stream.use.topic
    if not node.count_publishers(topic.ros_topic) or qos.wrong_type(node, topic):
        return False
    try:
        kind = messages.message_type(topic.ros_type)
    except BenchbotError as error:
        stream.error = error
        return True

    def received(message: Any) -> None:
        stream.since_s = min(stream.since_s, time.monotonic())
        stream.arrivals_ns.append((node.get_clock().now().nanoseconds, messages.stamp_ns(message)))
        stream.last = message

    node.create_subscription(kind, topic.ros_topic, received, qos.profile_for(node, topic))
    return True
