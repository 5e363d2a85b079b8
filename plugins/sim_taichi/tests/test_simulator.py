"""The whole simulator: motion and contact in a room, and what is observed there."""

import math
import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from benchbot.core.declarations import schema
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.simulation import CHANNELS as ALL
from benchbot.simulation import PICTURES
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import simulator as simulators
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests.glb import Glb

CHANNELS = [channel for channel in ALL if channel != "joint_states"]
"""The channels of a robot without an arm."""

ROBOTS = Path(str(files("benchbot_sim_taichi"))) / "robots"
MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
LABELS = ["bottle", "chair", "table"]
OBJECTS = {
    # name: class, low corner, high corner
    "table": ("table", (1.6, -0.6, 0.0), (2.4, 0.6, 0.7)),
    "chair 1": ("chair", (0.4, 1.2, 0.0), (0.9, 1.7, 0.9)),
    "chair 2": ("chair", (0.6, -1.8, 0.0), (1.1, -1.3, 0.9)),
    "vase": ("vase", (1.9, -0.1, 0.7), (2.0, 0.0, 1.2)),
}
# Pictures are traced by one worker, so that its kernels are compiled once.
ray_traced = pytest.mark.xdist_group("renderer")


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """6 m x 6 m x 2.5 m around the origin, with a lamp, two chairs, a table and a vase on it."""
    folder = tmp_path_factory.mktemp("room")
    glb = Glb()
    plaster, wood = glb.material((0.8, 0.8, 0.75)), glb.material((0.5, 0.3, 0.15))
    glb.box("shell", (-3, -3, 0), (3, 3, 2.5), plaster, inward=True)
    glb.box("lamp", (-0.2, -0.2, 2.4), (0.2, 0.2, 2.45), glb.material(emission=(8.0, 8.0, 8.0)))
    for name, (class_name, low, high) in OBJECTS.items():
        glb.box(name, low, high, wood, class_name=class_name)
    glb.write(folder / "room.glb")
    return Scene(
        {
            "name": "room",
            "variant": 1,
            "type": "sim_taichi",
            "map_path": "room.glb",
            "start_pose": [1, 0, 0, 0, 0, 0, 0],
            "object_labels": LABELS,
        },
        folder,
    )


def robot(name: str = "carter_lowres", **changes: Any) -> dict[str, Any]:
    return schema.read(ROBOTS / f"{name}.yaml") | changes


def simulator(
    declaration: dict[str, Any] | None = None, cache_dir: Path = Path("unused"), localisation: Any = "ground_truth"
) -> RayTracedSimulator:
    return RayTracedSimulator(PlatformSpec(declaration or robot(), localisation, cache_dir))


@pytest.fixture
def loaded(room: Scene) -> RayTracedSimulator:
    """A simulator that is not looked at."""
    platform = simulator()
    platform.load(room, seed=0)
    return platform


@pytest.fixture
def seeing(room: Scene, kernel_cache: Path) -> RayTracedSimulator:
    """A simulator with its kernels compiled, of a robot with all sensors."""
    platform = simulator(robot("carter_lidar"), cache_dir=kernel_cache)
    platform.load(room, seed=0)
    return platform


CAREFUL = MotionConfig.from_robot(robot(), "ground_truth")
BLIND = replace(CAREFUL, stops_before_contact=False)


@pytest.mark.parametrize("name", ["carter", "carter_lidar", "carter_lowres", "carter_realistic"])
def test_robots_are_valid_declarations(name: str) -> None:
    path = ROBOTS / f"{name}.yaml"
    assert schema.problems(schema.read(path), "robot", path) == []
    simulator(robot(name))


def test_a_fresh_scene_is_clean(loaded: RayTracedSimulator) -> None:
    assert loaded.pose() == loaded.odometry() == Pose()
    assert loaded.velocity == (0.0, 0.0)
    assert not loaded.collided
    assert loaded.clock() == 0.0


def test_time_passes_in_ticks(loaded: RayTracedSimulator) -> None:
    for _ in range(20):
        loaded.drive(0.5, 0.0, loaded.control_period_s)
    assert loaded.clock() == pytest.approx(1.0)
    # A quarter of a second of that goes into reaching the speed.
    assert loaded.pose().translation_xyz[0] == pytest.approx(0.5 - 0.5**2 / (2 * 2.0))


