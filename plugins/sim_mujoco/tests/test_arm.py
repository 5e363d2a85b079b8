"""The arm moves within its limits, holds by friction alone, stops at what it hits, and tells the truth."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Manipulator, Scene, Witness
from benchbot_sim_mujoco.simulator import MujocoSimulator
from plugins.sim_mujoco.tests.rooms import kitchen, scene, simulator
from plugins.sim_taichi.tests.glb import Glb

DOWN = [1.0, 0.0, 0.0, 0.0]
LABELS = ["table", "cup", "tray"]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return scene(kitchen(tmp_path_factory.mktemp("kitchen") / "kitchen.glb"), object_labels=LABELS)


def manipulator(room: Scene, loose: tuple[str, ...] = ("block",), **changes: Any) -> MujocoSimulator:
    robot = simulator({"loose": list(loose)}, robot_name="carter_arm_lowres", **changes)
    robot.load(room, 0)
    return robot


def act(robot: MujocoSimulator, action: str, **arguments: Any) -> Outcome:
    return execute(robot, action, arguments, None, MotionConfig.from_robot(robot.spec.robot, "ground_truth"))


def grasp(robot: MujocoSimulator) -> None:
    assert act(robot, "move_gripper", width=0.1) is Outcome.REACHED
    for height_m in (0.95, 0.79):
        assert act(robot, "move_end_effector", pose=[0.58, 0.0, height_m, *DOWN]) is Outcome.REACHED
    assert act(robot, "move_gripper", width=0.0) is Outcome.BLOCKED, "it holds something"
    assert act(robot, "move_end_effector", pose=[0.58, 0.0, 0.95, *DOWN]) is Outcome.REACHED


def fold(robot: MujocoSimulator) -> Outcome:
    return act(robot, "move_joints", positions=np.radians(robot.spec.robot["arm"]["home_deg"]).tolist())


def height_m(robot: MujocoSimulator, name: str = "block") -> float:
    witnessed = robot.witnessed()
    assert witnessed is not None
    return witnessed.objects[name].translation_xyz[2]


def test_it_is_a_manipulator_that_bears_witness() -> None:
    robot = simulator()
    assert isinstance(robot, Manipulator)
    assert isinstance(robot, Witness)


def test_it_fetches_carries_and_puts_down(room: Scene) -> None:
    robot = manipulator(room)
    grasp(robot)
    assert height_m(robot) == pytest.approx(0.785 + 0.16, abs=0.01)
    assert fold(robot) is Outcome.REACHED
    assert act(robot, "move_distance", distance=-0.3) is Outcome.REACHED
    for angle in (90.0, -90.0):
        assert act(robot, "move_angle", angle=angle) is Outcome.REACHED
    assert act(robot, "move_distance", distance=0.3) is Outcome.REACHED
    witnessed = robot.witnessed()
    assert witnessed is not None
    assert witnessed.held == ("block",)
    assert robot.observe(["joint_states"])["joint_states"]["efforts"][-1] == pytest.approx(30.0, abs=1.0)
    for up_m in (0.95, 0.81):
        assert act(robot, "move_end_effector", pose=[0.6, 0.25, up_m, *DOWN]) is Outcome.REACHED
    assert act(robot, "move_gripper", width=0.1) is Outcome.REACHED
    act(robot, "move_end_effector", pose=[0.6, 0.25, 0.95, *DOWN])
    witnessed = robot.witnessed()
    assert witnessed is not None
    assert witnessed.held == ()
    x, y, z = witnessed.objects["block"].translation_xyz
    assert (x, y) == pytest.approx((0.6, 0.25), abs=0.04)
    assert z == pytest.approx(0.75 + 0.045, abs=5e-3), "it stands on the plate"
    assert witnessed.energy_j > 5.0
    assert witnessed.end_effector_path_m > 1.0
    assert not robot.collided


def test_the_same_actions_end_with_the_same_bytes(room: Scene) -> None:
    robot = manipulator(room)
    ends = []
    for _ in range(2):
        robot.load(room, 3)
        grasp(robot)
        joints = robot.observe(["joint_states"])["joint_states"]
        ends.append((robot.world.physics.data.qpos.tobytes(), joints["efforts"].tobytes(), robot.witnessed()))
    assert ends[0] == ends[1]


def test_it_says_what_it_cannot_reach_and_has_not_moved(room: Scene) -> None:
    robot = manipulator(room)
    before = robot.world.physics.data.qpos.tobytes()
    assert act(robot, "move_end_effector", pose=[2.0, 0.0, 0.9, *DOWN]) is Outcome.UNREACHABLE
    assert robot.world.physics.data.qpos.tobytes() == before
    assert robot.clock() == 0.0


def test_the_arm_stops_where_it_pushes_the_table(room: Scene) -> None:
    robot = manipulator(room)
    assert act(robot, "move_end_effector", pose=[0.66, -0.25, 0.95, *DOWN]) is Outcome.REACHED
    assert act(robot, "move_end_effector", pose=[0.66, -0.25, 0.62, *DOWN]) is Outcome.COLLIDED
    assert robot.collided
    gripper = robot.observe(["poses"])["poses"]["gripper"]["translation_xyz"]
    assert gripper[2] == pytest.approx(0.74 + 0.02, abs=0.015), "its fingers reach 2 cm further"
    robot.load(room, 0)
    assert not robot.collided


def test_what_it_drives_into_with_its_arm_is_a_collision(room: Scene) -> None:
    robot = manipulator(room, stops_before_contact=False)
    act(robot, "move_distance", distance=-0.8)
    assert act(robot, "move_end_effector", pose=[0.75, 0.0, 0.7, *DOWN]) is Outcome.REACHED
    assert act(robot, "move_distance", distance=0.8) is Outcome.COLLIDED
    assert robot.collided


def test_frames_and_joint_states_are_where_the_arm_is(room: Scene) -> None:
    robot = manipulator(room)
    act(robot, "move_end_effector", pose=[0.6, -0.2, 0.95, *DOWN])
    seen = robot.observe(["poses", "joint_states"])
    np.testing.assert_allclose(seen["poses"]["gripper"]["translation_xyz"], [0.6, -0.2, 0.95], atol=6e-3)
    assert seen["joint_states"]["names"][0] == "shoulder_yaw"
    assert seen["joint_states"]["names"][-1] == "gripper"
    found = robot.arm().kinematics.forward(seen["joint_states"]["positions"][:-1])
    place = robot.arm().declared.mount.matrix() @ found
    np.testing.assert_allclose(place[:3, 3], robot.mounts()["gripper"].translation_xyz, atol=1e-9)


def test_joints_keep_their_speeds(room: Scene) -> None:
    robot = manipulator(room)
    declared = robot.arm().declared.limits.speeds
    fastest = np.zeros(6)
    for _ in robot.manipulate("move_joints", {"positions": [1.5, 0.5, 1.0, -1.0, 0.5, 2.0]}):
        fastest = np.maximum(fastest, np.abs(robot.observe(["joint_states"])["joint_states"]["velocities"][:-1]))
    assert (fastest < 1.05 * declared).all()
    assert (fastest / declared).max() > 0.7


@pytest.mark.parametrize(
    ("action", "arguments", "title", "fix"),
    [
        ("move_joints", {"positions": [0.0] * 5}, "5 positions", "one for each"),
        ("move_joints", {"positions": [0, 0, 140, 0, 0, 0]}, "'elbow' cannot be at 140 rad", "2.65"),
        ("move_gripper", {"width": 0.2}, "does not open 0.2 m", "width=0.11"),
        ("move_end_effector", {"pose": [0.5, 0, 0.9, 1, 1, 0, 0]}, "norm", "straight down is"),
    ],
)
def test_what_the_arm_cannot_do_is_refused_with_what_it_can(
    room: Scene, action: str, arguments: dict[str, Any], title: str, fix: str
) -> None:
    with pytest.raises(BenchbotError, match=title) as caught:
        act(manipulator(room), action, **arguments)
    assert fix in caught.value.fix
    assert caught.value.failure is FailureClass.AGENT


def test_a_robot_without_an_arm_says_so(room: Scene) -> None:
    robot = simulator()
    robot.load(room, 0)
    with pytest.raises(BenchbotError, match="has no arm"):
        act(robot, "move_gripper", width=0.1)


@pytest.mark.parametrize(
    ("change", "why"),
    [({"model": "arms"}, "Did you mean 'arm'"), ({"home_deg": [0, 0]}, "6 joints"), ({"joints": {}}, "6 joints")],
)
def test_an_arm_that_is_declared_wrongly_is_explained(change: dict[str, Any], why: str) -> None:
    arm = {**simulator(robot_name="carter_arm").spec.robot["arm"], **change}
    with pytest.raises(BenchbotError) as caught:
        simulator(robot_name="carter_arm", arm=arm)
    assert why in caught.value.why


def test_objects_begin_where_an_episode_says(room: Scene) -> None:
    robot = simulator({"loose": ["block"]}, robot_name="carter_arm_lowres")
    placed = {"loose_objects": [{"name": "block", "position": [0.9, -0.3, 0.74], "turn_deg": 45.0}]}
    robot.load(Scene({**room.environment, **placed}, room.folder), 0)
    witnessed = robot.witnessed()
    assert witnessed is not None
    assert witnessed.objects["block"].translation_xyz == pytest.approx((0.9, -0.3, 0.785), abs=2e-3)
    assert np.degrees(witnessed.objects["block"].yaw_rad) == pytest.approx(45.0, abs=1.0)
    robot.load(room, 0)
    assert height_m(robot) == pytest.approx(0.785, abs=2e-3)


@pytest.mark.parametrize(
    ("objects", "why"),
    [
        ([{"name": "plate", "position": [0.9, 0, 0.74]}], "It is not loose; these are: block"),
        ([{"name": "block", "position": [1.5, 0, 0.9]}], "nothing is below"),
    ],
)
def test_objects_that_cannot_begin_there_are_explained(room: Scene, objects: list[Any], why: str) -> None:
    robot = simulator({"loose": ["block"]}, robot_name="carter_arm_lowres")
    with pytest.raises(BenchbotError) as caught:
        robot.load(Scene({**room.environment, "loose_objects": objects}, room.folder), 0)
    assert why in caught.value.why


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 90.0])
def test_the_arm_touches_a_sheet_as_thin_as_the_screen_of_a_laptop(tilt_deg: float, tmp_path: Path) -> None:
    glb = Glb()
    grey = glb.material()
    glb.box("floor", (-3, -3, -0.1), (3, 3, 0.0), grey)
    tilt_rad = np.radians(tilt_deg)
    along, up = np.array([np.sin(tilt_rad), 0, np.cos(tilt_rad)]), np.array([0, 1, 0])
    corners = [[0.7, 0, 0.9] + a * 0.3 * along + b * 0.3 * up for a, b in [(-1, -1), (-1, 1), (1, 1), (1, -1)]]
    glb.add("screen", np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]), grey, class_name="tray")
    room = scene(glb.write(tmp_path / "screen.glb"), object_labels=LABELS)
    robot = manipulator(room, ())

    ended = act(robot, "move_end_effector", pose=[0.75, 0.0, 0.9, *DOWN])

    assert ended in (Outcome.BLOCKED, Outcome.COLLIDED)


def test_a_rolling_ball_does_not_gain_speed(room: Scene) -> None:
    """An object far from the scene's origin, spun fast, is integrated about its own middle."""
    robot = manipulator(room)
    data = robot.world.physics.data
    data.joint("block").qpos[:3] = [2.0, 2.0, 1.5]
    data.joint("block").qvel[3:] = [20.0, 15.0, 10.0]
    for _ in range(40):
        robot.drive(0.0, 0.0, robot.control_period_s)
    assert np.abs(data.joint("block").qvel).max() < 5.0
    assert 0.0 < height_m(robot) < 0.1


