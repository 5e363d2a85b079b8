"""OMQ against the published algorithm restated in plain Python, at growing numbers of objects.

The restatement goes through all pairs in loops, as v2 does, which spends more on each: it intersects polygons. Its
assignment is scipy's, as in v2. Both give the same score, and the difference is printed. Times are CPU seconds. The
loops take most of a minute for 2000 objects; `--plain-limit 200` leaves that out.
"""

import argparse
import json
import random
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, cast

from scipy.optimize import linear_sum_assignment

from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq import omq

CLASSES = [f"class {number}" for number in range(30)] + ["background"]


def scene(count: int, seed: int = 0) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a result and a ground truth of `count` objects each, at the density of a furnished house."""
    numbers = random.Random(seed)
    side = (count / 0.5) ** 0.5
    true_objects, estimates = [], []
    for _ in range(count):
        name = numbers.choice(CLASSES[:-1])
        centroid = [numbers.uniform(0, side), numbers.uniform(0, side), numbers.uniform(0, 2)]
        extent = [numbers.uniform(0.05, 1.0) for _ in range(3)]
        true_objects.append({"class": name, "centroid": centroid, "extent": extent, "isgroup": numbers.random() < 0.1})
        weights = [numbers.random() ** 8 + 2 * (name == other) for other in CLASSES]
        moved = [value + numbers.gauss(0, 0.05) for value in centroid]
        estimates.append({"label_probs": weights, "centroid": moved, "extent": extent})
    result = {
        "task_details": {"results_format": "object_map"},
        "results": {"objects": estimates, "class_list": CLASSES},
    }
    return result, {"ground_truth": {"objects": true_objects, "class_list": CLASSES}, "environment": {}}


Corners = list[tuple[float, float]]


def plain_omq(result: dict[str, Any], truth: dict[str, Any]) -> float:
    """Return OMQ of a map whose classes are those of the ground truth, without synonyms, by loops."""
    true_objects, estimates = truth["ground_truth"]["objects"], result["results"]["objects"]
    labels = [normalised(item["label_probs"]) for item in estimates]
    size = max(len(true_objects), len(estimates))
    costs = [[1.0] * size for _ in range(size)]
    for row, true_object in enumerate(true_objects):
        for column, (item, label) in enumerate(zip(estimates, labels, strict=True)):
            costs[row][column] = 1.0 - (iou(true_object, item) * label[CLASSES.index(true_object["class"])]) ** 0.5
    rows, columns = linear_sum_assignment(costs)
    matched = {int(column): costs[row][column] for row, column in zip(rows, columns, strict=True)}
    hits = [1.0 - cost for cost in matched.values() if cost < 1.0]
    false_positives = 0.0
    for column, (item, label) in enumerate(zip(estimates, labels, strict=True)):
        if matched[column] >= 1.0 and not is_part_of_group(item, label, column, true_objects, costs):
            false_positives += max(label[:-1])
    return float(sum(hits) / (len(true_objects) + false_positives))


def normalised(weights: list[float]) -> list[float]:
    """Return probabilities that sum to 1: scaled down, or with the rest added to the background."""
    total = sum(weights)
    if total > 1:
        return [weight / total for weight in weights]
    return [*weights[:-1], weights[-1] + 1 - total]


def is_part_of_group(
    item: dict[str, Any], label: list[float], column: int, true_objects: list[dict[str, Any]], costs: list[list[float]]
) -> bool:
    """Say whether an estimate lies in the true group of its class that it is nearest to."""
    nearest = min(range(len(true_objects)), key=lambda row: costs[row][column])
    group = true_objects[nearest]
    likeliest = CLASSES[label.index(max(label[:-1]))]
    if costs[nearest][column] >= 1.0 or not group["isgroup"] or group["class"] != likeliest:
        return False
    return shared_volume(corners(group), corners(item)) >= 0.5 * volume(corners(item))


def iou(a: dict[str, Any], b: dict[str, Any]) -> float:
    """Return the intersection over union of two boxes."""
    box_a, box_b = corners(a), corners(b)
    shared = shared_volume(box_a, box_b)
    return shared / (volume(box_a) + volume(box_b) - shared)


def corners(item: dict[str, Any]) -> Corners:
    """Return the lower and upper end of a box along each axis."""
    return [(c - e / 2, c + e / 2) for c, e in zip(item["centroid"], item["extent"], strict=True)]


def volume(box: Corners) -> float:
    """Return the volume of a box."""
    return (box[0][1] - box[0][0]) * (box[1][1] - box[1][0]) * (box[2][1] - box[2][0])


def shared_volume(a: Corners, b: Corners) -> float:
    """Return the volume of what two boxes share."""
    shared = 1.0
    for (low, high), (other_low, other_high) in zip(a, b, strict=True):
        shared *= max(min(high, other_high) - max(low, other_low), 0.0)
    return shared


def timed(call: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Return the median time of a call in seconds of this process's CPU, and what it returned."""
    times, returned = [], None
    for _ in range(repeats):
        start = time.process_time()
        returned = call()
        times.append(time.process_time() - start)
    return median(times), returned


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="PATH", help="also write the table to this file")
    parser.add_argument("--plain-limit", type=int, default=2000, metavar="OBJECTS")
    arguments = parser.parse_args()
    table = []
    print(f"{'objects':>8} {'OMQ':>12} {'plain':>12} {'ratio':>8} {'difference':>12}")
    for count in (20, 200, 2000):
        result, truth = scene(count)
        repeats = 5 if count <= 200 else 1
        omq_s, scores = timed(partial(omq.evaluate, cast(Result, result), [cast(GroundTruth, truth)]), repeats)
        row: dict[str, float | None] = {"objects": count, "omq_s": omq_s}
        text = f"{count:>8} {omq_s:>10.4f} s"
        if count <= arguments.plain_limit:
            plain_s, score = timed(partial(plain_omq, result, truth), repeats)
            row |= {"plain_s": plain_s, "ratio": plain_s / omq_s, "difference": abs(score - scores["OMQ"])}
            text += f" {plain_s:>10.4f} s {row['ratio']:>8.1f} {row['difference']:>12.1e}"
        table.append(row)
        print(text, flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
