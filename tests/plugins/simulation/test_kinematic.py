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
