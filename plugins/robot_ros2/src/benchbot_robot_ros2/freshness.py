"""Fresh or stopped: why a moving robot must stop, by what it tells of itself, each a reason with its fix."""

import math
from typing import NamedTuple

from benchbot.plugin import Pose
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.localisation import apart
from benchbot_robot_ros2.observing import STILL_FACTOR


class Reason(NamedTuple):
    """Why a robot must stop, and what to do about it."""

    why: str
    fix: str


def blindness(robot: ConnectedRobot) -> Reason | None:
    """Return the reason when odometry, obstacles, clock or localisation are missing or too old."""
    timeout_s = robot.robot.settings.timing.feedback_timeout_s
    if robot.clock.set_back_s:
        return set_back(robot.clock.set_back_s)
    if robot.clock.still_s > STILL_FACTOR * timeout_s:
        return Reason(
            f"Its simulated clock stood still for {robot.clock.still_s:.1f} s while it moved.",
            "See whether the simulator that publishes /clock is alive, and start the run again.",
        )
    for stream in robot.feedback:
        if stream.age_s > timeout_s:
            return Reason(
                f"Nothing new came on {stream.topic.ros_topic} for {stream.age_s:.1f} s while it moved "
                f"(driver.timing.feedback_timeout_s is {timeout_s:g} s): {stream.silence()}.",
                f"See whether what publishes {stream.topic.ros_topic} is alive and the network good, and start the "
                "run again.",
            )
    return _lost(robot, timeout_s)


def jump(robot: ConnectedRobot) -> Reason | None:
    """Return the reason when localisation says what odometry contradicts."""
    step = robot.localisation.step()
    if step is None:
        return None
    expected, said = step
    bounds = robot.robot.settings.localisation_bounds
    away_m, turned_deg = apart(expected, said)
    if away_m <= bounds.jump_m and turned_deg <= bounds.jump_deg:
        return None
    return Reason(
        f"Its localisation jumped by {away_m:.2f} m and {turned_deg:.0f}°, from {_place(expected)} by odometry to "
        f"{_place(said)}; driver.localisation_bounds allow {bounds.jump_m:g} m and {bounds.jump_deg:g}°.",
        "See which of the two is right. Mend the localisation or the odometry, or allow more in the declaration.",
    )


def set_back(seconds: float) -> Reason:
    """Return the reason of a clock that was set back."""
    return Reason(
        f"ROS time jumped back by {seconds:.2f} s.",
        "Let one node only publish /clock, and do not restart the simulator during a run; on a real robot, let chrony "
        "slew the clocks instead of setting them.",
    )


def _lost(robot: ConnectedRobot, timeout_s: float) -> Reason | None:
    """Return the reason when localisation has told nothing new for too long, or too long a way."""
    link = robot.localisation.stalest()
    if link is not None and (age_s := robot.clock.now_s() - link.arrived_s) > timeout_s:
        return Reason(
            f"Nothing new was said of where '{link.child}' is in '{link.parent}' for {age_s:.1f} s while it moved "
            f"(driver.timing.feedback_timeout_s is {timeout_s:g} s).",
            f"See whether what publishes the transform from '{link.parent}' to '{link.child}' on /tf is alive, and "
            "start the run again.",
        )
    bound_m, place = robot.robot.settings.localisation_bounds.unseen_m, robot.place
    if place is not None and place.holds and robot.localisation.unseen_m > bound_m:
        return Reason(
            f"Nothing new came on {place.topic.ros_topic} for {robot.localisation.unseen_m:.2f} m "
            f"(driver.localisation_bounds.unseen_m is {bound_m:g} m): {place.silence()}.",
            "See whether what localises the robot is alive, or allow it a longer way.",
        )
    return None


def _place(pose: Pose) -> str:
    x, y, _ = pose.translation_xyz
    return f"({x:.2f} m, {y:.2f} m, {math.degrees(pose.yaw_rad):.0f}°)"
