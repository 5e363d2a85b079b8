"""What this distribution adds to BenchBot."""

from collections.abc import Iterable
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING

from benchbot.plugin import Command, RobotDriver, hookimpl

if TYPE_CHECKING:
    from benchbot.plugin import Finding, Platform, PlatformSpec


@hookimpl
def benchbot_robots() -> Iterable[Traversable]:
    """Yield the declared robots."""
    yield files("benchbot_robot_ros2") / "robots"


@hookimpl
def benchbot_robot_drivers() -> Iterable[RobotDriver]:
    """Yield the driver of robots over ROS 2."""
    yield RobotDriver("ros2", create=_create, diagnose=_diagnose)


@hookimpl
def benchbot_commands() -> Iterable[Command]:
    """Yield the command that presents a simulated robot over ROS 2, and the one that guards a real one."""
    yield Command("bridge", "benchbot_robot_ros2.bridge.command:app", "Present a simulated robot as a real one.")
    yield Command(
        "guard", "benchbot_robot_ros2.guard.command:guard", "On a robot's own computer: stop it when the network fails."
    )


def _create(spec: "PlatformSpec") -> "Platform":
    from benchbot_robot_ros2.driver import Ros2Driver

    return Ros2Driver(spec)


def _diagnose(spec: "PlatformSpec") -> "Iterable[Finding]":
    from benchbot_robot_ros2.doctor.diagnosis import diagnose

    return diagnose(spec)
