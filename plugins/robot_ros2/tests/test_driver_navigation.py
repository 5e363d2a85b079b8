"""`move_next` by navigation: a stand-in for Nav2 drives the test robot, and what watches over it stops both."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig, Outcome
from benchbot_robot_ros2.driver import Ros2Driver
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, Unicycle, declaration, driver, scene, unicycle, until

pytestmark = pytest.mark.usefixtures("domain")

BY_NAVIGATION = {"by": "navigation"}
BY_PATH = {"by": "navigation", "ros_action": "/follow_path", "ros_type": "nav2_msgs/action/FollowPath"}
GOAL = Pose.planar(2.0, 0.3, 0.4)


@contextmanager
def nav2(**options: Any) -> Iterator[list[dict[str, Any]]]:
    """Run the stand-in; yields what it says."""
    command = [sys.executable, str(Path(__file__).with_name("nav2.py")), json.dumps(options)]
    said: list[dict[str, Any]] = []
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        # Fast DDS writes to the same stream when the machine has too much to do.
        lines = (json.loads(line) for line in process.stdout if line.startswith("{"))
        assert next(lines) == {"ready": True}
        listening = threading.Thread(target=lambda: said.extend(lines))
        listening.start()
        try:
            yield said
        finally:
            process.stdin.close()
            process.wait()
            listening.join()


def navigated(**driver: Any) -> dict[str, Any]:
    """The test robot whose navigation drives it, localised as Nav2 is."""
    return declaration(**{"motion": BY_NAVIGATION, "localisation": BY_TRUTH, **driver})


def move_next(platform: Ros2Driver, robot: dict[str, Any], goal: Pose = GOAL) -> tuple[Outcome, float]:
    """Take the action as a run does; returns its outcome and the length of the way."""
    host = InProcessHost(platform, [scene()], MotionConfig.from_robot(robot, "ground_truth"))
    host.load(0, 0)
    outcome, status = host.act("move_next", {}, goal)
    assert status.path is not None
    return outcome, status.path.length_m


@pytest.mark.parametrize(("motion", "poses"), [(BY_NAVIGATION, 1), (BY_PATH, 42)], ids=["navigate", "follow"])
def test_navigation_drives_near_the_goal_and_the_controller_does_the_rest(
    tmp_path: Path, motion: dict[str, Any], poses: int
) -> None:
    robot = navigated(motion=motion)
    with unicycle() as there, nav2() as said, driver(robot, tmp_path) as platform:
        outcome, length_m = move_next(platform, robot)

        state = there.state
        assert outcome is Outcome.REACHED
        assert (state["x"], state["y"]) == pytest.approx((2.0, 0.3), abs=0.015)
        assert state["yaw"] == pytest.approx(0.4, abs=0.03)
        assert platform.velocity == (0.0, 0.0)
        assert length_m > 2.0
        # The other actions are the controller's.
        host = InProcessHost(platform, [scene()], MotionConfig.from_robot(robot, "ground_truth"))
        host._tracked.begin()
        assert host.act("move_distance", {"distance": -0.2}, None)[0] is Outcome.REACHED
    goals = [line for line in said if "goal" in line]
    kind = "FollowPath" if motion is BY_PATH else "NavigateToPose"
    assert [(line["goal"][:2], line["poses"]) for line in goals] == [([kind, "map"], poses)]
    assert goals[0]["goal"][2:] == pytest.approx([2.0, 0.3, 0.4])


def test_by_odometry_a_goal_is_where_odometry_finds_it(tmp_path: Path) -> None:
    robot = navigated()
    with unicycle(odometry_scale=1.1) as there, nav2() as said, driver(robot, tmp_path, "noisy") as platform:
        host = InProcessHost(platform, [scene()], MotionConfig.from_robot(robot, "noisy"))
        host.load(0, 0)
        for x in (1.1, 2.2):
            assert host.act("move_next", {}, Pose.planar(x, 0.0, 0.0))[0] is Outcome.REACHED
            assert platform.odometry().translation_xyz[0] == pytest.approx(x, abs=0.015)
            assert there.state["x"] == pytest.approx(x / 1.1, abs=0.015)
    # At a metre it believes that it has driven 1.1 m: to go on by 1.1 m is to go to 2.1 m.
    goals_x = [line["goal"][2] for line in said if "goal" in line]
    assert goals_x == pytest.approx([1.1, 2.1], abs=0.02)


@pytest.mark.parametrize("code", [105, 208])
def test_a_way_that_is_not_free_is_blocked(tmp_path: Path, code: int) -> None:
    robot = navigated()
    with unicycle(), nav2(gives_up=code), driver(robot, tmp_path) as platform:
        assert move_next(platform, robot)[0] is Outcome.BLOCKED


def test_what_is_wrong_with_nav2_is_not_the_solutions_fault(tmp_path: Path) -> None:
    robot = navigated()
    with unicycle(), nav2(gives_up=102), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="cannot be navigated") as failure:
            move_next(platform, robot)
        assert "was given up (error 102: as the test wants it)" in failure.value.why
        assert failure.value.failure is FailureClass.PLATFORM
        assert not failure.value.ends_run
    with (
        unicycle(),
        nav2(refuses=True),
        driver(robot, tmp_path) as platform,
        pytest.raises(BenchbotError, match="refused the goal"),
    ):
        move_next(platform, robot)


def test_a_goal_that_takes_too_long_is_called_off(tmp_path: Path) -> None:
    robot = navigated(motion={**BY_NAVIGATION, "timeout_s": 1.0})
    # The guard waits for the end of the goal, for longer than a velocity holds.
    with unicycle() as there, nav2(cancels_after_s=1.5) as said, driver(robot, tmp_path) as platform:
        assert move_next(platform, robot)[0] is Outcome.TIMEOUT
        assert there.state["v"] == 0.0
        assert there.state["x"] < 1.5
    assert {"cancelled": "NavigateToPose"} in said


def test_contact_ends_the_navigation(tmp_path: Path) -> None:
    robot = navigated()
    with unicycle(wall_x_m=1.2) as there, nav2(), driver(robot, tmp_path) as platform:
        # The stand-in looks at no sensor: what brakes is what the driver sees in the scan.
        assert move_next(platform, robot)[0] is Outcome.BLOCKED
        assert 0.6 < there.state["x"] < 1.0
        there.set(collides=True)
        host = InProcessHost(platform, [scene()], MotionConfig.from_robot(robot, "ground_truth"))
        host._tracked.begin()
        assert host.act("move_next", {}, Pose.planar(-1.0, 0.0, 0.0))[0] is Outcome.COLLIDED


def _stopped_while_navigated(tmp_path: Path, fault: dict[str, Any], *reasons: str, **settings: Any) -> None:
    """Break the robot on its way; it stops for good, says why, and its navigation is called off."""
    # Another program may keep this computer busy for a second.
    robot = navigated(**{"timing": {"feedback_timeout_s": 2.0}, **settings})
    with unicycle() as there, nav2() as said, driver(robot, tmp_path) as platform:
        breaking = threading.Thread(target=_break, args=(there, platform, fault))
        breaking.start()
        with pytest.raises(BenchbotError) as failure:
            pytest.fail(f"it ended: {move_next(platform, robot, Pose.planar(4.0, 0.0, 0.0))}")
        for reason in reasons:
            assert reason in failure.value.why
        breaking.join()
        until(lambda: there.state["v"] == 0.0)
        assert there.state["x"] < 3.0
        until(lambda: {"cancelled": "NavigateToPose"} in said)
        assert failure.value.failure is FailureClass.PLATFORM
        assert failure.value.ends_run


def _break(there: Unicycle, platform: Ros2Driver, fault: dict[str, Any]) -> None:
    until(lambda: there.state["x"] > 0.2)
    if fault:
        there.set(**fault)
    else:
        platform.halt("The solution hung up.")


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ({}, "The solution hung up."),
        ({"silent": ["/scan"]}, "Nothing new came on /scan"),
        ({"place_off_m": 1.0}, "Its localisation jumped"),
        ({"pressed": True}, "The emergency stop is pressed."),
        ({"held": False}, "Nobody holds the dead-man switch."),
    ],
    ids=["halt", "stale", "jump", "e-stop", "dead-man"],
)
def test_what_stops_a_robot_stops_its_navigation(tmp_path: Path, fault: dict[str, Any], why: str) -> None:
    boolean = "std_msgs/msg/Bool"
    safety = {
        "e_stop": {"ros_topic": "/e_stop", "ros_type": boolean},
        "dead_man": {"ros_topic": "/dead_man", "ros_type": boolean, "timeout_s": 2.0},
    }
    _stopped_while_navigated(tmp_path, fault, why, safety=safety)


def test_odometry_that_falls_silent_says_that_nobody_knows_whether_it_stands(tmp_path: Path) -> None:
    reasons = "Nothing new came on /odom", "3 s later odometry still said"
    _stopped_while_navigated(tmp_path, {"silent": ["/odom"]}, *reasons)


@pytest.mark.parametrize("misbehaves", ["drives_on", "refuses_to_cancel"])
def test_a_navigation_that_drives_on_is_stopped_for_good_and_told_of(tmp_path: Path, misbehaves: str) -> None:
    robot = navigated(motion={**BY_NAVIGATION, "timeout_s": 1.0})
    with unicycle() as there, nav2(**{misbehaves: True}), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="stopped for safety") as failure:
            move_next(platform, robot, Pose.planar(4.5, 0.0, 0.0))
        assert "The motion was timeout. Nav2" in failure.value.why
        assert failure.value.ends_run
        # The guard's zeros come first in the robot's mux.
        until(lambda: there.state["v"] == 0.0)


def test_a_navigation_that_dies_ends_the_run(tmp_path: Path) -> None:
    robot = navigated()
    with unicycle() as there, nav2(dies_beyond_m=0.3), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="stopped for safety") as failure:
            move_next(platform, robot)
        assert "/navigate_to_pose went away meanwhile. Nav2 did not confirm" in failure.value.why
        assert failure.value.ends_run
        until(lambda: there.state["v"] == 0.0)


def test_a_driver_that_is_killed_leaves_a_robot_that_stops(tmp_path: Path, domain: int) -> None:
    program = (
        "import json, sys; from pathlib import Path\n"
        "from plugins.robot_ros2.tests.test_driver_navigation import *\n"
        "robot = navigated()\n"
        "with driver(robot, Path(sys.argv[1])) as platform: move_next(platform, robot, Pose.planar(4.5, 0.0, 0.0))\n"
    )
    with unicycle() as there, nav2() as said:
        process = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)])
        until(lambda: there.state["x"] > 0.2)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        until(lambda: {"cancelled": "NavigateToPose"} in said)
        until(lambda: there.state["v"] == 0.0)
        assert there.state["x"] < 3.0


def test_a_rival_on_the_guards_topic_is_refused(tmp_path: Path) -> None:
    robot = navigated()
    with unicycle(), nav2(velocity_topic="/cmd_vel"), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="cannot be navigated") as failure:
            platform.load(scene(), 0)
        assert "/controller_server commands velocities on /cmd_vel, too" in failure.value.why
        assert "twist_mux" in failure.value.fix


def test_without_a_server_the_run_does_not_begin(tmp_path: Path) -> None:
    robot = navigated(timing={"wait_s": 5.0})
    with unicycle(), driver(robot, tmp_path) as platform:
        with pytest.raises(BenchbotError, match="No action server /navigate_to_pose is there") as failure:
            platform.load(scene(), 0)
        assert failure.value.failure is FailureClass.PLATFORM
