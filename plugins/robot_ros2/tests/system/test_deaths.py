"""Who dies or hangs while the robot moves: whoever it is, the robot is told to stop within 200 ms of its own time.

The robot itself strikes, so that its own clock says when. That clock passes slowly while it moves: what is quick
enough does not depend on how busy the machine is.
"""

import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from plugins.robot_ros2.tests.system.chain import (
    SELECTION,
    assert_stays,
    assert_stopped_in_time,
    strike,
    submission,
    until_under_way,
)
from plugins.robot_ros2.tests.unicycle import MOUNTS, PATIENCE_S, Unicycle, unicycle, until
from tests.command_line import CommandLine, wait_for

Declared = Callable[..., CommandLine]
ROBOT = {"simulated": True, "motion_pace": 0.25, "mounts": MOUNTS}
ATTENDED = {"timing": {"heartbeat_timeout_s": 0.5}}


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
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGCONT)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        # The driver goes on: what it hears of first, the guard or that so much time has passed, is chance; and a busy
        # machine may let the guard itself hang for 100 ms.
        reasons = "No velocity command came for|was frozen|Its simulated clock stood still for|The guard process hung"
        assert re.search(reasons, failure["why"])


@contextmanager
def _freezing(robot: Unicycle, pid: int) -> Iterator[None]:
    """Freeze a process while the robot moves; it goes on at the end."""
    try:
        strike(robot, kill=[signal.SIGSTOP, pid])
        assert_stopped_in_time(robot)
        yield
    finally:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def test_the_supervisor_is_frozen(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True, **ATTENDED)) as submitted:
        until_under_way(robot, submitted)
        with _freezing(robot, submitted.supervisor):
            pass

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert "The supervisor gave no sign of life for 0.5 s while the robot moved." in failure["why"]


def test_the_driver_is_frozen(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        with _freezing(robot, submitted.driver):
            code, failure = submitted.ended()

        assert (code, failure["class"]) == (3, "platform")
        assert "The robot's driver died. Its process was frozen (SIGSTOP, or Ctrl-Z)" in failure["why"]


def test_the_solution_is_frozen(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        with _freezing(robot, submitted.solution):
            code, failure = submitted.ended()

        assert (code, failure["class"]) == (1, "agent")
        assert f"The solution (process {submitted.solution}) was frozen" in failure["why"]


def test_the_command_line_is_frozen(declared: Declared) -> None:
    with unicycle(**ROBOT) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        with _freezing(robot, submitted.process.pid):
            pass

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert f"The command that has started it (process {submitted.process.pid}) was frozen" in failure["why"]


@pytest.mark.parametrize("frozen", ["run", "submit", "solution"])
def test_somebody_is_frozen_in_a_run_that_is_joined(declared: Declared, frozen: str) -> None:
    cli = declared(use_sim_time=True, **ATTENDED)
    with unicycle(**ROBOT) as robot:
        back_end = cli.start("run", *SELECTION, "--port", "0")
        wait_for(back_end, "Ready.")
        with submission(cli, "--timeout", "600") as submitted:
            until_under_way(robot, submitted)
            pids = {"run": back_end.pid, "submit": submitted.process.pid, "solution": submitted.solution}
            with _freezing(robot, pids[frozen]):
                code_of_solution = submitted.ended() if frozen == "solution" else None
            code, failure = code_of_solution or submitted.ended()

            expected = (1, "agent") if frozen == "solution" else (3, "platform")
            assert (code, failure["class"]) == expected
            assert cli("stop").returncode == 0
            assert back_end.wait(PATIENCE_S) == 0


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_the_guard_dies_or_hangs_and_the_one_that_stands_by_stops_the_robot(declared: Declared, number: int) -> None:
    # Its 200 ms have to be long enough for a busy machine, too.
    with unicycle(**ROBOT | {"motion_pace": 0.05}) as robot, submission(declared(use_sim_time=True)) as submitted:
        until_under_way(robot, submitted)
        strike(robot, kill=[number, submitted.guards["guards"]])
        assert_stopped_in_time(robot)

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert f"The guard process {'died' if number == signal.SIGKILL else 'hung'}." in failure["why"]


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
    with (
        unicycle(mounts=MOUNTS) as robot,
        submission(declared(timing={"feedback_timeout_s": 0.7})) as submitted,
    ):
        until_under_way(robot, submitted)
        robot.process.kill()

        code, failure = submitted.ended()
        assert (code, failure["class"]) == (3, "platform")
        assert re.search("Nothing new came on /(odom|scan) for", failure["why"])
        acted, reset = submitted.told
        assert acted["why"] in failure["why"]
        assert reset == acted
