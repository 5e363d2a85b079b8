"""The services after a run, when its driver is killed in the middle of a motion."""

import signal
from collections.abc import Callable

import pytest

from plugins.robot_ros2.tests.system.chain import strike, submission, until_under_way
from plugins.robot_ros2.tests.unicycle import MOUNTS, unicycle, until
from tests.command_line import CommandLine

Declared = Callable[..., CommandLine]


@pytest.mark.parametrize("stopped", [True, False], ids=["stopped", "killed"])
def test_the_guard_calls_them_once_the_robot_rests(declared: Declared, stopped: bool) -> None:
    cli = declared(before=[{"ros_service": "/claim"}], after=[{"ros_service": "/release"}])
    with unicycle(mounts=MOUNTS) as robot, submission(cli) as submitted:
        until_under_way(robot, submitted)
        if stopped:
            assert cli("stop").returncode == 0
        else:
            strike(robot, kill=[signal.SIGKILL, submitted.driver])
        until(lambda: robot.state["called"] == ["claim", "release"])
        assert robot.state["rested_s"] is not None
        submitted.process.wait()
