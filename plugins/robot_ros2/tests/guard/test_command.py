"""`benchbot guard`, on the robot's own computer, between the network and a base that never stops by itself."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

import pytest
import yaml

from benchbot_robot_ros2.ros import running_node
from plugins.robot_ros2.tests.guard.guarded import DEADLINE_S, Base, until
from tests.plugin_factory import DECLARES, PluginFactory

BENCHBOT = (sys.executable, "-P", "-m", "benchbot")


class Host:
    """Publishes velocities where the guard listens, while it is `driving`; and the clock, four times slower than real.

    So a busy machine does not look like a network that fails.
    """

    def __init__(self, base: Base) -> None:
        from geometry_msgs.msg import Twist
        from rosgraph_msgs.msg import Clock

        self.driving = threading.Event()
        self._twist, self._clock = Twist(), Clock()
        self._twist.linear.x = 9.0
        self._clock.clock.sec = 1
        self._clocks = base.node.create_publisher(Clock, "/clock", 1)
        self._velocities = base.node.create_publisher(Twist, "/benchbot/cmd_vel", 1)
        self._timer = base.node.create_timer(0.02, self._tick)

    def push(self, lateral_mps: float) -> None:
        """Command a velocity to the left besides."""
        self._twist.linear.y = lateral_mps

    def _tick(self) -> None:
        self._clock.clock.nanosec += 5_000_000
        self._clock.clock.sec += self._clock.clock.nanosec // 1_000_000_000
        self._clock.clock.nanosec %= 1_000_000_000
        if self.driving.is_set():
            self._velocities.publish(self._twist)
        self._clocks.publish(self._clock)


@contextmanager
def guarding(robot: str = "carter_ros2") -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen([*BENCHBOT, "guard", "--robot", robot], stderr=subprocess.PIPE, text=True)
    with process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def base(domain: int) -> Iterator[Base]:
    from geometry_msgs.msg import Twist

    with running_node("base") as node:
        yield Base(node, Twist)


def test_silence_of_the_network_stops_the_base_until_somebody_starts_anew(base: Base) -> None:
    host = Host(base)
    with guarding() as process:
        assert process.stderr is not None
        assert "velocities from /benchbot/cmd_vel go to /cmd_vel" in process.stderr.readline()
        host.driving.set()
        base.until_moving()
        host.driving.clear()
        base.until_stopped()
        assert "No velocity command came" in process.stderr.readline()
        assert "may move again" in process.stderr.readline()
        base.forget()
        host.driving.set()
        base.until_moving()
        process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE_S) == 0
    base.until_stopped()


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--robot", "carter"], "no ROS 2 robot"),
        (["--robot", "cartre"], "not a known robot"),
        (["--robot", "carter_ros2", "--in", "/cmd_vel"], "listen to itself"),
    ],
)
def test_what_cannot_be_guarded_is_said(arguments: list[str], words: str) -> None:
    done = subprocess.run([*BENCHBOT, "guard", *arguments], capture_output=True, text=True, check=False)
    assert words in done.stderr
    assert done.returncode == 2


def test_a_velocity_sideways_is_no_smaller_velocity_but_a_stop(base: Base) -> None:
    host = Host(base)
    with guarding() as process:
        assert process.stderr is not None
        process.stderr.readline()
        host.driving.set()
        base.until_moving()
        host.push(0.3)
        base.until_stopped()
        assert "0.30 m/s sideways was commanded" in process.stderr.readline()


def test_a_holonomic_base_gets_its_velocity_sideways_within_its_limit(
    base: Base, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    declared = yaml.safe_load((files("benchbot_robot_ros2") / "robots" / "carter_ros2.yaml").read_text())
    omni = {**declared, "name": "omni", "limits": {**declared["limits"], "lateral_mps": 0.25}}
    PluginFactory(tmp_path).make("omni-robot", DECLARES.format(kind="robots"), {"robots/omni.yaml": json.dumps(omni)})
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]]))
    host = Host(base)
    with guarding("omni") as process:
        assert process.stderr is not None
        process.stderr.readline()
        host.push(-0.4)
        host.driving.set()
        base.until_moving()
        until(lambda: base.messages[-1].linear.y == -0.25, "the base is told to go to the right, as fast as it can")
        host.driving.clear()
        base.until_stopped()
        assert base.messages[-1].linear.y == 0.0
