"""The lidar of many rings measures what Embree says is there, and says by REP-117 what it cannot measure."""

import math
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.channels import LidarScan
from benchbot.core.declarations import schema
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.lidar import points_m
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.plugins.simulation.robot import Robot
from benchbot.plugins.simulation.scanners import Lidar
from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Renderer
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests.embree import Embree
from plugins.sim_taichi.tests.rooms import furnished_room

ROBOT = schema.read(Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter_lidar.yaml")
MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
VALUES = {"frame": "velodyne", "elevations_deg": [-10, 0, 10], "beams": 36, "range_m": [0.1, 9]}
MIDDLE = Pose((1.3, 0.9, 1.15), (0.0, 0.0, 0.0, 1.0))
ray_traced = pytest.mark.xdist_group("renderer")


def digest(observed: Mapping[str, object]) -> str:
    found = ObservationDigest()
    found.update(observed)
    return found.hexdigest()


@pytest.fixture(scope="module")
def renderer(kernel_cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Renderer:
    path = furnished_room(tmp_path_factory.mktemp("room") / "room.glb")
    return Renderer(load_scene(path), Lighting(), cache_dir=kernel_cache)


def scan(renderer: Renderer, pose: Pose, **changes: Any) -> LidarScan:
    return Lidar.from_mapping(VALUES | changes).scan(renderer.cast, [pose], [np.random.default_rng(0)])[0]


@ray_traced
@pytest.mark.parametrize("yaw_deg", [0, 37, 180])
def test_ranges_are_those_of_embree(renderer: Renderer, yaw_deg: float) -> None:
    pose = Pose.from_xyz_rpy_deg((1.3, 0.9, 1.15), (5, -8, yaw_deg))
    seen = scan(renderer, pose, elevations_deg={"count": 16, "from_deg": -15, "to_deg": 15}, beams=900)
    assert seen["ranges_m"].shape == (16, 900)
    assert seen["ranges_m"].dtype == np.float32
    directions = points_m(seen | {"ranges_m": np.ones((16, 900), np.float32)}).reshape(-1, 3) @ pose.matrix()[:3, :3].T
    expected = Embree(renderer.scene).cast(pose.translation_xyz, directions)
    # A ray that grazes an edge may see either side of it.
    assert np.mean(np.abs(seen["ranges_m"].ravel() - expected) < 1e-3) > 0.999


@ray_traced
def test_what_is_too_far_and_too_near_is_infinite(renderer: Renderer) -> None:
    everything = scan(renderer, MIDDLE)["ranges_m"]
    middle_m = float(np.median(everything))
    near, far = (scan(renderer, MIDDLE, range_m=limits)["ranges_m"] for limits in ([0, middle_m], [middle_m, 9]))
    assert (near[everything > middle_m] == math.inf).all()
    assert (far[everything < middle_m] == -math.inf).all()
    np.testing.assert_array_equal(near[everything < middle_m], everything[everything < middle_m])


@ray_traced
def test_noise_is_normal_and_leaves_no_range_beyond_the_limits(renderer: Renderer) -> None:
    exact = scan(renderer, MIDDLE, beams=3000)["ranges_m"]
    noisy = scan(renderer, MIDDLE, beams=3000, noise={"sigma_m": 0.02})["ranges_m"]
    error_m = (noisy - exact)[np.isfinite(exact)]
    assert error_m.std() == pytest.approx(0.02, rel=0.05)
    assert abs(error_m.mean()) < 1e-3
    limited = scan(renderer, MIDDLE, range_m=[1.0, 2.0], noise={"sigma_m": 0.3})["ranges_m"]
    finite_m = limited[np.isfinite(limited)]
    assert finite_m.min() >= 1.0
    assert finite_m.max() <= 2.0


@ray_traced
def test_carter_lidar_sees_the_same_rooms_again(kernel_cache: Path) -> None:
    spec = PlatformSpec(ROBOT, "ground_truth", kernel_cache)
    room = Scene(schema.read(MINIROOM), MINIROOM.parent)
    robot = RayTracedSimulator(spec)
    robot.load(room, 3)
    first = robot.observe(["lidar", "poses"])
    assert digest(robot.observe(["lidar"])) == digest({"lidar": first["lidar"]})
    robot.drive(0.2, 0.0, robot.control_period_s)
    assert digest(robot.observe(["lidar"])) != digest({"lidar": first["lidar"]})
    robot.load(room, 3)
    assert digest(robot.observe(["lidar"])) == digest({"lidar": first["lidar"]})

    assert first["lidar"]["frame_id"] == "velodyne"
    np.testing.assert_allclose(np.degrees(first["lidar"]["elevations_rad"]), np.arange(-15, 16, 2), atol=1e-9)
    assert first["poses"]["velodyne"]["translation_xyz"][2] == pytest.approx(1.15)


@ray_traced
def test_a_level_ring_is_a_laser(kernel_cache: Path) -> None:
    level = ROBOT | {"lidar": ROBOT["laser"] | {"elevations_deg": [0.0]}}
    robot = RayTracedSimulator(PlatformSpec(level, "ground_truth", kernel_cache))
    robot.load(Scene(schema.read(MINIROOM), MINIROOM.parent), 0)
    seen = robot.observe(["lidar", "laser"])
    np.testing.assert_array_equal(seen["lidar"]["ranges_m"][0], seen["laser"]["scans"][:, 0].astype(np.float32))
    np.testing.assert_array_equal(seen["lidar"]["azimuths_rad"], seen["laser"]["scans"][:, 1])


MISFITS: dict[str, tuple[dict[str, Any], str]] = {
    "no rings": ({"elevations_deg": []}, "no beams"),
    "beyond the zenith": ({"elevations_deg": [91]}, "elevations_deg"),
    "an elevation that is no number": ({"elevations_deg": [math.nan]}, "elevations_deg"),
    "half a range of elevations": ({"elevations_deg": {"count": 16, "from_deg": -15}}, "to_deg"),
    "an unknown key of elevations": ({"elevations_deg": {"step_deg": 2}}, "step_deg"),
    "no beams": ({"beams": 0}, "no beams"),
    "a range backwards": ({"range_m": [9, 1]}, "range"),
    "an unknown key": ({"rings": 16}, "rings"),
    "negative noise": ({"noise": {"sigma_m": -1}}, "noise"),
    "a frame that the robot lacks": ({"frame": "velodine"}, "velodyne"),
}


@pytest.mark.parametrize(("change", "said"), MISFITS.values(), ids=MISFITS.keys())
def test_a_lidar_that_cannot_be_is_explained(change: dict[str, Any], said: str) -> None:
    robot = ROBOT | {"lidar": ROBOT["lidar"] | change}
    with pytest.raises(BenchbotError, match="carter_lidar") as caught:
        Robot.from_declaration(robot, MotionConfig.from_robot(robot, "ground_truth"))
    assert said in caught.value.why


def test_a_robot_without_a_lidar_says_so() -> None:
    blind = {key: value for key, value in ROBOT.items() if key != "lidar"}
    robot = RayTracedSimulator(PlatformSpec(blind, "ground_truth", Path("unused")))
    robot.load(Scene(schema.read(MINIROOM), MINIROOM.parent), 0)
    with pytest.raises(BenchbotError, match="has no lidar"):
        robot.observe(["lidar"])
