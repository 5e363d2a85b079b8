"""Who dies or hangs while the robot moves: whoever it is, the robot is told to stop within 200 ms of its own time.

The robot itself strikes, so that its own clock says when. That clock passes slowly while it moves: what is quick
enough does not depend on how busy the machine is.
"""

import os
import re
import signal
from collections.abc import Callable

import pytest

from plugins.robot_ros2.tests.system.chain import (
    assert_stays,
    assert_stopped_in_time,
    strike,
    submission,
    until_under_way,
)
from plugins.robot_ros2.tests.unicycle import unicycle, until
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
        # The driver goes on: what it hears of first, the guard or that so much time has passed, is chance; and a busy
        # machine may let the guard itself hang for 100 ms.
        reasons = "No velocity command came for|Its simulated clock stood still for|The guard process hung"
        assert re.search(reasons, failure["why"])


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_the_guard_dies_or_hangs_and_the_one_that_stands_by_stops_the_robot(declared: Declared, number: int) -> None:
    # A third guard, that would have to start first, would take more than the time that the robot has: here 0.8 s.
    robot_of = ROBOT | ({"motion_pace": 0.1} if number == signal.SIGSTOP else {})
    with unicycle(**robot_of) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[number, submitted.guards["guards"]])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert ("died" if number == signal.SIGKILL else "hung") in failure["why"]


def test_the_guard_that_stands_by_is_killed(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[signal.SIGKILL, submitted.guards["stands-by"]])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert "The guard that stands by died." in failure["why"]


def test_both_guards_are_killed(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[signal.SIGKILL, *submitted.guards.values()])
        until(lambda: robot.state["rested_s"] is not None)
        assert_stays(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")


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