def test_pushing_into_the_table_collides_at_contact(loaded: RayTracedSimulator) -> None:
    assert execute(loaded, "move_distance", {"distance": 3.0}, None, BLIND) is Outcome.COLLIDED
    assert loaded.collided
    assert loaded.velocity == (0.0, 0.0)
    assert loaded.pose().translation_xyz[0] == pytest.approx(1.6 - 0.3, abs=1e-5)


def test_a_careful_robot_stops_before_the_table(loaded: RayTracedSimulator) -> None:
    assert execute(loaded, "move_distance", {"distance": 3.0}, None, CAREFUL) is Outcome.BLOCKED
    assert not loaded.collided
    assert 1.2 < loaded.pose().translation_xyz[0] < 1.3
    assert execute(loaded, "move_distance", {"distance": -1.0}, None, CAREFUL) is Outcome.REACHED


@pytest.mark.parametrize("linear_mps", [1.5, -0.6])
def test_contact_is_foreseen_as_far_as_braking_goes(loaded: RayTracedSimulator, linear_mps: float) -> None:
    while not loaded.contact_ahead(linear_mps, 0.3, loaded.control_period_s):
        loaded.drive(linear_mps, 0.3, loaded.control_period_s)
    while loaded.velocity != (0.0, 0.0):
        loaded.drive(0.0, 0.0, loaded.control_period_s)
    assert not loaded.collided


def test_a_collision_is_forgotten_by_the_next_load(loaded: RayTracedSimulator, room: Scene) -> None:
    execute(loaded, "move_distance", {"distance": 3.0}, None, BLIND)
    loaded.load(room, seed=0)
    test_a_fresh_scene_is_clean(loaded)


def test_odometry_drifts_by_the_seed(loaded: RayTracedSimulator, room: Scene) -> None:
    ends = []
    for seed in (0, 0, 1):
        loaded.load(room, seed)
        execute(loaded, "move_distance", {"distance": 1.0}, None, CAREFUL)
        ends.append(loaded.odometry())
        assert loaded.pose().translation_xyz[0] == pytest.approx(1.0, abs=0.01)
    assert ends[0] == ends[1] != ends[2]
    assert ends[0] != loaded.pose()


def test_noisy_poses_are_all_those_of_odometry(room: Scene) -> None:
    platform = simulator(localisation="noisy")
    platform.load(room, seed=3)
    execute(platform, "move_distance", {"distance": 1.0}, None, replace(CAREFUL, localisation="noisy"))
    poses = platform.observe(["poses"])["poses"]
    base = platform.odometry()
    assert platform.pose() != base
    assert poses["base_link"]["translation_xyz"].tolist() == list(base.translation_xyz)
    offset = poses["lidar"]["translation_xyz"] - poses["base_link"]["translation_xyz"]
    assert np.linalg.norm(offset[:2]) == pytest.approx(0.06)
    assert poses["initial_pose"]["translation_xyz"].tolist() == [0, 0, 0]


def test_poses_name_the_frames_of_the_robot_and_the_camera(loaded: RayTracedSimulator) -> None:
    poses = loaded.observe(["poses"])["poses"]
    assert list(poses) == ["base_link", "initial_pose", "camera_left", "lidar", "camera"]
    assert poses["camera"]["translation_xyz"] == pytest.approx([0.11, 0.06, 1.05])
    # An optical frame: z looks along the robot's x.
    x, y, z, w = poses["camera"]["rotation_xyzw"]
    assert Pose(rotation_xyzw=(x, y, z, w)).matrix()[:3, 2] == pytest.approx([1, 0, 0])


