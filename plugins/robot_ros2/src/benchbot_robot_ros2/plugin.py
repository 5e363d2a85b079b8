"""The plug-in's hooks: robots, the driver of real ones, and two commands. ROS is imported when one of them is used."""

from collections.abc import Iterable
from importlib.resources import files
from importlib.resources.abc import Traversable

from benchbot.plugin import Command, RobotDriver, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_robots() -> Iterable[Traversable]:
    """Yield the declared robots."""
    yield files("benchbot_robot_ros2") / "robots"


@hookimpl
def benchbot_robot_drivers() -> Iterable[RobotDriver]:
    """Yield the driver of robots over ROS 2."""
    yield RobotDriver(
        "ros2",
        create=target("benchbot_robot_ros2.driver:Ros2Driver"),
        diagnose=target("benchbot_robot_ros2.doctor.diagnosis:diagnose"),
    )


@hookimpl
def benchbot_commands() -> Iterable[Command]:
    """Yield the command that presents a simulated robot over ROS 2, and the one that guards a real one."""
    yield Command("bridge", "benchbot_robot_ros2.bridge.command:app", "Present a simulated robot as a real one.")
    yield Command(
        "guard", "benchbot_robot_ros2.guard.command:guard", "On a robot's own computer: stop it when the network fails."
    )