def test_the_camera_sees_the_arm_and_scanners_do_not(room: Scene) -> None:
    robot = manipulator(room)
    rows = {"laser": robot.observe(["laser"])["laser"]["scans"][:, 0]}
    folded = robot.observe(["image_depth", "image_segment"])
    act(robot, "move_end_effector", pose=[0.66, -0.2, 0.95, *DOWN])
    reaching = robot.observe(["image_depth", "image_segment"])
    nearer = reaching["image_depth"] < folded["image_depth"] - 0.1
    assert nearer.mean() > 0.01
    assert not reaching["image_segment"]["class_segment_img"][nearer].any(), "the arm has no class"
    np.testing.assert_allclose(robot.observe(["laser"])["laser"]["scans"][:, 0], rows["laser"], atol=0.02)


@pytest.mark.xdist_group("renderer")
def test_the_ray_tracer_shows_what_is_held_and_the_robot_before_it(room: Scene, kernel_cache: Path) -> None:
    seen = []
    choices: list[dict[str, Any]] = [{}, {"pictures": "sim_taichi"}]
    for options in choices:
        robot = simulator({"loose": ["block"], **options}, kernel_cache, robot_name="carter_arm_lowres")
        robot.load(room, 0)
        grasp(robot)
        seen.append(robot.observe(["image_depth", "image_segment"]))
    ours, theirs = seen
    assert np.mean(np.isclose(ours["image_depth"], theirs["image_depth"], rtol=0, atol=2e-3)) > 0.985
    classes = [frame["image_segment"]["class_segment_img"] for frame in seen]
    assert np.mean(classes[0] == classes[1]) > 0.995
