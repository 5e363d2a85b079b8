"""The episodes that are shipped, in the scenes as they are loaded: every variant of a place is furnished otherwise."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

import benchbot_task_navigation
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import Scene
from benchbot.evaluation.ground_truths import GroundTruths
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_scenes.visibility import surface_points
from benchbot_task_navigation.floor_plan import FloorPlan, distance_to_box_m
from benchbot_task_navigation.generate import LEAST_DETOUR, LEAST_DISTANCE_M, MARGIN_M
from benchbot_task_navigation.ways import Ways, length_m

SHIPPED = Path(benchbot_task_navigation.__file__).parent
PLACES = ("apartment", "company", "house", "miniroom", "office")
# The tests of an environment run beside each other, so that its scene is composed once.
ENVIRONMENTS = [
    pytest.param(f"{place}:{variant}", marks=pytest.mark.xdist_group(f"scene of {place}:{variant}"))
    for place in PLACES
    for variant in range(1, 6)
]
EYE_M = 1.05
LOOKED_FROM = 24


@dataclass(frozen=True)
class Shipped:
    """What is shipped for an environment, the scene as it is loaded, and the robot that it was made for."""

    name: str
    geometry: SceneGeometry
    obstacles: ObstacleMap
    start: tuple[float, float]
    radius_m: float

    def read(self, folder: str) -> Any:
        return json.loads((SHIPPED / folder.format(self.name.replace(":", "_"))).read_text("utf-8"))

    @property
    def plan(self) -> FloorPlan:
        return FloorPlan.from_ground_truth(self.read("ground_truths/floor_plan_{}.json")["ground_truth"])

    def episodes(self, task: str) -> list[Mapping[str, Any]]:
        listed: list[Mapping[str, Any]] = self.read(f"episodes/{task}/{{}}.json")["episodes"]
        return listed


class Sight:
    """What can be seen of a scene, by rays that are cast exactly; glass is left out."""

    def __init__(self, geometry: SceneGeometry) -> None:
        opaque = ~np.array([material.is_glass for material in geometry.materials])[geometry.triangle_material]
        self._corners = geometry.vertices[geometry.triangles[opaque]]
        self._owner = geometry.triangle_instance[opaque]
        self._index = {instance.name: instance.index for instance in geometry.instances}
        self._points: dict[str, np.ndarray] = {}
        self._device = EmbreeDevice()
        self._scene = EmbreeScene(self._device, robust=True)
        TriangleMesh(self._scene, self._corners)

    def sees(self, place: tuple[float, float], name: str) -> bool:
        """Say whether a ray from a robot's camera there ends on an object; glass itself counts as seen."""
        points = self._points_of(name)
        if not len(points):
            return True
        eye = np.array([*place, EYE_M])
        rays = (points - eye) / np.linalg.norm(points - eye, axis=1, keepdims=True)
        origins = np.tile(eye.astype(np.float32), (len(rays), 1))
        hit = self._scene.run(
            origins, rays.astype(np.float32), output=True, dists=np.full(len(rays), 1e30, np.float32)
        )["primID"]
        return bool((self._owner[hit[hit >= 0]] == self._index[name]).any())

    def _points_of(self, name: str) -> np.ndarray:
        if name not in self._points:
            mine = self._corners[self._owner == self._index[name]].astype(float)
            points = surface_points(mine, 0.05)[0] if len(mine) else mine.reshape(-1, 3)
            self._points[name] = np.random.default_rng(0).permutation(points)[:200]
        return self._points[name]


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where scenes are composed."""
    return tmp_path_factory.mktemp("scenes")


@pytest.fixture
def shipped(request: pytest.FixtureRequest, scenes: Path) -> Shipped:
    return loaded(request.param, scenes)


@lru_cache(maxsize=1)
def loaded(environment: str, scenes: Path) -> Shipped:
    catalog = Catalog(plugin_manager.load())
    (declared,) = catalog.environments(environment)
    footprint = catalog.get("robots", "carter").data["footprint"]
    geometry = load_scene(scene_file(declared.path.parent / declared.data["map_path"], scenes, None))
    obstacles = ObstacleMap(geometry, footprint["z_min_m"], footprint["z_max_m"])
    x, y, _ = Scene(declared.data, declared.path.parent).start_pose.translation_xyz
    return Shipped(declared.name, geometry, obstacles, (x, y), footprint["radius_m"])


def names_at(name: str) -> Callable[[Sequence[float]], str]:
    """Tell the object of an environment by the centre of its box; goals have it to a micrometre."""
    truth = GroundTruths.of(Catalog(plugin_manager.load()), None).find(name, {"object_map_ground_truth"})
    items = truth["ground_truth"]["objects"]

    def name_at(centroid: Sequence[float]) -> str:
        near = [item["ID_name"] for item in items if np.allclose(item["centroid"], centroid, rtol=0, atol=1e-6)]
        assert len(near) == 1
        return str(near[0])

    return name_at


@pytest.mark.parametrize("shipped", ENVIRONMENTS, indirect=True)
def test_the_robot_fits_and_gets_from_every_start_to_every_goal(shipped: Shipped) -> None:
    plan = shipped.plan
    reachable = Ways(plan, shipped.radius_m, reach=1).reachable(shipped.start)

    # The plan is of this very scene.
    nodes = np.random.default_rng(0).permutation(np.argwhere(reachable))[:60]
    measured_m = [shipped.obstacles.distance_m(x, y) for x, y in plan.points(nodes)]
    np.testing.assert_allclose(plan.clearance_m[tuple(nodes.T)], np.minimum(measured_m, 2.0), atol=0.0011)

    starts = [
        episode["start_pose"][4:6] for task in ("point_goal", "object_goal") for episode in shipped.episodes(task)
    ]
    goals = [episode["goal"]["position"][:2] for episode in shipped.episodes("point_goal")]
    assert (len(starts), len(goals)) == (40, 20)
    ways_m = [
        episode["shortest_path_m"] for task in ("point_goal", "object_goal") for episode in shipped.episodes(task)
    ]
    assert min(ways_m) >= LEAST_DISTANCE_M
    for episode in shipped.episodes("point_goal"):
        straight_m = math.dist(episode["start_pose"][4:6], episode["goal"]["position"][:2])
        assert episode["shortest_path_m"] >= LEAST_DETOUR * straight_m
    for x, y in [*starts, *goals]:
        assert shipped.obstacles.distance_m(x, y) >= shipped.radius_m + MARGIN_M - 1e-6
        i, j = np.rint((np.array([x, y]) - plan.origin_xy) / plan.resolution_m).astype(int)
        assert reachable[i, j]


@pytest.mark.parametrize("shipped", ENVIRONMENTS, indirect=True)
def test_the_robot_comes_near_every_object_that_is_a_goal_and_sees_it_from_there(shipped: Shipped) -> None:
    plan, sight, name_at = shipped.plan, Sight(shipped.geometry), names_at(shipped.name)
    reachable = Ways(plan, shipped.radius_m, reach=1).reachable(shipped.start)
    goals = {
        tuple(box["centroid"]): box["extent"]
        for episode in shipped.episodes("object_goal")
        for box in episode["goal"]["instances"]
    }

    assert len(goals) >= 5
    for centroid, extent in goals.items():
        near = np.argwhere(reachable & plan.within((centroid[0], centroid[1]), (extent[0], extent[1]), 1.0))
        assert len(near)
        places = plan.points(np.random.default_rng(0).permutation(near)[:LOOKED_FROM])
        assert any(sight.sees((x, y), name_at(centroid)) for x, y in places), name_at(centroid)


@pytest.mark.parametrize("shipped", ["miniroom:4", "apartment:3"], indirect=True)
def test_the_shortest_way_to_an_object_ends_where_it_is_seen(shipped: Shipped) -> None:
    ways, sight, name_at = Ways(shipped.plan, shipped.radius_m), Sight(shipped.geometry), names_at(shipped.name)

    for episode in shipped.episodes("object_goal"):
        boxes = [(box["centroid"], box["extent"]) for box in episode["goal"]["instances"]]
        near = np.any([ways.plan.within(centroid[:2], extent[:2], 1.0) for centroid, extent in boxes], axis=0)
        way = ways.towards(near)(tuple(episode["start_pose"][4:6]))
        assert way is not None
        assert length_m(way) == pytest.approx(episode["shortest_path_m"], abs=1e-6)
        end = (float(way[-1][0]), float(way[-1][1]))
        reached = [name_at(box[0]) for box in boxes if distance_to_box_m(end, box[0][:2], box[1][:2]) <= 1.0]
        assert any(sight.sees(end, name) for name in reached), episode["id"]
