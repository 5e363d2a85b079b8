"""Who dies or hangs while the robot moves: whoever it is, the robot is told to stop within 200 ms of its own time.

The robot itself strikes, so that its own clock says when. That clock passes slowly while it moves: what is quick
enough does not depend on how busy the machine is.
"""

import os
import re
import signal
from collections.abc import Callable

from plugins.robot_ros2.tests.system.chain import (
    assert_stopped_in_time,
    strike,
    submission,
    until_under_way,
)
from plugins.robot_ros2.tests.unicycle import unicycle
from tests.command_line import CommandLine

Declared = Callable[..., CommandLine]
ROBOT = {"simulated": True, "motion_pace": 0.25}


def test_the_supervisor_is_killed(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[signal.SIGKILL, submitted.supervisor])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "infrastructure")
        assert "SIGKILL" in failure["why"]


def test_the_driver_is_killed(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[signal.SIGKILL, submitted.driver])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert "The robot's driver died." in failure["why"]
        assert "SIGKILL" in failure["why"]
        acted, reset = submitted.told
        assert acted["ends_run"]
        assert reset == acted


def test_supervisor_and_driver_hang(declared: Declared) -> None:
    safety = {"command_timeout_s": 0.15}
    # Its 150 ms have to be long enough for a busy machine, too.
    slow = ROBOT | {"motion_pace": 0.08}
    with unicycle(**slow) as robot, submission(declared(use_sim_time=True, safety=safety)) as submitted:
        until_under_way(robot, submitted)
        hanging = [submitted.supervisor, submitted.driver]
        try:
            strike(robot, kill=[signal.SIGSTOP, *hanging])
            assert_stopped_in_time(robot)
        finally:
            for pid in hanging:
                os.kill(pid, signal.SIGCONT)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        # The driver goes on: what it hears of first, the guard or that so much time has passed, is chance.
        assert re.search("No velocity command came for|Its simulated clock stood still for", failure["why"])


def test_the_solution_is_killed(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[signal.SIGKILL, submitted.solution])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert "The solution hung up while the robot was moving." in failure["why"]


def test_the_robot_is_killed(declared: Declared) -> None:
    with unicycle() as robot, submission(declared(timing={"feedback_timeout_s": 0.7})) as submitted:
        until_under_way(robot, submitted)
        robot.process.kill()

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert re.search("Nothing new came on /(odom|scan) for", failure["why"])
        acted, reset = submitted.told
        assert acted["why"] in failure["why"]
        assert reset == acted
