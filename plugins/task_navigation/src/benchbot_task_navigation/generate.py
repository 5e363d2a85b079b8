"""Generating episodes: starts and goals drawn on a floor plan, none of them trivial, with the shortest way of each."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask, Point, distance_to_box_m
from benchbot_task_navigation.ways import Ways, length_m

# M. Savva et al., "Habitat: A Platform for Embodied AI Research", ICCV 2019: within 0.2 m of a point.
# D. Batra et al., "ObjectNav Revisited", arXiv:2006.13171 (2020): within 1 m of an object.
SUCCESS_DISTANCE_M = {"point_goal": 0.2, "object_goal": 1.0}
MARGIN_M = 0.05
LEAST_DISTANCE_M = 1.0
LEAST_DETOUR = 1.05
"""A way to a point must be so much longer than the straight line: else it shows no more than that a robot drives."""
TRIES_PER_EPISODE = 400
SEEN_SHARE = 0.25
"""An object counts when it is seen from so many of the places where the robot is near enough."""
_LOOKED_FROM_EVERY = 16

Sees = Callable[[Mapping[str, Any], Floats], Mask]
"""Says from which of some places (N, 2) the robot sees an object of the object map's ground truth."""


@dataclass(frozen=True)
class Place:
    """The setting of episodes: an environment `name:variant`, its plan, its start (x, y, z) and the robot's radius."""

    environment: str
    plan: FloorPlan
    start_xyz: tuple[float, float, float]
    robot_radius_m: float


def point_goals(place: Place, seed: int, count: int) -> dict[str, Any]:
    """Return a list of episodes that end at a point; raises BenchbotError when there is no room for them."""
    ways, spots = _ground(place)
    random = np.random.default_rng(seed)
    episodes: list[dict[str, Any]] = []
    for _ in range(TRIES_PER_EPISODE * count):
        episode = _point_goal(place, ways, spots, len(episodes), random)
        if episode is not None:
            episodes.append(episode)
        if len(episodes) == count:
            return _listed(place, "point_goal", episodes)
    raise _no_room(place, "point_goal", count, len(episodes))


