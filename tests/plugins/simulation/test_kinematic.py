"""A simulator is three functions: what is common to all is right whatever these say."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import ManyCameras, PlatformSpec, Scene
from benchbot.plugin import Simulator
from benchbot.simulation import Camera, Frame, KinematicSimulator, SrgbResponse, State, World
from benchbot.testing import check_simulator, conform

HALF_M, HEIGHT_M = (3.0, 2.0), 2.5
ROBOT: dict[str, Any] = {
    "name": "disc",
    "type": "hall",
    "global_frame": "map",
    "robot_frame": "base_link",
    "poses": ["base_link", "initial_pose", "camera", "lidar"],
    "frames": {"camera": {"xyz": [0.1, 0, 1.0], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0, 0, 0.5]}},
    "connections": {
        name: {"connection": "api_to_ros" if name.startswith("move") else "ros_to_api"}
        for name in (
            *("image_rgb", "image_depth", "image_segment", "image_rgb_info", "image_depth_info", "image_segment_info"),
            *("laser", "poses", "move_distance", "move_angle"),
        )
    },
    "camera": {"frame": "camera", "width": 24, "height": 16, "fx": 12, "fy": 12, "cx": 12, "cy": 8, "range_m": [0.1, 9]}
    | {"rgb_noise": {"saturation_electrons": 30000, "read_electrons": 5}},
    "laser": {"frame": "lidar", "beams": 60, "range_m": [0.1, 9], "noise": {"sigma_m": 0.01}},
    "footprint": {"radius_m": 0.3, "z_min_m": 0.05, "z_max_m": 1.0},
    "limits": {
        "linear_mps": [-0.5, 1.0],
        "angular_radps": 1.0,
        "linear_acceleration_mps2": 2.0,
        "angular_acceleration_radps2": 3.0,
    },
    "noise": {"linear": 0.1, "angular": 0.1},
}
HALL = {"name": "hall", "variant": 1, "type": "hall", "start_pose": [1, 0, 0, 0, 0, 0, 0]}


class Hall(World):
    """An empty hall: a box, seen from inside."""

    def __init__(self) -> None:
        self.renders = 0

    def render(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> list[Frame]:
        self.renders += 1
        rays = np.stack([camera.view.x, camera.view.y, np.ones_like(camera.view.x)], -1).reshape(-1, 3)
        frames = []
        for pose in poses:
            matrix = pose.matrix()
            depth_m = self._hit(np.tile(matrix[:3, 3], (len(rays), 1)), rays @ matrix[:3, :3].T)
            shape = camera.view.x.shape
            rgb_picture = np.full((*shape, 3), 120, np.uint8)
            frames.append(Frame(rgb_picture, depth_m.astype(np.float32).reshape(shape), np.zeros(shape, np.int32)))
        return frames

    def raycast(self, origins: np.ndarray, directions: np.ndarray, range_max_m: float) -> np.ndarray:
        distances_m = self._hit(origins, directions)
        return np.where(distances_m < range_max_m, distances_m, np.inf)

    def clearance_m(self, x: float, y: float) -> float:
        return min(HALF_M[0] - abs(x), HALF_M[1] - abs(y))

    @staticmethod
    def _hit(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        low, high = np.array([-HALF_M[0], -HALF_M[1], 0.0]), np.array([*HALF_M, HEIGHT_M])
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = np.where(directions > 0, (high - origins) / directions, (low - origins) / directions)
        distances_m: np.ndarray = np.nanmin(np.where(directions == 0, np.inf, ahead), axis=1)
        return distances_m


class HallSimulator(KinematicSimulator[Hall]):
    """Robots in a hall."""

    title = "The hall"

    def open(self, scene: Scene) -> Hall:
        return Hall()


def simulator(**changes: Any) -> HallSimulator:
    robot = HallSimulator(PlatformSpec(ROBOT | changes, "ground_truth", Path("unused")))
    robot.load(Scene(HALL, Path()), 0)
    return robot


def test_three_functions_make_a_simulator_that_conforms() -> None:
    conform(check_simulator(Simulator("hall", HallSimulator), ROBOT, HALL))


def test_it_does_not_claim_to_share_scenes() -> None:
    assert not isinstance(simulator(), ManyCameras)


commands = st.lists(st.tuples(st.floats(-0.5, 1.0), st.floats(-1.0, 1.0)), max_size=12)


@given(commands)
@settings(deadline=None, max_examples=30)
def test_no_command_leads_through_a_wall(driven: list[tuple[float, float]]) -> None:
    robot = simulator()
    for linear_mps, angular_radps in driven:
        for _ in range(10):
            robot.drive(linear_mps, angular_radps, robot.control_period_s)
    x, y, _ = robot.pose().translation_xyz
    assert robot.world.clearance_m(x, y) >= 0.3
    assert robot.clock() == pytest.approx(0.5 * len(driven))


def test_pictures_are_rendered_only_for_pictures() -> None:
    robot = simulator()
    robot.observe(["laser", "poses", "image_depth_info"])
    assert robot.world.renders == 0
    robot.observe(["image_rgb", "image_depth", "image_segment"])
    assert robot.world.renders == 1


def test_what_moves_in_the_world_is_bumped_into_where_it_is() -> None:
    robot = simulator()
    assert not robot.contact_ahead(0.5, 0.0, 1.0)
    robot.world.clearance_m = lambda x, y: 0.35 - x  # type: ignore[method-assign]
    robot.world.revision += 1
    assert robot.contact_ahead(0.5, 0.0, 1.0)


def test_physics_of_ones_own_is_followed_by_odometry_and_clock() -> None:
    class Teleporting(HallSimulator):
        def advance(self, linear_mps: float, angular_radps: float, duration_s: float) -> tuple[State, bool]:
            return State(self.state.x + 0.1, 0.0, 0.0, 2.0), True

        def measured(self, before: State) -> tuple[State, State]:
            return State(0.0, 0.0, 0.0), State(0.2, 0.0, 0.0)

    robot = Teleporting(PlatformSpec(ROBOT | {"noise": {"linear": 0, "angular": 0}}, "noisy", Path("unused")))
    robot.load(Scene(HALL, Path()), 0)
    robot.drive(0.0, 0.0, 0.05)
    assert robot.pose().translation_xyz[0] == pytest.approx(0.1)
    assert robot.odometry().translation_xyz[0] == pytest.approx(0.2)
    assert robot.collided
    assert robot.velocity == (2.0, 0.0)
    assert robot.observe(["poses"])["poses"]["base_link"]["translation_xyz"][0] == pytest.approx(0.2)


def test_a_robot_that_does_not_fit_and_a_channel_that_there_is_not_are_explained() -> None:
    with pytest.raises(BenchbotError, match="does not fit"):
        simulator().load(Scene(HALL | {"start_pose": [1, 0, 0, 0, 2.8, 0, 0]}, Path()), 0)
    with pytest.raises(BenchbotError, match="The hall does not simulate 'imagergb'") as caught:
        simulator().observe(["imagergb"])
    assert "image_rgb" in caught.value.why


def test_the_response_of_a_plain_camera_is_that_of_srgb() -> None:
    steps = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, 2)
    response = SrgbResponse()
    np.testing.assert_array_equal(response.developed(response.exposed(steps)), steps)
    assert response.exposed(np.full((1, 1, 3), 118, np.uint8))[0, 0, 0] == pytest.approx(0.18, abs=0.002)
    assert (response.developed(np.full((1, 1, 3), math.pi, np.float32)) == 255).all()


HOLONOMIC: dict[str, Any] = {
    "connections": ROBOT["connections"] | {"move_sideways": {"connection": "api_to_ros"}},
    "limits": ROBOT["limits"] | {"lateral_mps": 0.5},
}


@pytest.mark.parametrize("distance_m", [0.8, -0.8, 0.0])
def test_a_holonomic_base_drives_sideways_and_keeps_its_heading(distance_m: float) -> None:
    robot = simulator(**HOLONOMIC)
    robot.place(Pose.planar(0.0, 0.0, np.pi / 2))
    assert execute(robot, "move_sideways", {"distance": distance_m}, None, robot.config) is Outcome.REACHED
    x, y, _ = robot.pose().translation_xyz
    assert (x, y, robot.pose().yaw_rad) == pytest.approx((-distance_m, 0.0, np.pi / 2), abs=0.01)
    assert robot.lateral_mps == 0.0


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0))
@settings(deadline=None, max_examples=30)
def test_sideways_no_limit_is_exceeded_and_no_wall_crossed(lateral_mps: float, angular_radps: float) -> None:
    robot = simulator(**HOLONOMIC)
    last_mps = 0.0
    for _ in range(100):
        foreseen = robot.contact_beside(lateral_mps, angular_radps, robot.control_period_s)
        robot.drive_sideways(lateral_mps, angular_radps, robot.control_period_s)
        assert not robot.collided or foreseen
        if robot.collided:
            break
        assert abs(robot.lateral_mps) <= 0.5
        assert abs(robot.lateral_mps - last_mps) <= 2.0 * robot.control_period_s + 1e-9
        last_mps = robot.lateral_mps
    x, y, _ = robot.pose().translation_xyz
    assert robot.world.clearance_m(x, y) >= 0.3


def test_a_way_sideways_is_blocked_before_contact_where_the_robot_stops_there() -> None:
    robot = simulator(**HOLONOMIC)
    careful = MotionConfig.from_robot(ROBOT | HOLONOMIC | {"stops_before_contact": True}, "ground_truth")
    assert execute(robot, "move_sideways", {"distance": 5.0}, None, careful) is Outcome.BLOCKED
    assert not robot.collided
    assert robot.world.clearance_m(*robot.pose().translation_xyz[:2]) < 0.35


@pytest.mark.parametrize("bias", [0.0, 0.2])
def test_odometry_measures_the_way_sideways_with_its_errors(bias: float) -> None:
    robot = simulator(**HOLONOMIC, noise={"linear": 0.0, "angular": 0.0, "linear_bias": bias})
    execute(robot, "move_sideways", {"distance": -0.6}, None, robot.config)
    truth, believed = robot.pose().translation_xyz, robot.odometry().translation_xyz
    assert believed[1] == pytest.approx((1 + bias) * truth[1])
    assert believed[0] == pytest.approx(truth[0])


def test_an_accelerometer_feels_the_way_sideways() -> None:
    robot = simulator(**HOLONOMIC, imu={"frame": "base_link"})
    robot.robot.mounts.setdefault("base_link", Pose())
    robot.drive_sideways(0.5, 0.0, 0.05)
    felt = robot.observe(["imu"])["imu"]["linear_acceleration_mps2"]
    assert felt == pytest.approx([0.0, 2.0, 9.80665])


def test_a_holonomic_robot_conforms_and_one_that_ignores_the_command_is_found_out() -> None:
    class Ignoring(HallSimulator):
        def drive_sideways(
            self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float = 0.0
        ) -> None:
            self.drive(linear_mps, angular_radps, duration_s)

    class Mirrored(HallSimulator):
        def advance_sideways(
            self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float
        ) -> tuple[State, bool]:
            return super().advance_sideways(-lateral_mps, angular_radps, duration_s, linear_mps)

    def sideways(kind: type[HallSimulator]) -> tuple[str, str]:
        findings = check_simulator(Simulator("hall", kind), ROBOT | HOLONOMIC, HALL)
        return next((str(one.level), one.detail) for one in findings if one.subject == "drive: sideways")

    assert sideways(HallSimulator) == ("ok", "+0.201 m, -0.201 m")
    for faulty in (Ignoring, Mirrored):
        level, detail = sideways(faulty)
        assert level == "broken"
        assert "to its left where +0.2 m were commanded" in detail


def test_sideways_is_refused_where_it_is_not_declared_or_not_simulated() -> None:
    class OwnPhysics(HallSimulator):
        def advance(self, linear_mps: float, angular_radps: float, duration_s: float) -> tuple[State, bool]:
            return self.state, False

    with pytest.raises(BenchbotError, match="cannot drive the robot 'disc' sideways"):
        OwnPhysics(PlatformSpec(ROBOT | HOLONOMIC, "ground_truth", Path("unused")))
    with pytest.raises(BenchbotError, match="limits have no lateral_mps"):
        simulator(connections=HOLONOMIC["connections"])
    with pytest.raises(BenchbotError, match=r"lateral_mps is -1"):
        simulator(limits=ROBOT["limits"] | {"lateral_mps": -1})
    with pytest.raises(BenchbotError, match="The robot cannot drive sideways"):
        execute(simulator(), "move_sideways", {"distance": 1.0}, None, simulator().config)


def test_robots_that_drive_sideways_are_not_moved_as_arrays() -> None:
    assert simulator().many(2) is not None
    assert simulator(**HOLONOMIC).many(2) is None
