"""The closed form is the inverse of the model that is simulated, and motions keep the limits of joints."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.declarations import schema
from benchbot_sim_mujoco.arm import MODELS
from benchbot_sim_mujoco.joint_path import Limits, timed
from benchbot_sim_mujoco.kinematics import Floats, Kinematics, straight, turn_rad
from plugins.sim_mujoco.tests.rooms import ROBOTS, simulator

MODEL = mujoco.MjModel.from_xml_path(str(MODELS / "arm.xml"))
KINEMATICS = Kinematics(0.15, 0.40, 0.38, 0.17, MODEL.jnt_range[:6].copy())
STEP_S = 0.0025

joints = st.tuples(*(st.floats(low, high) for low, high in KINEMATICS.limits_rad.tolist())).map(np.array)


@given(joints)
def test_forward_kinematics_are_those_of_the_model(positions: Floats) -> None:
    data = mujoco.MjData(MODEL)
    data.qpos[:6] = positions
    mujoco.mj_kinematics(MODEL, data)
    pose = KINEMATICS.forward(positions)
    np.testing.assert_allclose(pose[:3, 3], data.site("end_effector").xpos, atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3].ravel(), data.site("end_effector").xmat, atol=1e-12)


@given(joints, joints)
def test_every_pose_that_joints_reach_is_reached_again_within_their_limits(positions: Floats, near: Floats) -> None:
    wanted = KINEMATICS.forward(positions)
    found = KINEMATICS.inverse(wanted, near)
    if found is None:
        # Next to a singularity another turn of the first or fourth joint may be beyond its limit; from there it is not.
        found = KINEMATICS.inverse(wanted, positions)
    assert found is not None
    assert (found >= KINEMATICS.limits_rad[:, 0]).all()
    assert (found <= KINEMATICS.limits_rad[:, 1]).all()
    np.testing.assert_allclose(KINEMATICS.forward(found), wanted, atol=1e-6)


@given(joints)
def test_of_all_solutions_the_nearest_is_found(positions: Floats) -> None:
    found = KINEMATICS.inverse(KINEMATICS.forward(positions), positions)
    assert found is not None
    # Where two axes fall together the joints about them may be shared in another way; else they are those again.
    if min(abs(math.sin(positions[4])), abs(math.sin(positions[2]))) > 0.05 and _from_first_axis_m(positions) > 0.02:
        np.testing.assert_allclose(found, positions, atol=1e-5)


def _from_first_axis_m(positions: Floats) -> float:
    """Return how far the wrist is from the first axis."""
    pose = KINEMATICS.forward(positions)
    return float(np.hypot(*(pose[:2, 3] - KINEMATICS.tool_m * pose[:2, 2])))


@pytest.mark.parametrize("far", [(0.9, 0.0, 0.5), (0.0, 0.0, 1.5), (0.0, 0.9, -0.4)])
def test_what_is_too_far_has_no_solution(far: tuple[float, float, float]) -> None:
    pose = np.eye(4)
    pose[:3, 3] = far
    assert KINEMATICS.inverse(pose, np.zeros(6)) is None


@given(joints, joints, st.integers(1, 30))
def test_a_straight_line_is_straight_and_ends_where_it_should(one: Floats, other: Floats, count: int) -> None:
    start, end = KINEMATICS.forward(one), KINEMATICS.forward(other)
    line = straight(start, end, count)
    assert len(line) == count
    np.testing.assert_array_equal(line[-1], end)
    whole_rad = turn_rad(start, end)
    for number, pose in enumerate(line, 1):
        share = number / count
        np.testing.assert_allclose(pose[:3, 3], start[:3, 3] + share * (end[:3, 3] - start[:3, 3]), atol=1e-12)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
        assert turn_rad(start, pose) == pytest.approx(share * whole_rad, abs=1e-5)


paths = st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=2, max_size=8).map(np.array)
limits = st.tuples(*[st.floats(0.1, 3.0)] * 4).map(lambda v: Limits(np.array(v[:2]), np.array(v[2:])))


@given(paths, limits)
def test_a_motion_keeps_speeds_and_ends_at_rest_where_its_path_does(path: Floats, limit: Limits) -> None:
    motion = timed(path, limit, STEP_S)
    np.testing.assert_allclose(motion.positions[-1], path[-1], atol=1e-9)
    assert not motion.velocities[-1].any()
    assert (np.abs(motion.velocities) <= limit.speeds * (1 + 1e-9)).all()
    steps = np.abs(np.diff(np.vstack([path[:1], motion.positions]), axis=0)) / STEP_S
    assert (steps <= limit.speeds * (1 + 1e-6) + 1e-9).all()


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=2, max_size=2).map(np.array), limits)
def test_a_motion_that_is_straight_in_joints_keeps_accelerations(path: Floats, limit: Limits) -> None:
    velocities = np.vstack([np.zeros(2), timed(path, limit, STEP_S).velocities])
    assert (np.abs(np.diff(velocities, axis=0)) / STEP_S <= limit.accelerations * (1 + 1e-6) + 1e-9).all()


def test_the_frame_between_the_fingers_is_declared_where_the_folded_arm_has_it() -> None:
    for name in ("carter_arm", "carter_arm_lowres"):
        robot: dict[str, Any] = schema.read(ROBOTS / f"{name}.yaml")
        declared = simulator(robot_name=name).robot.mounts["gripper"]
        home = np.radians(robot["arm"]["home_deg"])
        found = np.eye(4)
        found[:3, 3] = robot["arm"]["mount"]["xyz"]
        np.testing.assert_allclose(declared.matrix(), found @ KINEMATICS.forward(home), atol=1e-5)
