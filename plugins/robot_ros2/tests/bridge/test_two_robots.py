"""Two bridged robots in one domain: neither obeys the other's velocities, no frame is both's, and there is one time."""

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from typing import Any

import pytest
from rclpy.executors import SingleThreadedExecutor
from tf2_msgs.msg import TFMessage

from benchbot_robot_ros2 import qos, ros
from benchbot_robot_ros2.bridge.clock import SharedTime
from benchbot_robot_ros2.bridge.pace import NANOSECONDS
from benchbot_robot_ros2.messages import message_type, pose_of
from plugins.robot_ros2.tests.bridge.bridged import SAMPLE, Listener, bridge, listener, time_of, until
from plugins.robot_ros2.tests.conftest import _free_domain

pytestmark = pytest.mark.xdist_group("robots 1")

ODOMETRY = "nav_msgs/msg/Odometry"
CLOCK = ("/clock", "rosgraph_msgs/msg/Clock")
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


@pytest.fixture(scope="module")
def robots() -> Iterator[Listener]:
    """Two robots, tb1 and tb2, that are started at once; tb2 obeys TwistStamped."""
    with ExitStack() as stack, pytest.MonkeyPatch.context() as patch, _free_domain() as (number, _):
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        words = [(*SAMPLE, "--namespace", "tb1"), (*SAMPLE, "--namespace", "tb2", "--stamped")]
        with ThreadPoolExecutor() as pool:
            for started in pool.map(lambda arguments: stack.enter_context(bridge(*arguments)), words):
                assert started.poll() is None
        yield stack.enter_context(listener())


def where(robots: Listener, name: str) -> float:
    """Return how far a robot is from its start by odometry, along x."""
    return float(pose_of(robots.newer(f"/{name}/odom", ODOMETRY).pose.pose).translation_xyz[0])


def rests(robots: Listener, name: str) -> bool:
    return not any(robots.newer(f"/{name}/odom", ODOMETRY).twist.twist.linear.x for _ in range(2))


def commands(robots: Listener, name: str, ros_type: str) -> Callable[[float], None]:
    """Return what sends a velocity; a stamped one is of the robot's time."""
    publisher = robots.node.create_publisher(message_type(ros_type), f"/{name}/cmd_vel", 1)
    until(publisher.get_subscription_count, "somebody obeys")

    def send(linear_mps: float) -> None:
        message = message_type(ros_type)()
        if ros_type == STAMPED:
            message.header.stamp = robots.newer(*CLOCK).clock
        getattr(message, "twist", message).linear.x = linear_mps
        publisher.publish(message)

    return send


def test_each_obeys_its_own_velocities_only(robots: Listener) -> None:
    for name, other, ros_type in (("tb1", "tb2", TWIST), ("tb2", "tb1", STAMPED)):
        for robot in (name, other):
            until(partial(rests, robots, robot), f"{robot} rests")
        go, before, others = commands(robots, name, ros_type), where(robots, name), where(robots, other)

        def driven(go: Callable[[float], None] = go, name: str = name, before: float = before) -> bool:
            go(0.2)
            return where(robots, name) > before + 0.05

        until(driven, f"{name} drives")
        assert where(robots, other) == others


def test_there_is_one_time(robots: Listener) -> None:
    robots.hear(*CLOCK)
    until(lambda: robots.node.count_publishers("/clock") == 1, "one follows the other")
    stamps = {name: robots.hear(f"/{name}/odom", ODOMETRY) for name in ("tb1", "tb2")}
    for messages in stamps.values():
        messages.clear()
    until(lambda: min(map(len, stamps.values())) > 20, "time passes for both")
    times = {name: [time_of(message) for message in messages] for name, messages in stamps.items()}
    # The second ticks when the first does; on a busy machine it may leave one out.
    assert len(set(times["tb1"]) & set(times["tb2"])) > 10
    for series in times.values():
        assert series == sorted(set(series))