@ray_traced
def test_every_channel_has_its_documented_form(seeing: RayTracedSimulator) -> None:
    seen = seeing.observe(CHANNELS)
    assert list(seen) == CHANNELS
    segments, lidar = seen["image_segment"], seen["lidar"]
    arrays: list[Any] = [seen["image_rgb"], seen["image_depth"]]
    arrays += [segments["class_segment_img"], segments["instance_segment_img"], seen["laser"]["scans"]]
    arrays += [lidar["ranges_m"], lidar["elevations_rad"], lidar["azimuths_rad"]]
    assert [(array.dtype, array.shape) for array in arrays] == [
        (np.uint8, (180, 320, 3)),
        (np.float32, (180, 320)),
        (np.uint8, (180, 320)),
        (np.uint16, (180, 320)),
        (np.float64, (900, 2)),
        (np.float32, (16, 1800)),
        (np.float64, (16,)),
        (np.float64, (1800,)),
    ]
    assert seen["image_segment"]["class_ids"] == {"bottle": 1, "chair": 2, "table": 3}
    assert (seen["laser"]["range_min"], seen["laser"]["range_max"]) == (0.1, 20.0)
    assert seen["laser"]["scans"][0, 1] == -math.pi
    assert seen["laser"]["scans"][-1, 1] < math.pi
    for name in ("image_rgb_info", "image_depth_info", "image_segment_info"):
        assert seen[name]["matrix_intrinsics"].tolist() == [[160, 0, 160], [0, 160, 90], [0, 0, 1]]


@ray_traced
def test_what_takes_long_is_told_when_it_begins(room: Scene, tmp_path: Path, kernel_cache: Path) -> None:
    shutil.copytree(kernel_cache / "kernels", tmp_path / "kernels")
    told: list[str] = []
    platform = RayTracedSimulator(PlatformSpec(robot(), "ground_truth", tmp_path, note=told.append))
    platform.load(room, 0)
    assert told == ["the simulator loads the scene room.glb"]
    platform.observe(("image_depth",))
    tree, light = told[1:]
    assert "builds the search tree" in tree
    assert "works out the light" in light
    platform.observe(("image_depth",))
    assert told[3:] == [], "it was all there"


@ray_traced
def test_the_same_seed_shows_the_same_bytes(room: Scene, kernel_cache: Path) -> None:
    digests = []
    for _ in range(2):
        platform = simulator(robot("carter_lidar"), cache_dir=kernel_cache, localisation="noisy")
        digest = ObservationDigest()
        platform.load(room, seed=5)
        digest.update(platform.observe(CHANNELS))
        execute(platform, "move_angle", {"angle": 40.0}, None, CAREFUL)
        digest.update(platform.observe(CHANNELS))
        digests.append(digest.hexdigest())
    assert digests[0] == digests[1]


