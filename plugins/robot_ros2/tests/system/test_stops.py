"""Who stops a moving robot on purpose, and a solution that hangs: the robot rests, and the run says why."""

import sys
from collections.abc import Callable
from typing import Any

import pytest

from benchbot.core.errors import ExitCode
from plugins.robot_ros2.tests.system.chain import (
    SELECTION,
    WALK_AND_HANG,
    assert_stays,
    assert_stopped_in_time,
    strike,
    submission,
    until_under_way,
)
from plugins.robot_ros2.tests.unicycle import MOUNTS, PATIENCE_S, unicycle, until
from tests.command_line import CommandLine, wait_for

Declared = Callable[..., CommandLine]
ROBOT = {"simulated": True, "motion_pace": 0.25, "mounts": MOUNTS}
E_STOP = {"e_stop": {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}}
DEAD_MAN = {"dead_man": {"ros_topic": "/dead_man", "ros_type": "std_msgs/msg/Bool", "timeout_s": 1.0}}


@pytest.mark.parametrize(
    ("device", "blow", "why"),
    [
        (E_STOP, {"pressed": True}, "The emergency stop is pressed."),
        (DEAD_MAN, {"held": False}, "Nobody holds the dead-man switch."),
    ],
    ids=["e-stop", "dead-man"],
)
def test_a_safety_device_stops_the_robot_and_ends_the_run(
    declared: Declared, device: dict[str, Any], blow: dict[str, bool], why: str
) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True, safety=device)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, set=blow)
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (ExitCode.INTERNAL, "platform")
        assert why in failure["why"]
        acted, reset = submitted.told
        assert (acted["title"], acted["why"]) == ("The robot was stopped for safety.", why)
        assert acted["ends_run"]
        assert reset == acted
        assert why in submitted.said
        assert "and the run is over" in submitted.said


def test_a_run_that_is_stopped_stops_its_robot(declared: Declared) -> None:
    cli = declared(use_sim_time=True)
    with unicycle(**ROBOT) as robot:
        back_end = cli.start("run", *SELECTION, "--port", "0")
        wait_for(back_end, "Ready.")
        with submission(cli, "--timeout", "600") as submitted:
            until_under_way(robot, submitted)
            assert cli("stop").returncode == 0
            until(lambda: robot.state["rested_s"] is not None)
            assert robot.state["zeroed_s"] is not None
            assert_stays(robot)

            code, failure = submitted.ended()
            assert back_end.wait(PATIENCE_S) == 0
            assert (code, failure["class"]) == (ExitCode.INTERNAL, "platform")
            assert "stopped by its user" in failure["why"]


@pytest.mark.parametrize("light", [True, False], ids=["benchbot-stop", "benchbot stop"])
def test_a_submission_is_stopped_from_another_terminal(declared: Declared, light: bool) -> None:
    cli = declared(use_sim_time=True)
    words = ["-m", "benchbot.emergency_stop"] if light else ["-m", "benchbot", "stop"]
    # By the robot itself, which runs it to its end: its clock, that tells how quick it is, stands still for as long.
    command = ["env", f"BENCHBOT_STATE_DIR={cli.variables['BENCHBOT_STATE_DIR']}", sys.executable, *words]
    with unicycle(**ROBOT) as robot, submission(cli) as submitted:
        until_under_way(robot, submitted)
        strike(robot, run=command)
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (ExitCode.INTERNAL, "platform")
        assert f"stopped by its user ({'benchbot-stop' if light else 'benchbot stop'})." in failure["why"]


def test_a_solution_that_hangs_leaves_the_robot_at_rest_until_its_time_is_up(declared: Declared) -> None:
    options = (*SELECTION, "--timeout", "40")
    with (
        unicycle(simulated=True, mounts=MOUNTS) as robot,
        submission(declared(use_sim_time=True), *options, solution=WALK_AND_HANG) as submitted,
    ):
        until(lambda: "hanging" in submitted.said)
        assert robot.state["x"] == pytest.approx(0.3, abs=0.02)
        assert_stays(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (ExitCode.SUBMISSION_FAILED, "timeout")
        assert "It was still running after 40 seconds" in failure["why"]
        assert_stays(robot)