def mended_point_goals(place: Place, listed: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Return a list of episodes that end at a point after its place has changed.

    Starts and goals stay where they can, and their shortest ways are measured again. An episode that would not be drawn
    any more is drawn anew, each from the seed and its own number. Raises BenchbotError when there is no room for one.
    """
    ways, spots = _ground(place)
    roomy = {_rounded_point(spot) for spot in spots}
    episodes: list[dict[str, Any]] = []
    for number, episode in enumerate(listed["episodes"]):
        start, goal = _rounded_point(episode["start_pose"][4:6]), _rounded_point(episode["goal"]["position"])
        way = _way(ways, start, goal) if {start, goal} <= roomy else None
        if way is not None:
            episodes.append({**episode, "shortest_path_m": _rounded(length_m(way))})
            continue
        random = np.random.default_rng([seed, number])
        drawn = (_point_goal(place, ways, spots, number, random) for _ in range(TRIES_PER_EPISODE))
        found = next((other for other in drawn if other is not None), None)
        if found is None:
            raise _no_room(place, "point_goal", len(listed["episodes"]), number)
        episodes.append(found)
    return _listed(place, "point_goal", episodes)


def _point_goal(
    place: Place, ways: Ways, spots: Floats, number: int, random: np.random.Generator
) -> dict[str, Any] | None:
    """Draw a start and a goal; return the episode, None when it would be trivial."""
    start, goal = (_spot(spots, random) for _ in range(2))
    way = _way(ways, start, goal)
    if way is None:
        return None
    return _episode(place, "point_goal", number, start, random, {"position": [*goal, place.start_xyz[2]]}, way)


def _way(ways: Ways, start: Point, goal: Point) -> Floats | None:
    """Return the shortest way to a point; None when there is none, or hardly more than a straight line."""
    straight_m = math.dist(start, goal)
    if straight_m < LEAST_DISTANCE_M or ways.sees(start, goal):
        return None
    way = ways.between(start, goal)
    return None if way is None or length_m(way) < LEAST_DETOUR * straight_m else way


def object_goals(
    place: Place, objects: Sequence[Mapping[str, Any]], sees: Sees, seed: int, count: int
) -> dict[str, Any]:
    """Return a list of episodes that end near an object; `objects` are those of the object map's ground truth.

    The classes take turns. An object that the robot cannot come near, or mostly does not see from there, is no goal;
    a class that it is always near is left out. Where the shortest way of an episode ends, one of its objects is seen.
    """
    ways, spots = _ground(place)
    random = np.random.default_rng(seed)
    goals: dict[str, list[_Goal]] = {}
    for goal in _goals(place, [_to_micrometres(item) for item in objects], ways.reachable(place.start_xyz[:2]), sees):
        goals.setdefault(str(goal.item["class"]), []).append(goal)
    episodes: list[dict[str, Any]] = []
    for name in _in_turns(goals):
        found = next(_starts(ways, spots, goals[name], sees, random), None)
        if found is None:
            del goals[name]
            continue
        start, way = found
        boxes = [{"centroid": goal.item["centroid"], "extent": goal.item["extent"]} for goal in goals[name]]
        aim = {"class": name, "instances": boxes}
        episodes.append(_episode(place, "object_goal", len(episodes), start, random, aim, way))
        if len(episodes) == count:
            return _listed(place, "object_goal", episodes)
    raise _no_room(place, "object_goal", count, len(episodes))


def _to_micrometres(item: Mapping[str, Any]) -> Mapping[str, Any]:
    return {**item, **{name: [round(value_m, 6) for value_m in item[name]] for name in ("centroid", "extent")}}


@dataclass(frozen=True)
class _Goal:
    """An object, and the nodes where the robot is near enough."""

    item: Mapping[str, Any]
    near: Mask

    def is_at(self, place: Floats) -> bool:
        """Return whether a place (2,) is near enough."""
        x, y = place
        away_m = distance_to_box_m((x, y), self.item["centroid"][:2], self.item["extent"][:2])
        return away_m <= SUCCESS_DISTANCE_M["object_goal"]


def _goals(place: Place, objects: Sequence[Mapping[str, Any]], reachable: Mask, sees: Sees) -> Iterator[_Goal]:
    """Yield the objects that the robot can come near, and mostly sees from there."""
    for item in objects:
        near = reachable & place.plan.within(
            item["centroid"][:2], item["extent"][:2], SUCCESS_DISTANCE_M["object_goal"]
        )
        nodes = np.argwhere(near)
        if len(nodes) and sees(item, place.plan.points(nodes[::_LOOKED_FROM_EVERY])).mean() >= SEEN_SHARE:
            yield _Goal(item, near)


def _in_turns(classes: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of what is in the mapping over and over, until it is empty."""
    while classes:
        yield from [name for name in sorted(classes) if name in classes]


def _starts(
    ways: Ways, spots: Floats, goals: Sequence[_Goal], sees: Sees, random: np.random.Generator
) -> Iterator[tuple[Point, Floats]]:
    """Yield places from which the way to the goals is long enough and ends in sight of one, and that way."""
    way_from = ways.towards(np.any([goal.near for goal in goals], axis=0))
    for _ in range(TRIES_PER_EPISODE):
        start = _spot(spots, random)
        way = way_from(start)
        if way is None or length_m(way) < LEAST_DISTANCE_M:
            continue
        if any(goal.is_at(way[-1]) and sees(goal.item, way[-1:]).all() for goal in goals):
            yield start, way


def _ground(place: Place) -> tuple[Ways, Floats]:
    """Return the ways of the robot, and the places where it may start and stop: with a margin, all connected."""
    roomy = Ways(place.plan, place.robot_radius_m + MARGIN_M, reach=1).reachable(place.start_xyz[:2])
    if not roomy.any():
        raise _no_room(place, "any task", 1, 0)
    return Ways(place.plan, place.robot_radius_m), place.plan.points(np.argwhere(roomy))


def _spot(spots: Floats, random: np.random.Generator) -> Point:
    return _rounded_point(spots[random.integers(len(spots))])


def _rounded_point(point: Sequence[float] | Floats) -> Point:
    return _rounded(float(point[0])), _rounded(float(point[1]))


def _episode(
    place: Place,
    task: str,
    number: int,
    start: Point,
    random: np.random.Generator,
    goal: Mapping[str, Any],
    way: Floats,
) -> dict[str, Any]:
    half_rad = math.radians(int(random.integers(360))) / 2
    pose = [math.cos(half_rad), 0.0, 0.0, math.sin(half_rad), *start, place.start_xyz[2]]
    return {
        "id": f"{task}/{place.environment.replace(':', '_')}/{number:03d}",
        "start_pose": [_rounded(value) for value in pose],
        "goal": dict(goal),
        "shortest_path_m": _rounded(length_m(way)),
    }


def _listed(place: Place, task: str, episodes: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "version": 1,
        "task": task,
        "environment": place.environment,
        "robot_radius_m": place.robot_radius_m,
        "success_distance_m": SUCCESS_DISTANCE_M[task],
        "episodes": episodes,
    }


def _rounded(value: float) -> float:
    return round(value, 6) + 0.0


def _no_room(place: Place, task: str, count: int, found: int) -> BenchbotError:
    return BenchbotError(
        f"There are not {count} episodes of {task} in '{place.environment}'.",
        f"{found} were found that are at least {LEAST_DISTANCE_M:g} m long and no mere straight line, "
        f"for a robot of radius {place.robot_radius_m:g} m.",
        "Ask for fewer, or for a smaller robot.",
    )
