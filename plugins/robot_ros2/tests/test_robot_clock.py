import threading
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest
from builtin_interfaces.msg import Time
from rclpy.duration import Duration
from rosgraph_msgs.msg import Clock

from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.robot_clock import RobotClock
from plugins.robot_ros2.tests.unicycle import until

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher


@pytest.fixture
def changed() -> threading.Condition:
    return threading.Condition()


@pytest.fixture
def simulator(domain: int) -> Iterator["Publisher"]:
    with ros.running_node("simulator") as node:
        yield node.create_publisher(Clock, "/clock", 1)


@pytest.fixture
def node(domain: int) -> Iterator["Node"]:
    with ros.running_node("robot", use_sim_time=True) as node:
        yield node


def _tell(simulator: "Publisher", clock: RobotClock, sec: int) -> None:
    simulator.publish(Clock(clock=Time(sec=sec)))
    until(lambda: clock.now_ns() == sec * 10**9)


def test_simulated_seconds_never_go_back(node: "Node", simulator: "Publisher", changed: threading.Condition) -> None:
    clock = RobotClock(node, simulated=True, changed=changed)
    assert clock.now_ns() == 0
    until(lambda: simulator.get_subscription_count() > 0)
    _tell(simulator, clock, 100)
    began_s = clock.now_s()
    assert clock.set_back_s == 0.0

    _tell(simulator, clock, 103)
    assert clock.now_s() - began_s == pytest.approx(3.0)

    _tell(simulator, clock, 90)
    assert clock.set_back_s == pytest.approx(13.0)
    assert clock.now_s() - began_s == pytest.approx(3.0)

    clock.forgive()
    _tell(simulator, clock, 92)
    assert clock.set_back_s == 0.0
    assert clock.now_s() - began_s == pytest.approx(5.0)
    clock.close()


def test_a_jump_back_between_two_looks_is_seen(
    node: "Node", simulator: "Publisher", changed: threading.Condition
) -> None:
    clock = RobotClock(node, simulated=True, changed=changed)
    until(lambda: simulator.get_subscription_count() > 0)
    for sec in (50, 40, 60):
        _tell(simulator, clock, sec)

    assert clock.set_back_s == pytest.approx(10.0)
    clock.close()


def test_simulated_time_wakes_those_who_wait(
    node: "Node", simulator: "Publisher", changed: threading.Condition
) -> None:
    clock = RobotClock(node, simulated=True, changed=changed)
    until(lambda: simulator.get_subscription_count() > 0)
    with changed:
        simulator.publish(Clock(clock=Time(sec=7)))
        assert changed.wait_for(lambda: clock.now_ns() == 7 * 10**9, timeout=30.0)
    until(lambda: clock.still_s > 0.05)
    clock.close()


def test_real_seconds_pass_and_stand_for_themselves(domain: int, changed: threading.Condition) -> None:
    with ros.running_node("robot") as node:
        clock = RobotClock(node, simulated=False, changed=changed)
        earlier_s, steady_s = clock.now_s(), time.monotonic()
        until(lambda: clock.now_s() > earlier_s + 0.02)
        assert clock.now_s() - earlier_s <= time.monotonic() - steady_s + 0.01
        assert clock.set_back_s == 0.0
        assert abs(clock.now_ns() - time.time_ns()) < 10**9
        clock.close()


class Dawdling:
    """A node's clock on a busy machine: looking at it takes a while, before or after it is read; it may be set back."""

    def __init__(self, node: "Node") -> None:
        self._clock = node.get_clock()
        self.before_s = self.after_s = self.set_back_s = 0.0
        self.create_jump_callback = self._clock.create_jump_callback

    def now(self) -> Any:
        time.sleep(self.before_s)
        read = self._clock.now() - Duration(seconds=self.set_back_s)
        time.sleep(self.after_s)
        return read


def test_a_busy_machine_does_not_set_the_clock_back(
    domain: int, changed: threading.Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ros.running_node("robot") as node:
        dawdling = Dawdling(node)
        monkeypatch.setattr(node, "get_clock", lambda: dawdling)
        clock = RobotClock(node, simulated=False, changed=changed)
        for before_s, after_s in ((0.1, 0.0), (0.0, 0.1), (0.0, 0.0), (0.1, 0.1), (0.0, 0.0)):
            dawdling.before_s, dawdling.after_s = before_s, after_s
            assert clock.set_back_s == 0.0

        dawdling.set_back_s = 3.0
        assert clock.set_back_s == pytest.approx(3.0, abs=0.2)
        clock.close()
