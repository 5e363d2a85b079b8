"""Where and why an episode of navigation ended, from the robot's true path."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchbot.plugin import GroundTruth, Result, Spent, is_one_attempt
from benchbot_task_navigation.evaluator import episode_of, evaluate
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask, Point, distance_to_box_m

HALF_VIEW_RAD = math.radians(45)
SIGHT_M = 10.0
"""The camera that every robot is credited with here, whatever its own: 90 degrees wide."""
REVISIT_M, LOOP_M, LOOP_SHARE = 0.3, 2.0, 0.3
"""A place is revisited at this distance, after so long a way; a way with such a share of them goes in circles."""

Document = dict[str, Any]
Goals = Sequence[tuple[Point, Point]]


def explain(result: Result, ground_truths: Sequence[GroundTruth]) -> Document:
    """Return the `diagnosis` of one episode: its `ending` (schema `explanation`). Errors as for `evaluate`."""
    scores = evaluate(result, ground_truths)
    listed, episode = episode_of(result)
    goal, success_m = episode["goal"], listed["success_distance_m"]
    goals: Goals = (
        [((x, y), (0.0, 0.0)) for x, y, *_ in [goal["position"]]]
        if "position" in goal
        else [(tuple(box["centroid"][:2]), tuple(box["extent"][:2])) for box in goal["instances"]]
    )
    way = np.array([row[2:5] for row in result["track"][0]["rows"]], np.float64)
    left_m = np.array([min(distance_to_box_m((x, y), *box) for box in goals) for x, y, _ in way])
    nearest = int(left_m.argmin())
    seen = _seen(FloorPlan.from_ground_truth(ground_truths[0]["ground_truth"]), way, goals)
    revisited = _revisited(way[:, :2])
    kind, why = _why(result, scores, bool(left_m[nearest] <= success_m), bool(seen.any()), revisited)
    if kind not in ("reached", "never_saw"):
        first = int(seen.argmax())
        saw = f"after {_length_m(way[: first + 1, :2]):.1f} m" if seen.any() else "never"
        why += f" The goal came into sight {saw}."
    return {
        "diagnosis": {
            "ending": {
                "kind": kind,
                "place": way[-1, :2].tolist(),
                "why": why,
                "distance_to_goal_m": scores["distance_to_goal_m"],
                "nearest_m": float(left_m[nearest]),
                "nearest_place": way[nearest, :2].tolist(),
                "revisited": revisited,
            }
        }
    }


def _why(
    result: Result, scores: Mapping[str, float], was_there: bool, saw_it: bool, revisited: float
) -> tuple[str, str]:
    """Return the kind of the ending and a sentence about it."""
    provenance = result.get("provenance") or {}
    failure = provenance.get("failure") or {}
    left, circles = f"{scores['distance_to_goal_m']:.2f} m of way left", f"{revisited:.0%} of its way was in circles"
    if scores["success"]:
        return "reached", "It stopped at the goal."
    if not is_one_attempt(provenance):
        return "not_alone", f"It had another attempt, or was helped: no success, with {left}."
    if failure.get("class") == "collision" or Spent.of(result).collisions:
        return "collision", f"It hit something, with {left}."
    if failure.get("class") not in (None, "timeout"):
        return "failed", f"{failure.get('why') or 'It failed.'} There was {left}."
    out_of_time = " The limit of its steps or time was reached." if failure else ""
    if was_there:
        return "passed", f"It had been at the goal, and went on; {left} at the end.{out_of_time}"
    if revisited >= LOOP_SHARE:
        return "loop", f"{circles}; {left} at the end.{out_of_time}"
    if not saw_it:
        return "never_saw", f"The goal was never in sight; {left} at the end.{out_of_time}"
    if failure:
        return "limit", f"It had not arrived, with {left}.{out_of_time}"
    return "stopped_short", f"It stopped by itself, with {left}."


def _seen(plan: FloorPlan, way: Floats, goals: Goals) -> Mask:
    """Return at which places (N,) of a way (N, 3) the robot faces a goal with nothing between that reaches the plan."""
    seen = np.zeros(len(way), bool)
    for centroid, extent in goals:
        half = np.array(extent) / 2
        # The edge of the goal that is nearest: it stands in its own way.
        towards = np.clip(way[:, :2], centroid - half, centroid + half) - way[:, :2]
        distances_m = np.hypot(*towards.T)
        bearing_rad = np.arctan2(towards[:, 1], towards[:, 0]) - way[:, 2]
        facing = np.abs(np.angle(np.exp(1j * bearing_rad))) <= HALF_VIEW_RAD
        shares = np.linspace(0.0, 1.0, int(SIGHT_M / plan.resolution_m / 2))
        for index in np.flatnonzero(facing & ~seen & (distances_m <= SIGHT_M)):
            # The last bit is left out, as the goal's own edge has no clearance.
            reach = shares * max(1.0 - 2 * plan.resolution_m / max(float(distances_m[index]), 1e-6), 0.0)
            between = way[index, :2] + reach[:, None] * towards[index]
            seen[index] = bool((plan.clearance_at(between)[1:] > 0).all())
    return seen


def _revisited(places: Floats) -> float:
    """Return the share of a way (N, 2) that led to where it had been, so much of the way before."""
    steps_m = np.hypot(*np.diff(places, axis=0).T)
    driven_m = np.append(0.0, np.cumsum(steps_m))
    if driven_m[-1] < LOOP_M:
        return 0.0
    again = [
        bool(
            (
                np.hypot(*(places[: int(np.searchsorted(driven_m, driven_m[i] - LOOP_M))] - places[i]).T) < REVISIT_M
            ).any()
        )
        for i in range(1, len(places))
    ]
    return float(steps_m[again].sum() / driven_m[-1])


def _length_m(places: Floats) -> float:
    return float(np.hypot(*np.diff(places, axis=0).T).sum())
