"""The places composed from layouts: every published object where it was published, and room for the robot to pass."""

import math
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.declarations import schema
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_scenes.catalogue import pack
from benchbot_scenes.differences import furnished
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import object_boxes
from benchbot_scenes.layout import read_layout
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_scenes.soundness import floating, in_walls
from benchbot_scenes.violations import SIZE, Violation, driving_violations, placing_violations
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.envs_bear.tests.conftest import package_file

CARTER = Path(str(files("benchbot_sim_taichi").joinpath("robots", "carter_lowres.yaml")))
ROBOT_RADIUS_M, ROBOT_LOW_M, ROBOT_HIGH_M = 0.30, 0.03, 1.10
TWINS = [f"{place}_{variant}" for place in ("miniroom", "house") for variant in range(1, 6)]
COMPOSED = [name for name in TWINS if name != "miniroom_1"]

pytestmark = pytest.mark.xdist_group("twins")


def _document(*parts: str) -> dict[str, Any]:
    return schema.read(package_file(*parts))


def _boxes(geometry: SceneGeometry) -> dict[str, tuple[str, bool, Any, Any]]:
    """Of each object that has a class: class, whether it is a group, and the corners of its box."""
    boxes = object_boxes(geometry)
    return {
        instance.name: (instance.class_name, instance.is_group, *boxes[instance.name])
        for instance in geometry.instances
        if instance.class_name is not None
    }


@pytest.fixture(scope="module")
def geometry(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], SceneGeometry]:
    cache: Path = tmp_path_factory.mktemp("scenes")
    loaded: dict[str, SceneGeometry] = {}

    def load(name: str) -> SceneGeometry:
        if name not in loaded:
            environment = package_file("environments", f"{name}.yaml")
            map_path = _document("environments", environment.name)["map_path"]
            loaded[name] = load_scene(scene_file(environment.parent / map_path, cache))
        return loaded[name]

    return load


@pytest.mark.parametrize("name", TWINS)
def test_the_named_objects_are_the_published_ones(name: str, geometry: Callable[[str], SceneGeometry]) -> None:
    boxes = _boxes(geometry(name))
    published = _document("published", f"{name}.json")["objects"]
    assert set(boxes) == {entry["id"] for entry in published}
    for entry in published:
        class_name, is_group, low, high = boxes[entry["id"]]
        assert (class_name, is_group) == (entry["class"], entry["isgroup"])
        np.testing.assert_allclose((low + high) / 2, entry["centroid"], atol=0.01, err_msg=entry["id"])
        np.testing.assert_allclose(high - low, entry["extent"], atol=0.01, err_msg=entry["id"])


@pytest.mark.parametrize("name", TWINS)
def test_the_ground_truth_is_measured_on_the_scene(name: str, geometry: Callable[[str], SceneGeometry]) -> None:
    boxes = _boxes(geometry(name))
    truth = _document("ground_truths", f"{name}.json")
    assert truth["environment"] == _document("environments", f"{name}.yaml")
    assert {entry["ID_name"] for entry in truth["ground_truth"]["objects"]} == set(boxes)
    for entry in truth["ground_truth"]["objects"]:
        class_name, is_group, low, high = boxes[entry["ID_name"]]
        assert (class_name, is_group) == (entry["class"], entry["isgroup"])
        np.testing.assert_allclose((low + high) / 2, entry["centroid"], atol=1e-3)
        np.testing.assert_allclose(high - low, entry["extent"], atol=1e-3)


# Hung on a wall, and a basin that hangs by its rim in the counter.
HUNG = {"electronic_006_TV_V1_23", "bathroom_024_toilet_v1_0", "bathroom_024_toilet_v2_0", "SM_AI_vol3_3_sink_01_0"}


@pytest.mark.parametrize("name", COMPOSED)
def test_nothing_floats_and_nothing_is_in_a_wall(name: str, geometry: Callable[[str], SceneGeometry]) -> None:
    scene = furnished(read_layout(package_file("layouts", f"{name}.yaml")))
    models = pack("household").models
    standing = {item.id for _, item in scene.objects if models[item.model].placement in ("floor", "surface")}
    named = {entry["id"] for entry in _document("published", f"{name}.json")["objects"]}
    assert floating(geometry(name), sorted((standing | named) - HUNG)) == []
    if scene.building is not None:
        assert in_walls(geometry(name), scene.building, [item.id for _, item in scene.objects]) == []


