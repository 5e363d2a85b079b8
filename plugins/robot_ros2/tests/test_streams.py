import contextlib
import itertools
import sys
import threading
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String

from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration_keys import Qos, Topic
from benchbot_robot_ros2.messages import set_stamp
from benchbot_robot_ros2.robot_clock import RobotClock
from benchbot_robot_ros2.streams import Stream
from plugins.robot_ros2.tests.unicycle import until

if TYPE_CHECKING:
    from rclpy.node import Node

POSE = Topic(ros_topic="/pose", ros_type="geometry_msgs/msg/PoseStamped")
TEXT = Topic(ros_topic="/text", ros_type="std_msgs/msg/String")


class Listening:
    def __init__(self, node: "Node") -> None:
        self.node = node
        self.changed = threading.Condition()
        self.clock = RobotClock(node, simulated=False, changed=self.changed)

    def stream(self, topic: Topic, **options: Any) -> Stream:
        return Stream(self.node, topic, self.clock, self.changed, **options)


@pytest.fixture
def robot(domain: int) -> Iterator["Node"]:
    with ros.running_node("robot") as node:
        yield node


@pytest.fixture
def listening(domain: int) -> Iterator[Listening]:
    with ros.running_node("listener") as node:
        yield Listening(node)


def _pose(stamp_s: float) -> PoseStamped:
    message = PoseStamped()
    set_stamp(message, round(stamp_s * 1e9))
    return message


def _heard(stream: Stream, publisher: Any) -> None:
    """Publish until a message arrives, so that later ones arrive, too."""
    for number in itertools.count(1):
        publisher.publish(_pose(number / 1000) if stream.topic == POSE else String(data="probe"))
        with contextlib.suppress(AssertionError):
            until(lambda: stream.newest is not None, 0.1)
            break
    stream.forget()


def _stamps(stream: Stream) -> list[float]:
    return [sample.stamp_ns / 1e9 for sample in stream.samples]


def test_the_last_second_is_kept_by_stamp(robot: "Node", listening: Listening) -> None:
    told: list[Any] = []
    stream = listening.stream(POSE, told=told.append)
    publisher = robot.create_publisher(PoseStamped, "/pose", 10)
    assert (stream.newest, stream.age_s) == (None, float("inf"))
    until(lambda: stream.silence() == "the node /robot publishes it, but sends nothing")
    until(lambda: stream.reliability == "reliable")
    _heard(stream, publisher)
    told.clear()

    for stamp_s in (10.0, 10.5, 10.25, 11.0, 11.25):
        publisher.publish(_pose(stamp_s))
    until(lambda: _stamps(stream)[-1:] == [11.25])

    assert _stamps(stream) == [10.5, 11.0, 11.25]
    # Contact counts, whatever its stamp.
    assert len(told) == 5
    assert stream.age_s < 30.0

    publisher.publish(_pose(11.25))
    until(lambda: stream.silence().endswith("the stamps of its messages do not advance"))

    stream.forget()
    assert stream.samples == []
    # A clock that was set back makes no difference to what comes after.
    publisher.publish(_pose(3.0))
    until(lambda: _stamps(stream) == [3.0])


def test_a_message_without_a_stamp_is_of_its_arrival_and_holds(robot: "Node", listening: Listening) -> None:
    stream = listening.stream(TEXT)
    publisher = robot.create_publisher(String, "/text", 10)
    _heard(stream, publisher)
    before_ns = listening.clock.now_ns()

    for text in ("a", "b"):
        publisher.publish(String(data=text))
    until(lambda: stream.newest is not None and stream.newest.message.data == "b")

    (sample,) = stream.samples
    assert sample.stamp_ns == sample.arrived_ns >= before_ns
    assert stream.holds
    stream.forget()
    assert stream.newest is not None


def test_what_was_published_before_is_heard_where_it_is_kept(robot: "Node", listening: Listening) -> None:
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    robot.create_publisher(CameraInfo, "/info", kept).publish(CameraInfo(width=7))

    stream = listening.stream(Topic(ros_topic="/info", ros_type="sensor_msgs/msg/CameraInfo"))

    until(lambda: stream.newest is not None and stream.newest.message.width == 7)


def test_it_subscribes_anew_when_a_publisher_offers_less(robot: "Node", listening: Listening) -> None:
    stream = listening.stream(POSE)
    reliable = robot.create_publisher(PoseStamped, "/pose", 10)
    until(lambda: reliable.get_subscription_count() > 0)
    until(lambda: stream.heard() and stream.reliability == "reliable")

    modest = robot.create_publisher(
        PoseStamped, "/pose", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    until(lambda: stream.reliability == "best_effort" and modest.get_subscription_count() > 0)

    _heard(stream, modest)
    modest.publish(_pose(1.0))
    until(lambda: _stamps(stream) == [1.0])


def test_a_closed_stream_hears_nothing_until_it_is_opened(robot: "Node", listening: Listening) -> None:
    stream = listening.stream(POSE)
    publisher = robot.create_publisher(PoseStamped, "/pose", 10)
    until(lambda: publisher.get_subscription_count() == 1)

    stream.close()
    until(lambda: publisher.get_subscription_count() == 0)

    stream.open()
    _heard(stream, publisher)
    publisher.publish(_pose(1.0))
    until(lambda: _stamps(stream) == [1.0])


def test_silence_says_why(robot: "Node", listening: Listening) -> None:
    strict = Topic(ros_topic="/pose", ros_type=POSE.ros_type, qos=Qos(reliability="reliable"))
    stream = listening.stream(strict)
    assert stream.silence() == "nobody publishes it"
    assert not stream.heard()

    robot.create_publisher(PoseStamped, "/pose", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    until(lambda: stream.silence() != "nobody publishes it")
    assert "best_effort" in stream.silence()
    assert not stream.heard()


def test_others_are_heard_while_streams_are_closed_and_opened_on_a_busy_machine(
    robot: "Node", listening: Listening, request: pytest.FixtureRequest
) -> None:
    # Threads take turns all the time, so that one meets another in the midst of anything.
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-5)
    kept = listening.stream(TEXT)
    publisher = robot.create_publisher(String, "/text", 10)
    others = [listening.stream(Topic(ros_topic=f"/other_{n}", ros_type=TEXT.ros_type)) for n in range(8)]
    for _ in range(60):
        for stream in others:
            stream.close()
        for stream in others:
            stream.open()

    def is_heard() -> bool:
        publisher.publish(String(data="still there"))
        return kept.age_s < float("inf")

    until(is_heard)


def test_a_node_is_left_in_peace_while_messages_arrive(
    robot: "Node", request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-5)
    died: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", died.append)
    publisher = robot.create_publisher(String, "/text", 10)
    for number in range(20):
        with ros.running_node(f"listener_{number}") as node:
            heard = threading.Event()
            node.create_subscription(String, "/text", lambda _, heard=heard: heard.set(), 10)

            def is_heard(heard: threading.Event = heard) -> bool:
                for _ in range(10):
                    publisher.publish(String(data="again"))
                return heard.is_set()

            until(is_heard)
    assert died == []
