from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.findings import Level
from benchbot.core.motion import Outcome
from benchbot.core.platform import PlatformSpec
from benchbot_robot_ros2.doctor.diagnosis import diagnose
from plugins.robot_ros2.tests.unicycle import act, arm_declaration, declaration, driver, scene, unicycle

pytestmark = pytest.mark.usefixtures("domain")


def test_an_arm_is_moved_joint_by_joint_and_seen_in_the_order_of_the_declaration(tmp_path: Path) -> None:
    robot = arm_declaration()
    with unicycle(arm=True) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        # The robot publishes a wheel, too, and another order.
        seen = platform.observe(["joint_states", "poses"])["joint_states"]
        assert seen["names"] == ["shoulder", "elbow", "gripper"]
        assert seen["positions"].tolist() == [0.0, 0.0, 0.0]
        assert np.isnan(seen["velocities"]).all()
        assert seen["efforts"].tolist() == [7.0, 7.0, 7.0]

        assert act(platform, robot, "move_joints", positions=[1.0, -0.8]) is Outcome.REACHED
        assert act(platform, robot, "move_gripper", width=0.06) is Outcome.REACHED
        state = there.state
        assert (state["joints"]["shoulder"], state["joints"]["elbow"]) == pytest.approx((1.0, -0.8), abs=0.01)
        assert state["joints"]["finger_1"] == pytest.approx(0.03, abs=0.002)
        # 1.5 rad/s, 20 times a second; on the way a setpoint may have been lost.
        assert 0.06 < state["longest_step"]["shoulder"] < 2 * 1.5 / 20
        assert (state["x"], state["y"]) == (0.0, 0.0)
        seen = platform.observe(["joint_states"])["joint_states"]
        assert seen["positions"] == pytest.approx([1.0, -0.8, 0.06], abs=0.01)

        # What the arm does not have is told, and moves nothing.
        refusals: list[tuple[str, dict[str, Any], str]] = [
            ("move_joints", {"positions": [0.0] * 6}, "move_joints was given 6 positions"),
            ("move_joints", {"positions": [2.5, 0.0]}, "The joint 'shoulder' cannot be at 2.5 rad"),
            ("move_gripper", {"width": 0.2}, "The gripper does not open 0.2 m wide"),
        ]
        for action, arguments, complaint in refusals:
            with pytest.raises(BenchbotError, match=complaint) as refused:
                list(platform.manipulate(action, arguments))
            assert refused.value.failure is FailureClass.AGENT
        assert there.state["setpoints"] == state["setpoints"]
        # The base can be driven as ever.
        assert act(platform, robot, "move_angle", angle=20) is Outcome.REACHED


def test_what_holds_an_arm_or_lies_between_its_fingers_blocks_it(tmp_path: Path) -> None:
    robot = arm_declaration()
    # Its joints are told of five times a second, as seldom as may be.
    with unicycle(arm=True, states_every=10) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(stuck={"elbow": 0.3})
        assert act(platform, robot, "move_joints", positions=[0.2, 1.5]) is Outcome.BLOCKED
        held = there.state["joints"]
        assert held["elbow"] == pytest.approx(0.3)
        assert abs(held["shoulder"]) < 0.25
        there.set(stuck={})
        # It was told to stay where it is: let go, it does not jump.
        assert act(platform, robot, "move_joints", positions=[held["shoulder"], 0.3]) is Outcome.REACHED

        there.set(stuck={"finger_1": 0.02, "finger_2": 0.02})
        assert act(platform, robot, "move_gripper", width=0.08) is Outcome.BLOCKED
        # It goes on opening: fingers that hold something do so for as long as they are told.
        there.set(stuck={})
        assert act(platform, robot, "move_joints", positions=[0.1, 0.2]) is Outcome.REACHED
        assert there.state["joints"]["finger_1"] == pytest.approx(0.04, abs=0.002)
        there.set(collides=True)
        platform.drive(0.1, 0.0, 0.1)
        assert act(platform, robot, "move_joints", positions=[0.0, 0.0]) is Outcome.COLLIDED


@pytest.mark.parametrize("fault", ["silent", "pressed"])
def test_an_arm_gets_no_setpoints_when_the_robot_is_stopped(tmp_path: Path, fault: str) -> None:
    e_stop = {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}
    robot = arm_declaration(safety={"e_stop": e_stop})
    robot["arm"]["joints"]["shoulder"] |= {"radps": 0.1}
    with unicycle(arm=True) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        moving = platform.manipulate("move_joints", {"positions": [2.0, 0.0]})
        for _ in range(8):
            next(moving)
        there.set(**({"silent": ["/joint_states"]} if fault == "silent" else {"pressed": True}))
        with pytest.raises(BenchbotError, match="stopped for safety") as stopped:
            list(moving)
        assert stopped.value.ends_run
        assert ("/joint_states" if fault == "silent" else "emergency stop") in stopped.value.why
        told = there.state["setpoints"]
        with pytest.raises(BenchbotError, match="stopped for safety"):
            act(platform, robot, "move_joints", positions=[0.0, 0.0])
        # One may have been under way.
        assert there.state["setpoints"] <= told + 1
        assert there.state["joints"]["shoulder"] < 0.5


def test_an_arm_that_nobody_controls_or_that_tells_of_other_joints_is_told(tmp_path: Path) -> None:
    robot = arm_declaration()
    robot["connections"]["move_joints"]["ros_topic"] = "/other/commands"
    with unicycle(arm=True) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        options = {"seconds": 1.0}
        found = {one.subject: one for one in diagnose(PlatformSpec(robot, "ground_truth", tmp_path, options))}
        assert found["move_joints /other/commands"].level is Level.BROKEN
        assert found["move_gripper /gripper/commands"].level is Level.OK
        assert found["topic /joint_states"].level is Level.OK
        with pytest.raises(BenchbotError, match="nobody subscribes to /other/commands"):
            act(platform, robot, "move_joints", positions=[0.1, 0.1])
        there.set(joints=["wheel", "shoulder", "finger_1", "finger_2"])
        platform.load(scene(), 0)
        with pytest.raises(BenchbotError, match="joint_states cannot be read") as failure:
            platform.observe(["joint_states"])
        assert "it has no joint 'elbow', but wheel, shoulder" in failure.value.why


def _without(key: str) -> dict[str, Any]:
    robot = arm_declaration()
    (robot["arm"] if key == "gripper" else robot["connections"] if key == "joint_states" else robot).pop(key)
    return robot


@pytest.mark.parametrize(
    ("robot", "where", "why"),
    [
        (_without("arm"), "arm", "no key 'arm' says which joints"),
        (_without("joint_states"), "connections.move_joints", "there is no connections.joint_states"),
        (_without("gripper"), "arm", "missing required field `gripper`"),
        ({**arm_declaration(), "arm": {"joints": {}}}, "arm", "length >= 1"),
    ],
)
def test_an_arm_that_cannot_be_moved_is_refused(robot: dict[str, Any], where: str, why: str, tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match=rf"wrong at '{where}'") as failure, driver(robot, tmp_path):
        pass
    assert why in failure.value.why


def test_an_end_effector_is_not_moved_over_ros(tmp_path: Path) -> None:
    robot = arm_declaration()
    robot["connections"]["move_end_effector"] = robot["connections"]["move_joints"]
    with pytest.raises(BenchbotError, match="nothing here knows its kinematics") as refused, driver(robot, tmp_path):
        pass
    assert "by move_joints" in refused.value.fix
    assert "arm" not in declaration()