@pytest.mark.parametrize("name", TWINS)
def test_nothing_is_unsound_but_what_is_published_so(name: str, geometry: Callable[[str], SceneGeometry]) -> None:
    """Each fault of the published boxes and poses is listed, and nothing else is wrong."""
    found = driving_violations(geometry(name), _document("environments", f"{name}.yaml")["trajectory_poses"])
    if name in COMPOSED:
        found += placing_violations(read_layout(package_file("layouts", f"{name}.yaml")), geometry(name))
    place, variant = name.split("_")
    listed = schema.read(Path(__file__).with_name("published_faults.yaml"))[place]
    expected = {(kind, what) for kind, faults in listed.items() for what in faults if int(variant) in faults[what]}
    assert {(fault.kind, _told(fault)) for fault in found} == expected
    named = {entry["id"] for entry in _document("published", f"{name}.json")["objects"]}
    assert {part for fault in found for part in (fault.name, fault.other) if part} <= named | {"trajectory"}


def _told(fault: Violation) -> str:
    if fault.kind == SIZE:
        return f"{fault.name}: {fault.figure.split()[0]}"
    return f"{fault.name} {fault.other}".strip()


@pytest.mark.parametrize("name", TWINS)
def test_poses_are_the_published_ones_on_the_floor(name: str) -> None:
    published, declared = _document("published", f"{name}.json"), _document("environments", f"{name}.yaml")
    given = [published["start_pose_wxyz_xyz"], *published["trajectory_poses_wxyz_xyz"]]
    poses = [declared["start_pose"], *declared["trajectory_poses"]]
    for pose, expected in zip(poses, given, strict=True):
        heading = math.remainder(2 * (math.atan2(pose[3], pose[0]) - math.atan2(expected[3], expected[0])), 2 * math.pi)
        assert abs(heading) < math.radians(1.0)
        assert pose[4:] == [*expected[4:6], 0.0]


@pytest.mark.parametrize("name", TWINS)
def test_the_robot_has_room_all_along_its_trajectory(name: str, geometry: Callable[[str], SceneGeometry]) -> None:
    """More than 5 cm to walls and to what is not of the published data, which itself leaves 1.3 cm to a chair."""
    everything = geometry(name)
    assert _least_distance_m(name, everything) > ROBOT_RADIUS_M + 0.01
    if name in COMPOSED:
        named = [instance.index for instance in everything.instances if instance.class_name is not None]
        ours = ~np.isin(everything.triangle_instance, named)
        rest = replace(
            everything,
            triangles=everything.triangles[ours],
            triangle_instance=everything.triangle_instance[ours],
            triangle_material=everything.triangle_material[ours],
        )
        assert _least_distance_m(name, rest) > ROBOT_RADIUS_M + 0.05


def _least_distance_m(name: str, scene: SceneGeometry) -> float:
    """The least distance from the straight ways between poses to what a robot of carter's height can touch."""
    obstacles = ObstacleMap(scene, ROBOT_LOW_M, ROBOT_HIGH_M)
    declared = _document("environments", f"{name}.yaml")
    way = np.array([pose[4:6] for pose in [declared["start_pose"], *declared["trajectory_poses"]]])
    steps = [max(2, math.ceil(float(np.linalg.norm(last - first)) / 0.05)) for first, last in pairwise(way)]
    points = [
        first + share * (last - first)
        for (first, last), count in zip(pairwise(way), steps, strict=True)
        for share in np.linspace(0, 1, count)
    ]
    return min(obstacles.distance_m(float(x), float(y)) for x, y in points)


@pytest.mark.parametrize(
    "name",
    [
        "miniroom_3",
        "house_1",
        *(pytest.param(name, marks=pytest.mark.slow) for name in TWINS if name not in ("miniroom_3", "house_1")),
    ],
)
def test_the_trajectory_is_driven_to_its_end_without_contact(name: str, tmp_path: Path) -> None:
    robot = schema.read(CARTER)
    environment = package_file("environments", f"{name}.yaml")
    scene = Scene(_document("environments", environment.name), environment.parent)
    simulator = RayTracedSimulator(PlatformSpec(robot, "ground_truth", tmp_path))
    simulator.load(scene, 0)
    config = MotionConfig.from_robot(robot, "ground_truth")
    outcomes = {execute(simulator, "move_next", {}, pose, config) for pose in scene.trajectory}
    assert outcomes == {Outcome.REACHED}
    assert not simulator.collided
