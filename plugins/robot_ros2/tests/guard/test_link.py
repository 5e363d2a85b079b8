"""The driver's side of its guard: it stops the robot when told to, and knows when the guard fails it."""

import os
import signal
import threading
from collections.abc import Iterator

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_robot_ros2.ros import running_node
from plugins.robot_ros2.tests.guard import guarded
from plugins.robot_ros2.tests.guard.guarded import Base, Driving, declaration, is_over


@pytest.fixture
def base(domain: int) -> Iterator[Base]:
    from geometry_msgs.msg import Twist

    with running_node("base") as node:
        yield Base(node, Twist)


def test_closing_stops_a_moving_robot_at_once(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard):
        base.until_moving()
        guard.close()
    base.until_stopped()
    assert is_over(guard.pid)
    with pytest.raises(BenchbotError, match="stopped for safety"):
        guard.command(1.0, 0.0)


def test_stop_is_heard_from_any_thread(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        threading.Thread(target=guard.stop, args=("The solution hung up.",)).start()
        assert driving.until_refused().why == "The solution hung up."
        base.until_stopped()
        guard.stop("Something else.")
        assert guard.tripped == "The solution hung up."


def test_a_killed_guard_stops_the_robot_too(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        os.kill(guard.pid, signal.SIGKILL)
        assert "guard process died" in driving.until_refused().why
        base.until_stopped()


def test_a_frozen_standby_stops_the_robot_too(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        os.kill(guard.standby_pid, signal.SIGSTOP)
        assert "The guard that stands by hung." in driving.until_refused().why
        base.until_stopped()


def test_a_guard_that_hangs_is_noticed(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        os.kill(guard.pid, signal.SIGSTOP)
        assert "guard process hung" in driving.until_refused().why
        base.until_stopped()
