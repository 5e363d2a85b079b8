"""A submission whose robot a person takes over for a while: it goes on by itself, and its result says so."""

import json
from collections.abc import Callable

from plugins.robot_ros2.tests.system.chain import submission, until_under_way
from plugins.robot_ros2.tests.unicycle import MOUNTS, PATIENCE_S, unicycle, until
from tests.command_line import CommandLine

Declared = Callable[..., CommandLine]
JOYSTICK = {"ros_topic": "/joy", "ros_type": "sensor_msgs/msg/Joy", "button": 1, "timeout_s": 3.0}


def test_a_run_that_a_person_interrupts_ends_well_and_says_for_how_long(declared: Declared) -> None:
    cli = declared(
        safety={"take_over": JOYSTICK},
        localisation={"by": "topic", "ros_topic": "/truth", "ros_type": "nav_msgs/msg/Odometry"},
    )
    with unicycle(mounts=MOUNTS) as robot, submission(cli) as submitted:
        until_under_way(robot, submitted)
        robot.set(hand=[-0.3, 0.0])
        until(lambda: robot.state["backwards_m"] > 0.3)
        robot.set(hand=None)
        assert submitted.process.wait(2 * PATIENCE_S) == 0, submitted.said
        assert robot.state["heard_under_hand"] == 0

    provenance = json.loads((cli.folder / "result.json").read_text())["provenance"]
    assert provenance["failure"] is None
    assert provenance["taken_over"]["times"] == 1
    assert provenance["taken_over"]["duration_s"] > 1.0
    assert "A person took the robot over once, for" in submitted.said