def test_their_frames_are_two_trees_on_one_topic(robots: Listener) -> None:
    links: set[tuple[str, str]] = set()

    def hear(message: TFMessage) -> None:
        links.update((transform.header.frame_id, transform.child_frame_id) for transform in message.transforms)

    def expected(name: str) -> set[tuple[str, str]]:
        base = f"{name}/base_link"
        mounts = {(base, f"{name}/{frame}") for frame in ("base_footprint", "camera", "lidar")}
        return {(f"{name}/map", f"{name}/odom"), (f"{name}/odom", base)} | mounts

    robots.node.create_subscription(TFMessage, "/tf", hear, 100)
    # As tf2 does: what is kept of one robot must not push out the other's.
    both = qos.latched()
    both.depth = 100
    robots.node.create_subscription(TFMessage, "/tf_static", hear, both)
    until(lambda: links >= expected("tb1") | expected("tb2"), "both robots' transforms")
    assert links == expected("tb1") | expected("tb2")


def test_headers_name_the_frames_with_their_prefix(robots: Listener) -> None:
    for name in ("tb1", "tb2"):
        odometry = robots.newer(f"/{name}/odom", ODOMETRY)
        truth = robots.newer(f"/{name}/ground_truth/odom", ODOMETRY)
        scan = robots.newer(f"/{name}/scan", "sensor_msgs/msg/LaserScan")
        picture = robots.newer(f"/{name}/camera/color/image_raw", "sensor_msgs/msg/Image")
        assert (odometry.header.frame_id, odometry.child_frame_id) == (f"{name}/odom", f"{name}/base_link")
        assert (truth.header.frame_id, scan.header.frame_id) == (f"{name}/map", f"{name}/lidar")
        assert picture.header.frame_id == f"{name}/camera"


def test_a_robot_whose_time_is_anothers_says_when_that_is_gone_or_begins_anew(domain: int) -> None:
    first, second = (*SAMPLE, "--namespace", "tb1"), (*SAMPLE, "--namespace", "tb2")
    with ExitStack() as stack:
        leader = stack.enter_context(bridge(*first))
        follower = stack.enter_context(bridge(*second))
        lines: list[str] = []
        with ThreadPoolExecutor() as pool:
            assert follower.stderr is not None
            reading = pool.submit(lambda: lines.extend(follower.stderr or ()))
            until(lambda: said(lines, "Another node publishes /clock"), "it follows")
            leader.send_signal(signal.SIGTERM)
            until(lambda: said(lines, "No node publishes /clock any more"), "it misses the clock")
            stack.enter_context(bridge(*first))
            assert follower.wait(60) == 3
            reading.result()
        assert said(lines, "The time on /clock jumped back.")


def said(lines: list[str], words: str) -> bool:
    return any(words in line for line in lines)


def test_of_two_clocks_that_did_not_see_each_other_the_one_ahead_stays(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a machine that is busy enough, a second is too short to find each other.
    monkeypatch.setattr("benchbot_robot_ros2.bridge.clock.DISCOVERY_S", 0.0)
    with ros.node("tb2") as early_node, ros.node("tb1") as late_node:
        clocks, told = [(SharedTime(early_node, 0.05), executor_of(early_node))], []

        def pass_until_s(time_s: float) -> bool:
            for clock, executor in clocks:
                if clock.left_s() <= 0:
                    clock.next_tick()
                clock.publish()
                executor.spin_once(timeout_sec=0.01)
            told.append([clock.stamp_ns for clock, _ in clocks])
            return min(told[-1]) >= time_s * NANOSECONDS

        until(lambda: pass_until_s(0.5), "the first clock goes")
        clocks.append((SharedTime(late_node, 0.05), executor_of(late_node)))
        early, late = (clock for clock, _ in clocks)
        assert not late.follows
        # What the late one has told itself, and hears only now, is no jump of the one that it follows.
        until(lambda: pass_until_s(2.0), "both live in one time")

    assert late.follows
    assert not early.follows
    for times in (*zip(*told[-10:], strict=True), [both[-1] for both in told if len(both) == 2]):
        assert list(times) == sorted(times)


def executor_of(node: Any) -> SingleThreadedExecutor:
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    return executor


def test_two_bridges_of_one_name_are_told_apart(domain: int) -> None:
    with bridge(*SAMPLE), bridge(*SAMPLE) as second:
        assert second.stderr is not None
        line: Any = next(line for line in second.stderr if "Another node is called" in line)
        assert "--namespace NAME" in line
