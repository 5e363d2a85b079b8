"""Wheels roll, contact stops, and what is loose is pushed."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Scene
from benchbot_sim_mujoco.simulator import MujocoSimulator
from plugins.sim_mujoco.tests.rooms import scene, simulator, workshop

EXACT_WHEELS: dict[str, Any] = {"noise": {"linear": 0.0, "angular": 0.0}}


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return scene(workshop(tmp_path_factory.mktemp("workshop") / "workshop.glb"))


def drive(robot: MujocoSimulator, linear_mps: float, angular_radps: float, duration_s: float) -> None:
    for _ in range(round(duration_s / robot.control_period_s)):
        robot.drive(linear_mps, angular_radps, robot.control_period_s)


def place_of(robot: MujocoSimulator, name: str) -> np.ndarray:
    return robot.world.physics.moved(name)[0]


def test_wheels_roll_without_slipping_on_a_free_floor(room: Scene) -> None:
    robot = simulator(**EXACT_WHEELS)
    robot.load(room, 0)
    for command in ((-0.4, 0.0), (0.3, 0.5), (0.0, -0.8), (0.0, 0.0)):
        drive(robot, *command, 1.0)
    away_m = math.dist(robot.pose().translation_xyz[:2], robot.odometry().translation_xyz[:2])
    assert away_m < 0.01
    assert robot.pose().yaw_rad == pytest.approx(robot.odometry().yaw_rad, abs=0.01)
    assert abs(robot.pose().translation_xyz[2]) < 1e-3


@pytest.mark.parametrize("angle_deg", [90.0, -200.0])
def test_actions_reach_their_goals(room: Scene, angle_deg: float) -> None:
    robot = simulator()
    robot.load(room, 0)
    config = MotionConfig.from_robot(robot.spec.robot, "ground_truth")
    assert execute(robot, "move_angle", {"angle": angle_deg}, None, config) is Outcome.REACHED
    assert execute(robot, "move_distance", {"distance": -0.5}, None, config) is Outcome.REACHED


def test_an_episode_gives_the_same_bytes_after_any_other(room: Scene) -> None:
    """Objects and robot had settled where the first episode began, and differed in the last bits from then on."""

    def episode(robot: MujocoSimulator, start_pose: list[float]) -> bytes:
        robot.load(Scene({**room.environment, "start_pose": start_pose}, room.folder), 7)
        drive(robot, 0.4, 0.3, 0.5)
        return bytes(robot.world.physics.data.qpos.tobytes())

    def fresh() -> MujocoSimulator:
        return simulator({"loose": ["crate"]}, **EXACT_WHEELS)

    starts = [[0.9553, 0.0, 0.0, 0.2955, 0.1, 0.0, 0.0], [0.3624, 0.0, 0.0, -0.932, -0.2, 0.3, 0.0]]
    alone = [episode(fresh(), start) for start in starts]
    shared = fresh()
    for number in (0, 1, 0, 0, 1):
        assert episode(shared, starts[number]) == alone[number]


def test_motion_that_is_not_finite_is_an_error_and_leaves_no_log(
    room: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    robot = simulator()
    robot.load(room, 0)
    robot.world.physics._data.qvel[0] = math.nan
    with pytest.raises(BenchbotError, match="lost hold") as raised:
        robot.drive(0.1, 0.0, robot.control_period_s)
    assert "unstable" in raised.value.why
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("speed_mps", [0.2, 1.5])
def test_the_robot_stops_where_it_touches_a_wall(room: Scene, speed_mps: float) -> None:
    robot = simulator(**EXACT_WHEELS)
    robot.load(room, 0)
    robot.place(Pose.planar(4.0, -1.5, 0.0))
    drive(robot, speed_mps, 0.0, 8.0)
    assert robot.collided
    assert robot.pose().translation_xyz[0] == pytest.approx(5.0 - 0.3, abs=2e-3)
    assert robot.velocity == pytest.approx((0.0, 0.0), abs=1e-3)


def test_wheels_that_slip_are_believed(room: Scene) -> None:
    """Placed by hand, a robot does not know; held by a wall it thinks that it goes on."""
    robot = simulator(**EXACT_WHEELS)
    robot.load(room, 0)
    robot.place(Pose.planar(4.69, 1.0, 0.0))
    assert robot.odometry().translation_xyz[:2] == pytest.approx((0.0, 0.0))
    drive(robot, 0.5, 0.0, 3.0)
    assert robot.pose().translation_xyz[0] == pytest.approx(4.7, abs=2e-3)
    assert robot.odometry().translation_xyz[0] > 0.0


def test_a_loose_object_is_pushed_and_seen_where_it_is(room: Scene) -> None:
    robot = simulator({"loose": ["crate"]})
    robot.load(room, 0)
    ahead_m = float(robot.observe(["laser"])["laser"]["scans"][450, 0])
    assert not robot.contact_ahead(0.5, 0.0, 4.0), "what can be pushed is no obstacle"
    drive(robot, 0.5, 0.0, 4.0)
    way_m = float(place_of(robot, "crate")[0])
    assert not robot.collided
    assert way_m > 0.3
    assert abs(place_of(robot, "small crate")).max() < 0.01, "it lies on the table"
    robot.place(Pose())
    seen = robot.observe(["laser", "image_segment"])
    assert seen["laser"]["scans"][450, 0] == pytest.approx(ahead_m + way_m, abs=0.02)
    assert 1001 in seen["image_segment"]["instance_segment_img"]
    robot.load(room, 0)
    assert abs(place_of(robot, "crate")).max() < 0.01, "everything is back where the scene begins"


def test_without_the_option_a_crate_is_an_obstacle(room: Scene) -> None:
    robot = simulator()
    robot.load(room, 0)
    drive(robot, 0.5, 0.0, 4.0)
    assert robot.collided
    assert robot.pose().translation_xyz[0] == pytest.approx(1.35 - 0.3, abs=2e-3)


@pytest.mark.parametrize(
    ("loose", "title", "told"),
    [("crat", "There is no object 'crat'", "crate"), ("lamp", "The object 'lamp' does not stay", "hangs")],
)
def test_what_cannot_be_loose_is_explained(room: Scene, loose: str, title: str, told: str) -> None:
    with pytest.raises(BenchbotError, match=title) as caught:
        simulator({"loose": [loose]}).load(room, 0)
    assert told in caught.value.why


def test_the_same_commands_push_to_the_same_place_to_the_byte(room: Scene) -> None:
    places = []
    for _ in range(2):
        robot = simulator({"loose": ["crate"]})
        for _ in range(2):
            robot.load(room, 3)
            drive(robot, 0.6, 0.1, 3.0)
            places.append((place_of(robot, "crate").tobytes(), robot.pose(), robot.odometry()))
    assert len(set(places)) == 1


def test_a_robot_that_does_not_fit_is_told(room: Scene) -> None:
    with pytest.raises(BenchbotError, match="does not fit"):
        simulator().load(Scene({**room.environment, "start_pose": [1, 0, 0, 0, 1.2, 0, 0]}, room.folder), 0)


@pytest.mark.xdist_group("renderer")
def test_another_simulator_takes_the_pictures(room: Scene, kernel_cache: Path) -> None:
    """The ray tracer shows a crate where the robot has pushed it, as MuJoCo's own pictures do."""
    seen = []
    choices: list[dict[str, Any]] = [{}, {"pictures": "sim_taichi"}]
    for options in choices:
        robot = simulator({"loose": ["crate"]} | options, cache_dir=kernel_cache)
        robot.load(room, 0)
        drive(robot, 0.5, 0.0, 4.0)
        robot.place(Pose())
        seen.append(robot.observe(["image_depth", "image_segment"]))
        assert robot.provenance().get("pictures") == options.get("pictures")
    ours, theirs = seen
    assert np.mean(np.isclose(ours["image_depth"], theirs["image_depth"], rtol=0, atol=2e-3)) > 0.99
    numbers = [frame["image_segment"]["instance_segment_img"] for frame in seen]
    assert np.mean(numbers[0] == numbers[1]) > 0.999


def test_pictures_of_a_simulator_that_there_is_not_are_explained(room: Scene) -> None:
    with pytest.raises(BenchbotError, match="No pictures come from 'sim_taichy'") as caught:
        simulator({"pictures": "sim_taichy"}).load(room, 0)
    assert "sim_taichi" in caught.value.why


def test_a_base_on_two_wheels_is_not_driven_sideways() -> None:
    limits: dict[str, Any] = {**simulator().spec.robot["limits"], "lateral_mps": 0.5}
    with pytest.raises(BenchbotError, match=r"cannot drive the robot .* sideways"):
        simulator(limits=limits)
