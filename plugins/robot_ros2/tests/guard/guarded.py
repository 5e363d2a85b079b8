"""A base that takes velocities, and a driver that commands them through a guard; run as a script, a driver process."""

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import yaml

from benchbot.core.errors import BenchbotError
from benchbot.core.motion import MotionConfig
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.guard.link import Guard

if TYPE_CHECKING:
    from rclpy.node import Node

DEADLINE_S = 30.0
# Generous, so that a busy machine never looks like a driver that hangs.
PATIENT = {"command_timeout_s": 5.0}
COMMAND_PERIOD_S = 0.05


def declaration(
    safety: dict[str, Any] | None = None, command: dict[str, Any] | None = None, **driver: Any
) -> dict[str, Any]:
    """Return a robot's declaration: the bridged Carter, in real time, without a bumper."""
    robot: dict[str, Any] = yaml.safe_load((files("benchbot_robot_ros2") / "robots" / "carter_ros2.yaml").read_bytes())
    robot["driver"] |= {"use_sim_time": False, "safety": PATIENT | (safety or {})} | driver
    for action in ("move_next", "move_distance", "move_angle"):
        robot["connections"][action] |= command or {}
    return robot


@contextmanager
def guarded(robot: dict[str, Any]) -> Iterator[Guard]:
    """Yield the guard of a declared robot."""
    guard = Guard.start(Ros2Robot.from_declaration(robot), MotionConfig.from_robot(robot, "ground_truth"))
    try:
        yield guard
    finally:
        guard.close()


def until(condition: Callable[[], Any], what: str) -> None:
    """Wait until something is so; fails when it does not become so."""
    deadline_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline_s, f"never happened: {what}"
        time.sleep(0.005)


def is_over(pid: int) -> bool:
    """Whether a process has ended, be it that nobody has asked for its status yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


class Base:
    """Subscribes to a velocity topic and remembers all (linear, angular) that it hears."""

    def __init__(self, node: "Node", kind: type[Any], topic: str = "/cmd_vel", **qos: Any) -> None:
        from rclpy.qos import QoSProfile

        self.node = node
        self.messages: list[Any] = []
        self.numbers: list[int] = []
        node.create_subscription(kind, topic, self._hear, QoSProfile(depth=100, **qos))

    def _hear(self, message: Any, info: Any) -> None:
        # Of what was published; a busy machine loses some of it.
        self.numbers.append(info["publication_sequence_number"])
        self.messages.append(message)

    @property
    def heard(self) -> list[tuple[float, float]]:
        twists = [getattr(message, "twist", message) for message in list(self.messages)]
        return [(twist.linear.x, twist.angular.z) for twist in twists]

    @property
    def velocity(self) -> tuple[float, float]:
        return self.heard[-1] if self.messages else (0.0, 0.0)

    def forget(self) -> None:
        self.messages.clear()
        self.numbers.clear()

    def until_moving(self) -> None:
        until(lambda: self.velocity[0] > 0.2, "the base is told to move")

    def until_stopped(self) -> None:
        """Wait for several zeros in a row."""
        until(lambda: self.heard[-5:] == [(0.0, 0.0)] * 5, "the base is told to stop, and told again")


class Driving:
    """Commands a velocity at 20 Hz in a thread, until the guard refuses."""

    def __init__(self, guard: Guard, linear_mps: float = 1.0, angular_radps: float = 0.0) -> None:
        self.error: BenchbotError | None = None
        self._guard = guard
        self._command = linear_mps, angular_radps
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._drive)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _drive(self) -> None:
        while not self._ended.wait(COMMAND_PERIOD_S):
            try:
                self._guard.command(*self._command)
            except BenchbotError as error:
                self.error = error
                return

    def until_refused(self) -> BenchbotError:
        until(lambda: self.error, "commands are refused")
        assert self.error is not None
        return self.error


def main() -> None:
    with guarded(json.loads(sys.argv[1])) as guard:
        print(guard.pid, flush=True)
        while True:
            guard.command(1.0, 0.0)
            time.sleep(COMMAND_PERIOD_S)


if __name__ == "__main__":
    main()
