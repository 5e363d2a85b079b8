"""The instants of a bag: messages that were taken at one time, read as the driver of the declared robot reads them."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

from benchbot.plugin import BenchbotError, Pose
from benchbot_record_mcap.bag import TYPES
from benchbot_replay.bag import Bag
from benchbot_replay.bag_place import Place

KEPT_NS = 2_000_000_000
"""How long a message may wait for those of its instant."""
WAITING = 50
"""How many instants may wait for the robot's pose at their time; the oldest is left out then."""
COMPRESSED = "sensor_msgs/msg/CompressedImage"


@dataclass(frozen=True)
class Instant:
    """What was taken at one time: the observations, the base's pose, and whether the robot has hit something."""

    stamp_ns: int
    observations: Mapping[str, Any]
    base: Pose
    collided: bool


@dataclass
class Findings:
    """What is found out on the way: channels that come compressed with loss, and how many instants have no pose."""

    lossy: set[str] = field(default_factory=set)
    without_pose: int = 0


@dataclass
class _Samples:
    """The newest messages of one topic, oldest first; of what holds until the next one, the newest."""

    topic: Any
    holds: bool
    messages: deque[Any] = field(default_factory=deque)

    def add(self, stamp_ns: int, message: Any) -> None:
        if self.holds:
            self.messages.clear()
        self.messages.append(SimpleNamespace(stamp_ns=stamp_ns, message=message))
        while self.messages and stamp_ns - self.messages[0].stamp_ns > KEPT_NS:
            self.messages.popleft()


def instants(bag: Bag, findings: Findings) -> Iterator[Instant]:
    """Yield the instants of a bag in order; raises BenchbotError for one that lacks what the task observes."""
    from rclpy.serialization import deserialize_message

    from benchbot_robot_ros2 import messages
    from benchbot_robot_ros2.declaration import Ros2Robot

    robot = Ros2Robot.from_declaration(bag.robot.data)
    channels = _channels(bag, robot)
    samples = {stream.topic.ros_topic: stream for channel in channels for stream in channel.streams.values()}
    place = Place(bag, robot)
    touch = "" if robot.settings.safety.collision is None else robot.settings.safety.collision.ros_topic
    earliest_ns, collided = 0, False
    waiting: deque[_Waiting] = deque()
    with bag.opened() as reader:
        topics = {connection.topic: connection.msgtype for connection in reader.connections}
        _require_topics(bag, topics, samples)
        place.choose(topics)
        used = [one for one in reader.connections if one.topic in {*samples, *place.topics, touch}]
        for connection, time_ns, data in reader.messages(connections=used):
            if connection.topic in place.topics:
                place.take(connection.topic, TYPES.deserialize_cdr(data, connection.msgtype))
            if connection.topic == touch:
                touched: Any = TYPES.deserialize_cdr(data, connection.msgtype)
                collided |= bool(touched.data)
            if connection.topic in samples:
                message = deserialize_message(bytes(data), messages.message_type(connection.msgtype))
                stamp_ns = messages.stamp_ns(message)
                samples[connection.topic].add(time_ns if stamp_ns is None else stamp_ns, message)
                _note_loss(channels, connection, message, findings)
                chosen = _chosen(channels, earliest_ns, robot.settings.timing.sync_tolerance_s)
                if chosen is not None:
                    now_ns = max(stamp_ns for stamp_ns, _ in chosen.values())
                    waiting.append(_Waiting(now_ns, _decoded(channels, chosen), collided))
                    earliest_ns = now_ns + max(1, round(bag.every_s * 1e9))
            yield from _placed(waiting, place, bag, findings, most=WAITING)
    yield from _placed(waiting, place, bag, findings, most=0)


@dataclass(frozen=True)
class _Waiting:
    stamp_ns: int
    seen: Mapping[str, Any]
    collided: bool