@ray_traced
def test_a_room_is_loaded_once_wherever_robots_start_and_looks_the_same(
    room: Scene, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loads: list[Path] = []

    def counted(path: Path) -> SceneGeometry:
        loads.append(path)
        return load_scene(path)

    monkeypatch.setattr(simulators, "load_scene", counted)
    elsewhere = replace(room, environment={**room.environment, "start_pose": [0, 0, 0, 1, -1.5, 1.5, 0]})
    digests = []
    for scenes in ((elsewhere,), (room, elsewhere)):
        platform = simulator(cache_dir=kernel_cache)
        for scene in scenes:
            digest = ObservationDigest()
            platform.load(scene, seed=5)
            digest.update(platform.observe(PICTURES))
        digests.append(digest.hexdigest())
    assert digests[0] == digests[1]
    assert len(loads) == 2
    assert platform.pose().translation_xyz == elsewhere.start_pose.translation_xyz

    platform.load(replace(room, environment={**room.environment, "start_pose": [1, 0, 0, 0, 0, 0, 0.8]}), seed=5)
    assert len(loads) == 3, "on another floor other things are in the way"


@ray_traced
def test_depth_projects_back_onto_the_objects(seeing: RayTracedSimulator) -> None:
    execute(seeing, "move_angle", {"angle": 25.0}, None, CAREFUL)
    seen = seeing.observe(["image_depth", "image_depth_info", "image_segment", "poses"])
    fx, _, cx, _, fy, cy, *_ = seen["image_depth_info"]["matrix_intrinsics"].ravel()
    v, u = np.mgrid[:180, :320]
    depth_m = seen["image_depth"].astype(np.float64)
    camera = seen["poses"]["camera"]
    camera_to_map = Pose(tuple(camera["translation_xyz"]), tuple(camera["rotation_xyzw"])).matrix()
    points = np.stack([(u - cx) / fx * depth_m, (v - cy) / fy * depth_m, depth_m, np.ones_like(depth_m)], -1)
    points = points @ camera_to_map.T
    instances = seen["image_segment"]["instance_segment_img"]
    for name, number in {"table": 3001, "chair 1": 2001}.items():
        _, low, high = OBJECTS[name]
        on_object = points[instances == number][:, :3]
        assert len(on_object) > 100
        assert np.all(on_object >= np.array(low) - 2e-3)
        assert np.all(on_object <= np.array(high) + 2e-3)


@ray_traced
def test_the_laser_sees_what_the_robot_would_bump_into(seeing: RayTracedSimulator, room: Scene) -> None:
    slice_at_laser = ObstacleMap(load_scene(room.folder / "room.glb"), 0.6199, 0.6201)
    scans = seeing.observe(["laser"])["laser"]["scans"]
    assert np.all(np.isfinite(scans))
    for range_m, angle_rad in scans:
        along = np.array([math.cos(angle_rad), math.sin(angle_rad)])
        x, y = np.array([-0.06, 0.0]) + range_m * along
        assert slice_at_laser.distance_m(x, y) < 1e-3
        x, y = np.array([-0.06, 0.0]) + 0.9 * range_m * along
        assert slice_at_laser.distance_m(x, y) > 1e-3


@ray_traced
def test_segmentation_alone_equals_segmentation_with_a_picture(seeing: RayTracedSimulator) -> None:
    alone = seeing.observe(["image_segment"])["image_segment"]
    together = seeing.observe(["image_rgb", "image_segment"])["image_segment"]
    assert np.array_equal(alone["class_segment_img"], together["class_segment_img"])
    assert np.array_equal(alone["instance_segment_img"], together["instance_segment_img"])
    assert alone["class_ids"] == together["class_ids"]


def test_the_trajectory_of_the_miniroom_is_free() -> None:
    platform = simulator()
    scene = Scene(schema.read(MINIROOM), MINIROOM.parent)
    platform.load(scene, seed=0)
    for goal in scene.trajectory:
        assert execute(platform, "move_next", {}, goal, CAREFUL) is Outcome.REACHED
        assert math.dist(platform.pose().translation_xyz[:2], goal.translation_xyz[:2]) <= 0.01
    assert not platform.collided


@pytest.mark.parametrize(
    ("motion", "outcome", "gap_m"), [(BLIND, Outcome.COLLIDED, 0.0), (CAREFUL, Outcome.BLOCKED, 0.04)]
)
def test_the_bed_of_the_miniroom_is_in_the_way(motion: MotionConfig, outcome: Outcome, gap_m: float) -> None:
    platform = simulator()
    beside_the_bed = schema.read(MINIROOM) | {"start_pose": [1, 0, 0, 0, 0.5, 0.4, 0]}
    platform.load(Scene(beside_the_bed, MINIROOM.parent), seed=0)
    assert execute(platform, "move_distance", {"distance": 2.0}, None, motion) is outcome
    scene = load_scene(MINIROOM.parent / beside_the_bed["map_path"])
    bed = next(instance.index for instance in scene.instances if instance.class_name == "bed")
    of_bed = scene.triangle_instance == bed
    only_bed = replace(scene, triangles=scene.triangles[of_bed], triangle_instance=scene.triangle_instance[of_bed])
    x, y, _ = platform.pose().translation_xyz
    assert 0.3 <= ObstacleMap(only_bed, 0.03, 1.1).distance_m(x, y) <= 0.3 + gap_m + 1e-5


BROKEN_ROBOTS = {
    "no footprint": {"footprint": {}},
    "noise that is no number": {"noise": {"linear": "much", "angular": 0.1}},
    "a camera on an unknown frame": {"camera": robot()["camera"] | {"frame": "camera_right"}},
    "a camera on the base": {"camera": robot()["camera"] | {"frame": "base_link"}},
    "a camera without pixels": {"camera": robot()["camera"] | {"width": 0}},
    "a laser without beams": {"laser": robot()["laser"] | {"beams": 0}},
    "a footprint without width": {"footprint": {"radius_m": 0, "z_min_m": 0.03, "z_max_m": 1.1}},
    "a footprint that is no disc": {"footprint": robot()["footprint"] | {"polygon": [[0.1, 0], [0, 0.1], [-0.1, 0]]}},
    "a footprint with an unknown key": {"footprint": robot()["footprint"] | {"colour": 1}},
    "frames without places": {"frames": ["camera_left", "lidar"]},
    "an unknown pose": {"poses": ["base_link", "gripper"]},
    "a range backwards": {"laser": robot()["laser"] | {"range_m": [5, 1]}},
    "a range without end": {"laser": robot()["laser"] | {"range_m": [0.1]}},
}


@pytest.mark.parametrize("changes", BROKEN_ROBOTS.values(), ids=BROKEN_ROBOTS.keys())
def test_a_robot_that_cannot_be_simulated_is_explained(changes: dict[str, Any]) -> None:
    with pytest.raises(BenchbotError, match="carter_lowres"):
        simulator(robot(**changes))


@pytest.mark.parametrize(
    ("changes", "title"),
    [
        ({"map_path": "cellar.glb"}, "cellar.glb"),
        ({"start_pose": [1, 0, 0, 0, 1.9, 0.1, 0]}, "does not fit"),
        ({"start_pose": [1, 0, 0, 0, 2.8, 0, 0]}, "does not fit"),
    ],
    ids=["no such file", "inside the table", "too close to the wall"],
)
def test_a_scene_that_cannot_be_loaded_is_explained(room: Scene, changes: dict[str, Any], title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        simulator().load(Scene({**cast(Any, room.environment), **changes}, room.folder), seed=0)


def test_a_scene_without_a_map_is_explained(room: Scene) -> None:
    environment = {key: value for key, value in room.environment.items() if key != "map_path"}
    with pytest.raises(BenchbotError, match="map_path"):
        simulator().load(Scene(environment, room.folder), seed=0)


def test_an_unknown_channel_is_explained(loaded: RayTracedSimulator) -> None:
    with pytest.raises(BenchbotError, match="image_rbg") as raised:
        loaded.observe(["image_rbg"])
    assert "image_rgb" in raised.value.why


def test_closing_twice_is_fine(loaded: RayTracedSimulator) -> None:
    loaded.close()
    loaded.close()


@pytest.mark.parametrize(
    ("changes", "title"),
    [
        ({"lighting": {"lamps": {"on": ["lanp"]}}}, r"lighting.lamps.on\[0\] names a lamp that is not there: 'lanp'"),
        ({"options": {"quality": "reel"}}, "no quality 'reel'"),
    ],
)
def test_a_scene_says_what_is_wrong_with_its_light_when_it_is_loaded(
    room: Scene, changes: dict[str, Any], title: str
) -> None:
    with pytest.raises(BenchbotError, match=title):
        simulator().load(Scene({**cast(Any, room.environment), **changes}, room.folder), seed=0)


@ray_traced
def test_a_moved_object_is_seen_and_bumped_into_where_it_now_is(seeing: RayTracedSimulator) -> None:
    ahead = seeing.observe(["laser"])["laser"]["scans"]
    assert not seeing.contact_ahead(0.5, 0.0, 1.0)
    seeing.move_object("chair 1", Pose((0.2, -1.4, 0.0)).matrix())
    assert seeing.contact_ahead(0.5, 0.0, 1.0)
    assert np.min(np.asarray(seeing.observe(["laser"])["laser"]["scans"])[:, 0]) < np.min(np.asarray(ahead)[:, 0])
    seeing.move_object("chair 1", np.eye(4))
    assert not seeing.contact_ahead(0.5, 0.0, 1.0)
    assert np.array_equal(seeing.observe(["laser"])["laser"]["scans"], ahead)
    with pytest.raises(BenchbotError, match="no object 'chair 3'"):
        seeing.move_object("chair 3", np.eye(4))
