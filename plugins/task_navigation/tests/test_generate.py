"""Episodes: drawn from a seed, none of them trivial, and those that are shipped are the ones that the seed gives."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import benchbot_sample
import numpy as np
import pytest

import benchbot_task_navigation
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.platform import Scene
from benchbot.core.plugin_manager import load
from benchbot.evaluation.ground_truths import GroundTruths
from benchbot_task_navigation import generate
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask, distance_to_box_m
from benchbot_task_navigation.generate import Place, mended_point_goals, object_goals, point_goals
from benchbot_task_navigation.make_episodes import geometry_of, sight
from benchbot_task_navigation.ways import Ways, length_m
from plugins.task_navigation.tests.floors import arena, floor

SHIPPED = Path(benchbot_task_navigation.__file__).parent
ARENA = Place("arena:1", arena(), (-2.0, 0.0, 0.0), 0.2)
CHAIR = {"class": "chair", "centroid": [1.5, 1.2, 0.5], "extent": [0.6, 0.6, 1.0], "isgroup": False}


def everything_is_seen(_item: Mapping[str, Any], places: Floats) -> Mask:
    return np.ones(len(places), bool)


def shipped(name: str) -> Any:
    return json.loads((SHIPPED / name).read_text())


def miniroom() -> Place:
    plan = shipped("ground_truths/floor_plan_miniroom_1.json")["ground_truth"]
    return Place("miniroom:1", FloorPlan.from_ground_truth(plan), (1.2, 1.5, 0.0), 0.3)


def test_the_shipped_points_are_those_of_seed_zero() -> None:
    assert point_goals(miniroom(), 0, 20) == shipped("episodes/point_goal/miniroom_1.json")


def test_the_shipped_objects_are_those_of_seed_zero() -> None:
    catalog = Catalog(load())
    objects = GroundTruths.of(catalog, None).find("miniroom:1", {"object_map_ground_truth"})["ground_truth"]["objects"]
    (declared,) = catalog.environments("miniroom:1")
    geometry = geometry_of(Scene(declared.data, declared.path.parent))
    sees = sight(geometry, catalog.get("robots", "carter").data, 0.0)

    assert object_goals(miniroom(), objects, sees, 0, 20) == shipped("episodes/object_goal/miniroom_1.json")


def test_the_sample_arenas_are_those_of_seed_zero() -> None:
    listed = Path(benchbot_sample.__file__).parent / "episodes" / "arena_1.json"

    assert point_goals(ARENA, 0, 3) == json.loads(listed.read_text())


def test_another_seed_gives_others() -> None:
    first, second = (point_goals(ARENA, seed, 2) for seed in (1, 2))

    assert first != second
    assert first == point_goals(ARENA, 1, 2)


def test_a_list_is_mended_where_its_place_has_changed() -> None:
    listed = point_goals(ARENA, 7, 6)
    assert mended_point_goals(ARENA, listed, 0) == listed

    old = json.loads(json.dumps(listed))
    beside, inside, longer = old["episodes"][1], old["episodes"][3], old["episodes"][4]
    beside["goal"]["position"][:2] = np.add(beside["start_pose"][4:6], 0.1).tolist()
    inside["start_pose"][4:6] = [100.0, 100.0]
    longer["shortest_path_m"] += 1.0
    mended = mended_point_goals(ARENA, old, 0)

    assert [mended["episodes"][number] for number in (0, 2, 4, 5)] == [listed["episodes"][n] for n in (0, 2, 4, 5)]
    assert [episode["id"] for episode in mended["episodes"]] == [episode["id"] for episode in listed["episodes"]]
    assert mended_point_goals(ARENA, mended, 1) == mended


def test_no_episode_is_trivial_and_the_robot_fits_at_both_ends() -> None:
    listed = point_goals(ARENA, 7, 10)
    schema.check(listed, "episodes", Path("a.json"))
    assert len({episode["id"] for episode in listed["episodes"]}) == 10

    ways = Ways(ARENA.plan, 0.2)
    for episode in listed["episodes"]:
        start, goal = episode["start_pose"][4:6], episode["goal"]["position"][:2]
        straight_m = math.dist(start, goal)
        assert straight_m >= generate.LEAST_DISTANCE_M
        assert episode["shortest_path_m"] >= generate.LEAST_DETOUR * straight_m
        assert not ways.sees(tuple(start), tuple(goal))
        assert (ARENA.plan.clearance_at(np.array([start, goal])) >= 0.2 + generate.MARGIN_M - 1e-9).all()


def test_the_way_to_an_object_ends_where_it_is_near_enough() -> None:
    unreachable = {"class": "lamp", "centroid": [9.0, 9.0, 2.0], "extent": [0.1, 0.1, 0.1]}
    listed = object_goals(ARENA, [CHAIR, unreachable], everything_is_seen, 0, 4)
    schema.check(listed, "episodes", Path("a.json"))

    ways = Ways(ARENA.plan, 0.2)
    near = ARENA.plan.within((1.5, 1.2), (0.6, 0.6), 1.0)
    for episode in listed["episodes"]:
        assert episode["goal"]["class"] == "chair"
        way = ways.towards(near)(tuple(episode["start_pose"][4:6]))
        assert way is not None
        assert length_m(way) == pytest.approx(episode["shortest_path_m"], abs=1e-6)
        assert distance_to_box_m(tuple(way[-1]), (1.5, 1.2), (0.6, 0.6)) <= 1.0


@pytest.mark.parametrize("size_m", [0.3, 1.5, 3.0])
def test_where_there_is_no_room_for_episodes_it_says_so(size_m: float) -> None:
    empty = floor(size_m, resolution_m=0.05)

    with pytest.raises(BenchbotError, match="There are not"):
        point_goals(Place("box:1", empty, (0.0, 0.0, 0.0), 0.3), 0, 2)


def test_objects_that_are_always_near_make_no_episode() -> None:
    everywhere = {"class": "table", "centroid": [0.0, 0.0, 0.5], "extent": [6.0, 4.0, 1.0]}

    with pytest.raises(BenchbotError, match="0 were found"):
        object_goals(ARENA, [everywhere], everything_is_seen, 0, 1)


def test_what_is_mostly_hidden_where_the_robot_is_near_is_no_goal() -> None:
    chairs = [{**CHAIR, "ID_name": name, "centroid": [x, 1.2, 0.5]} for name, x in (("shown", 1.5), ("hidden", -1.5))]

    def sees(item: Mapping[str, Any], places: Floats) -> Mask:
        return np.full(len(places), item["ID_name"] == "shown") | (places[:, 0] < -2.3)

    listed = object_goals(ARENA, chairs, sees, 0, 4)

    boxes = [box["centroid"] for episode in listed["episodes"] for box in episode["goal"]["instances"]]
    assert boxes == [[1.5, 1.2, 0.5]] * 4


def test_the_way_to_an_object_ends_in_sight_of_it() -> None:
    def sees(_item: Mapping[str, Any], places: Floats) -> Mask:
        return np.asarray(places[:, 1] > 0.6)

    listed = object_goals(ARENA, [CHAIR], sees, 0, 4)

    ways = Ways(ARENA.plan, 0.2)
    near = ARENA.plan.within((1.5, 1.2), (0.6, 0.6), 1.0)
    for episode in listed["episodes"]:
        way = ways.towards(near)(tuple(episode["start_pose"][4:6]))
        assert way is not None
        assert way[-1][1] > 0.6