def _chosen(
    channels: Sequence[Any], earliest_ns: int, tolerance_s: float
) -> dict[Any, tuple[int, Mapping[str, Any]]] | None:
    """Return the first messages that were taken together, from a time on, by channel and part; None for none yet."""
    from benchbot_robot_ros2.instant import joined, one_instant

    streams = [stream for channel in channels for stream in channel.streams.values()]
    if not all(stream.messages for stream in streams if stream.holds):
        return None
    series = {
        channel.name: joined(
            {
                part: [one for one in stream.messages if one.stamp_ns >= earliest_ns]
                for part, stream in channel.streams.items()
                if not stream.holds
            }
        )
        for channel in channels
        if not all(stream.holds for stream in channel.streams.values())
    }
    return one_instant(cast(Any, series), round(tolerance_s * 1e9)) if series else None


def _placed(waiting: deque[_Waiting], place: Place, bag: Bag, findings: Findings, most: int) -> Iterator[Instant]:
    """Yield the instants that wait, once the pose at their time is known; leave out the oldest of more than `most`."""
    wanted = bag.task.data["observations"]
    while waiting:
        first = waiting[0]
        base = place.at(first.stamp_ns)
        if base is None and len(waiting) <= most:
            return
        waiting.popleft()
        if base is None:
            findings.without_pose += 1
            continue
        seen = {**first.seen, "poses": place.record(base)} if "poses" in wanted else first.seen
        yield Instant(first.stamp_ns, {name: seen[name] for name in wanted}, base, first.collided)


def _channels(bag: Bag, robot: Any) -> list[Any]:
    """Return the channels that the task observes with their topics; raises BenchbotError for one that is not there."""
    from benchbot_robot_ros2.observing import Channel, callback_of, frame_of
    from benchbot_robot_ros2.streams import HOLDING

    found = []
    for name in bag.task.data["observations"]:
        if name == "poses":
            continue
        if name not in robot.observations:
            raise BenchbotError(
                f"The robot '{bag.robot.name}' has no observation '{name}'.",
                f"The task '{bag.task.name}' needs it; the robot has: {', '.join(robot.observations)}.",
                "Choose another task, or declare which topic it is.",
            )
        connection = robot.observations[name]
        streams = {
            part: _Samples(topic, topic.ros_type in HOLDING or topic.ros_type == "std_msgs/msg/String")
            for part, topic in connection.parts().items()
        }
        callback = callback_of(bag.robot.name, name, connection)
        found.append(Channel(name, callback, cast(Any, streams), frame_of(name, robot)))
    return found


def _decoded(channels: Sequence[Any], chosen: Mapping[Any, tuple[int, Mapping[str, Any]]]) -> dict[str, Any]:
    seen = {}
    for channel in channels:
        held = {part: stream.messages[-1] for part, stream in channel.streams.items() if stream.holds}
        parts = {**held, **(chosen[channel.name][1] if channel.name in chosen else {})}
        seen[channel.name] = channel.decode({part: sample.message for part, sample in parts.items()})
    return seen


def _note_loss(channels: Sequence[Any], connection: Any, message: Any, findings: Findings) -> None:
    if connection.msgtype == COMPRESSED and "jpeg" in message.format.lower():
        findings.lossy.update(
            channel.name
            for channel in channels
            for stream in channel.streams.values()
            if stream.topic.ros_topic == connection.topic
        )


def _require_topics(bag: Bag, topics: Mapping[str, str], samples: Mapping[str, _Samples]) -> None:
    missing = [name for name in samples if name not in topics]
    if missing:
        raise bag.refused(
            f"The robot '{bag.robot.name}' declares topics that it does not have: {', '.join(missing)}. "
            f"It has: {', '.join(sorted(topics)) or 'none'}.",
            "Record these topics, too, correct the robot's declaration, or choose a task that observes less.",
        )
    for name, stream in samples.items():
        if topics[name] != stream.topic.ros_type:
            raise bag.refused(
                f"Its topic {name} is of the type {topics[name]}, and the robot declares {stream.topic.ros_type}.",
                "Correct the robot's declaration.",
            )
