"""The method `exploration`: how much of the floor a robot has seen, from where it really went."""

import math
from collections.abc import Sequence

import numpy as np

from benchbot.plugin import BenchbotError, GroundTruth, Result, Spent
from benchbot_eval_exploration.coverage import covered
from benchbot_task_navigation.floor_plan import FloorPlan

Scores = dict[str, float]

NAMES = ("coverage", "coverage_over_10m", "visited", "seen_m2", "path_length_m", "collisions")
ZERO_WHEN_MISSING = NAMES[:4]


def evaluate(result: Result, ground_truths: Sequence[GroundTruth]) -> Scores:
    """Score one result by its track, which the back end has written; nothing that the solution wrote counts.

    What was seen is that of the last attempt: a reset gives up what was seen before, and gives back none of the steps.
    Metres and collisions are those of all attempts.
    Raises BenchbotError for a result without a track, or of several scenes, and for a floor plan without room.
    """
    tracks = result.get("track") or []
    if len(tracks) != 1 or not tracks[0]["rows"]:
        raise BenchbotError(
            "The result does not say where the robot went.",
            f"It has {len(tracks)} tracks; one with places is needed, which the back end notes in a run of one scene.",
            "Score the result that benchbot submit writes, or the one that benchbot run keeps in its folder.",
        )
    way = np.array([row[2:5] for row in tracks[0]["rows"]], np.float64)
    found = covered(FloorPlan.from_ground_truth(ground_truths[0]["ground_truth"]), way)
    if found is None:
        raise BenchbotError(
            "There is no floor to explore.",
            "The floor plan of the environment has no room for a robot.",
            "Name another ground truth with --ground-truth.",
        )
    spent = Spent.of(result)
    values = (
        found.seen_share,
        found.seen_share_over(10.0),
        found.visited_share,
        found.seen_m2,
        float(spent.path_length_m),
        float(spent.collisions),
    )
    return dict(zip(NAMES, values, strict=True))


def combine(scores: Sequence[Scores]) -> Scores:
    """Return the means; a missing run has seen nothing, and is left out of lengths and collisions."""
    combined = {}
    for name in NAMES:
        values = [row.get(name, 0.0) for row in scores if name in row or name in ZERO_WHEN_MISSING]
        if values:
            combined[name] = math.fsum(values) / len(values)
    return combined
