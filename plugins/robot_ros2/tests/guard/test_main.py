"""The guard's process: it publishes what is commanded, and stops the robot whatever ends or hangs."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot_robot_ros2.ros import running_node
from plugins.robot_ros2.tests.guard import guarded
from plugins.robot_ros2.tests.guard.guarded import Base, Driving, declaration, is_over, until


@pytest.fixture
def base(domain: int) -> Iterator[Base]:
    from geometry_msgs.msg import Twist

    with running_node("base") as node:
        yield Base(node, Twist)


@contextmanager
def driver_process(robot: dict[str, Any]) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Yield a process, in a group of its own, that drives the robot through a guard, and that guard's id."""
    process = subprocess.Popen(
        [sys.executable, guarded.__file__, json.dumps(robot)],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with process:
        try:
            assert process.stdout is not None
            yield process, int(process.stdout.readline())
        finally:
            process.kill()


def test_velocities_are_published_within_the_limits(base: Base) -> None:
    with guarded.guarded(declaration()) as guard:
        assert not base.messages
        with Driving(guard, 9.0, -9.0):
            until(lambda: base.velocity == (1.5, -1.0), "full speed")
        speeds = [linear for linear, _ in base.heard]
        assert speeds == sorted(speeds)
        # 2 m/s², at 20 ms or, on a busy machine, at most 0.1 s per step.
        assert all(
            after - before <= 0.2 * (later - earlier) + 1e-9
            for (before, after), (earlier, later) in zip(pairwise(speeds), pairwise(base.numbers), strict=False)
        )
        guard.command(0.0, 0.0)
        until(lambda: base.velocity == (0.0, 0.0), "rest")
        # In steps of at most 0.2 m/s, however busy the machine is.
        assert len(set(base.heard)) >= 8
        assert guard.tripped is None
    until(lambda: is_over(guard.pid), "the guard's end")
    guard.close()


def test_a_base_is_told_no_more_often_than_it_needs(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard):
        base.until_moving()
        first, began_s = base.numbers[-1], time.monotonic()
        until(lambda: base.numbers[-1] - first > 100, "it is told on and on")
        told, passed_s = base.numbers[-1] - first, time.monotonic() - began_s
    # 50 times a second, and at each command; what a busy machine hears late does not make it ten times as many.
    assert told / passed_s < 200


@pytest.mark.parametrize("kill", [os.kill, os.killpg])
def test_a_killed_driver_stops_the_robot(base: Base, kill: Any) -> None:
    with driver_process(declaration()) as (process, guard_pid):
        base.until_moving()
        kill(process.pid, signal.SIGKILL)
        base.until_stopped()
    until(lambda: is_over(guard_pid), "the guard's end")
    assert base.velocity == (0.0, 0.0)


def test_a_driver_that_hangs_stops_the_robot_for_good(base: Base) -> None:
    with driver_process(declaration({"command_timeout_s": 0.5})) as (process, guard_pid):
        base.until_moving()
        process.send_signal(signal.SIGSTOP)
        base.until_stopped()
        process.send_signal(signal.SIGCONT)
        # The driver's next command tells it, and it ends.
        assert process.wait(guarded.DEADLINE_S) != 0
        assert base.velocity == (0.0, 0.0)
    until(lambda: is_over(guard_pid), "the guard's end")


def test_silence_stops_the_robot_and_ends_the_run(base: Base) -> None:
    with guarded.guarded(declaration({"command_timeout_s": 0.5})) as guard:
        with Driving(guard):
            base.until_moving()
        base.until_stopped()
        until(lambda: guard.tripped, "the driver hears of it")
        with pytest.raises(BenchbotError, match="stopped for safety") as caught:
            guard.command(0.0, 0.0)
        assert "No velocity command came for" in caught.value.why
        assert caught.value.failure is FailureClass.PLATFORM
        assert caught.value.ends_run
        assert caught.value.exit_code is ExitCode.INTERNAL


def test_at_rest_silence_is_fine(base: Base) -> None:
    with guarded.guarded(declaration({"command_timeout_s": 0.1})) as guard:
        with Driving(guard, 0.0):
            until(lambda: guard.tripped is None, "nothing")
        base.forget()
        guard.command(0.1, 0.0)
        guard.command(0.0, 0.0)
        assert guard.tripped is None


def test_a_guard_that_is_asked_to_end_stops_the_robot_first(base: Base) -> None:
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        os.kill(guard.pid, signal.SIGTERM)
        assert "asked to end" in driving.until_refused().why
        base.until_stopped()
        until(lambda: is_over(guard.pid), "the guard's end")
