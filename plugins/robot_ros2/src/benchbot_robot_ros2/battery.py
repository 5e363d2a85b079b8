"""The robot's battery: whether a trial may begin, and a warning when it runs low."""

import math
from typing import Any

from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.declaration_keys import Battery
from benchbot_robot_ros2.failures import failed
from benchbot_robot_ros2.streams import Sample

# Low is said once in so many seconds, to whoever reads the run's log.
WARNING_PERIOD_S = 60.0


def check(robot: ConnectedRobot) -> None:
    """Raise BenchbotError when the declared battery is too low for a trial to begin, or does not say how full it is."""
    declared, newest = robot.robot.settings.safety.battery, _newest(robot)
    if declared is None or newest is None:
        return
    if (why := problem(declared, newest.message)) is not None:
        raise failed(
            f"The robot '{robot.robot.name}' does not start: its battery.",
            f"{why}, said on {declared.ros_topic}.",
            "Charge it, or correct driver.safety.battery in the declaration.",
        )


def warn(robot: ConnectedRobot) -> None:
    """Write into the run's log that the battery is low, now and then while it is."""
    declared, newest = robot.robot.settings.safety.battery, _newest(robot)
    if declared is not None and newest is not None and (why := problem(declared, newest.message)) is not None:
        robot.node.get_logger().warning(f"The battery: {why}.", throttle_duration_sec=WARNING_PERIOD_S)


def _newest(robot: ConnectedRobot) -> Sample | None:
    return None if robot.battery is None else robot.battery.newest


def problem(declared: Battery, message: Any) -> str | None:
    """Return why a trial may not begin with this battery, as part of a sentence; None when it may."""
    share, said = message.percentage / declared.full, charge(declared, message)
    if declared.minimum is not None:
        if math.isnan(share):
            return "it does not say how full it is (its percentage is NaN)"
        if not 0 <= share <= 1:
            return (
                f"its percentage is {message.percentage:g}, and {declared.full:g} is full (driver.safety.battery.full)"
            )
        if share < declared.minimum:
            return f"it has {said}, and {declared.minimum:.0%} is asked for (driver.safety.battery.minimum)"
    if declared.minimum_v is not None and not message.voltage >= declared.minimum_v:
        return f"it has {said}, and {declared.minimum_v:g} V is asked for (driver.safety.battery.minimum_v)"
    return None


def charge(declared: Battery, message: Any) -> str:
    """Return how full the battery is, in words."""
    share = "" if math.isnan(message.percentage) else f"{message.percentage / declared.full:.0%}, "
    return f"{share}{message.voltage:.1f} V"
