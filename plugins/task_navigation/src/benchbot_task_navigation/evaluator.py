"""The method `navigation`: success, SPL and related scores, from the robot's true path.

P. Anderson et al., "On Evaluation of Embodied Navigation Agents", arXiv:1807.06757 (2018): success, SPL.
D. Batra et al., "ObjectNav Revisited", arXiv:2006.13171 (2020): success within 1 m of an object.
S. Datta et al., "Integrating Egocentric Localization for More Realistic Point-Goal Navigation Agents", CoRL 2020:
SoftSPL.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from benchbot.plugin import (
    BenchbotError,
    Catalog,
    GroundTruth,
    Result,
    Spent,
    is_one_attempt,
    load_plugins,
    named_episode_list,
)
from benchbot_task_navigation.floor_plan import FloorPlan, Point, distance_to_box_m
from benchbot_task_navigation.ways import Ways, length_m

Scores = dict[str, float]

NAMES = ("SPL", "success", "SoftSPL", "distance_to_goal_m", "path_length_m", "collisions")
ZERO_WHEN_MISSING = ("SPL", "success", "SoftSPL")


@dataclass(frozen=True)
class Run:
    """The measures of a run: how it ended, metres driven, metres left to the goal, and the shortest path's length."""

    ended_well: bool
    near_enough: bool
    path_length_m: float
    distance_to_goal_m: float
    shortest_path_m: float
    collisions: int


def score(run: Run) -> Scores:
    """Return the scores of one run.

    SPL = S l / max(p, l) with success S, shortest way l and way driven p; SoftSPL has max(0, 1 - d / l) for S, with the
    distance d that is left at the end.
    """
    success = float(run.ended_well and run.near_enough)
    shortness = run.shortest_path_m / max(run.path_length_m, run.shortest_path_m)
    progress = max(0.0, 1.0 - run.distance_to_goal_m / run.shortest_path_m)
    values = (
        success * shortness,
        success,
        progress * shortness,
        run.distance_to_goal_m,
        run.path_length_m,
        float(run.collisions),
    )
    return dict(zip(NAMES, values, strict=True))


def evaluate(result: Result, ground_truths: Sequence[GroundTruth]) -> Scores:
    """Score one result; raises BenchbotError for one without a track, or of other episodes than those installed.

    Nothing that the solution wrote counts. It ends well when it hands in a result without a failure (no collision, no
    limit reached) and without having been put back to the start after it had moved: an episode is one attempt. Metres
    and collisions are those of all attempts. The distance to the goal is that of the shortest way across the plan.
    """
    listed, episode = episode_of(result)
    provenance = result["provenance"]
    ways = _ways(json.dumps(ground_truths[0]["ground_truth"], sort_keys=True), listed["robot_radius_m"])
    _, _, x, y, _ = result["track"][0]["rows"][-1]
    spent = Spent.of(result)
    left_m, near_enough = _left(ways, (x, y), episode["goal"], listed["success_distance_m"])
    return score(
        Run(
            ended_well=provenance["failure"] is None and is_one_attempt(provenance) and not spent.collisions,
            near_enough=near_enough,
            path_length_m=spent.path_length_m,
            distance_to_goal_m=left_m,
            shortest_path_m=episode["shortest_path_m"],
            collisions=spent.collisions,
        )
    )


def episode_of(result: Result) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return the list and the episode in it that a result with a track is of; errors as for `evaluate`."""
    provenance = result.get("provenance") or {}
    chosen = (provenance.get("selection") or {}).get("episode")
    tracks = result.get("track")
    if chosen is None or not tracks or not tracks[0]["rows"]:
        raise BenchbotError(
            "The result does not say where the robot went.",
            f"It has no {'episode' if chosen is None else 'track'}, which the back end notes when a run is submitted.",
            "Score the result that benchbot submit writes, or the one that benchbot run keeps in its folder.",
        )
    listed = named_episode_list(Catalog(load_plugins()), chosen)
    return listed, listed["episodes"][chosen["number"]]


def combine(scores: Sequence[Scores]) -> Scores:
    """Return the means; a missing run is no success, and is left out of distances, lengths and collisions."""
    combined: Scores = {}
    for name in NAMES:
        values = [row[name] if row else 0.0 for row in scores if row or name in ZERO_WHEN_MISSING]
        if values:
            combined[name] = float(np.mean(values))
    return combined


def _left(ways: Ways, end: Point, goal: Mapping[str, Any], success_m: float) -> tuple[float, bool]:
    """Return the distance that is left, and whether the end is near enough to the goal.

    Where no way leads from the end to the goal, as when the robot's own localisation is off the plan, it is the
    straight line.
    """
    if "position" in goal:
        target = (goal["position"][0], goal["position"][1])
        way = ways.between(end, target)
        left_m = float(np.hypot(end[0] - target[0], end[1] - target[1])) if way is None else length_m(way)
        return left_m, left_m <= success_m
    boxes = [((*box["centroid"][:2],), (*box["extent"][:2],)) for box in goal["instances"]]
    nearest_m = min(distance_to_box_m(end, *box) for box in boxes)
    if nearest_m <= success_m:
        return 0.0, True
    near = np.any([ways.plan.within(*box, success_m) for box in boxes], axis=0)
    way = ways.towards(near)(end)
    return nearest_m - success_m if way is None else length_m(way), False


@lru_cache(maxsize=4)
def _ways(plan: str, radius_m: float) -> Ways:
    return Ways(FloorPlan.from_ground_truth(json.loads(plan)), radius_m)
