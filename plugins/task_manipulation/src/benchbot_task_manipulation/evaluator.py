"""The method `tidy_up`: whether the object is where it was wanted, and what that took, as the simulator has seen it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchbot.plugin import (
    BenchbotError,
    Catalog,
    GroundTruth,
    Result,
    Spent,
    TrackedScene,
    is_one_attempt,
    load_plugins,
    named_episode_list,
)

Scores = dict[str, float]
Row = Sequence[float]

NAMES = (
    "success",
    "placed",
    "picked",
    "time_s",
    "path_length_m",
    "end_effector_path_m",
    "energy_j",
    "distance_m",
    "collisions",
    "drops",
    "disturbed",
)
ZERO_WHEN_MISSING = ("success", "placed", "picked")

PICKED_M = 0.05
"""An object is picked up when it was so much higher than where it began."""
BELOW_M = 0.03
"""The middle of an object may be so far below the top of its place: a tray has a rim."""
DROPPED_M = 0.2
"""An object has fallen where it was so much lower than where it began and than its place."""
DISTURBED_M = 0.05


def evaluate(result: Result, ground_truths: Sequence[GroundTruth]) -> Scores:
    """Score one result; raises BenchbotError for one without tracked objects, or of other episodes than are installed.

    Nothing that the solution wrote counts. `placed` says that the object's middle is above its place and not held;
    `success` that the run has ended well, too: by itself, without a collision, and in one attempt.
    """
    provenance = result.get("provenance") or {}
    chosen = (provenance.get("selection") or {}).get("episode")
    tracks = result.get("track")
    if chosen is None or not tracks or "objects" not in tracks[0]:
        raise BenchbotError(
            "The result does not say where the objects are.",
            f"It has no {'episode' if chosen is None else 'track of objects'}, which the back end notes when a robot "
            "that can move them is simulated.",
            "Score the result that benchbot submit writes for a robot such as carter_arm.",
        )
    listed = named_episode_list(Catalog(load_plugins()), chosen)
    episode = listed["episodes"][chosen["number"]]
    track = tracks[-1]
    rows = {str(each["name"]): each["rows"] for each in track["objects"]}
    name, place = str(episode["goal"]["fetch"]["name"]), episode["goal"]["place"]
    if name not in rows:
        raise BenchbotError(
            f"The result does not say where '{name}' is.",
            f"It tells of: {', '.join(rows) or 'nothing'}.",
            "Run the episode again without options.loose: the environment says what is loose.",
        )
    is_held = name in track.get("held", ())
    left_m, is_above = _left(rows[name][-1], place, float(listed["success_distance_m"]))
    placed = left_m <= 0.0 and is_above and not is_held
    spent = Spent.of(result)
    ended_well = provenance.get("failure") is None and not spent.collisions and is_one_attempt(provenance)
    top_m = _top_m(place)
    values = (
        float(placed and ended_well),
        float(placed),
        float(max(row[3] for row in rows[name]) > rows[name][0][3] + PICKED_M),
        _time_s(track),
        spent.path_length_m,
        float(track.get("end_effector_path_m", 0.0)),
        float(track.get("energy_j", 0.0)),
        left_m,
        float(spent.collisions),
        float(sum(_fell(each, top_m) for each in rows.values())),
        float(sum(_moved_m(each) > DISTURBED_M for other, each in rows.items() if other != name)),
    )
    return dict(zip(NAMES, values, strict=True))


def combine(scores: Sequence[Scores]) -> Scores:
    """Return the means; a missing run is no success, and is left out of all that it would have taken."""
    combined: Scores = {}
    for name in NAMES:
        values = [row[name] if row else 0.0 for row in scores if row or name in ZERO_WHEN_MISSING]
        if values:
            combined[name] = float(np.mean(values))
    return combined


def _left(row: Row, place: Mapping[str, Any], highest_m: float) -> tuple[float, bool]:
    """Return the distance from an object's middle to the place's box, seen from above, and whether its height fits."""
    away = [
        max(0.0, abs(at - middle) - size / 2)
        for at, middle, size in zip(row[1:3], place["centroid"][:2], place["extent"][:2], strict=True)
    ]
    return math.hypot(*away), -BELOW_M <= row[3] - _top_m(place) <= highest_m


def _top_m(place: Mapping[str, Any]) -> float:
    return float(place["centroid"][2]) + float(place["extent"][2]) / 2


def _fell(rows: Sequence[Row], top_m: float) -> bool:
    return min(row[3] for row in rows) < min(rows[0][3], top_m) - DROPPED_M


def _moved_m(rows: Sequence[Row]) -> float:
    return math.dist(rows[0][1:4], rows[-1][1:4])


def _time_s(track: TrackedScene) -> float:
    return float(track["rows"][-1][1]) if track["rows"] else 0.0
