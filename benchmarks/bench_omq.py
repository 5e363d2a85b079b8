"""OMQ against a plain-Python restatement of its table of qualities, at growing numbers of objects.

The restatement is the loops that one would write first. Its assignment is scipy's too, so the ratio is that of
everything around the assignment. Above `--plain-limit` objects only OMQ runs: 2000 take the loops most of a minute.
"""

import argparse
import json
import random
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from scipy.optimize import linear_sum_assignment

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


def plain_score(result: dict[str, Any], truth: dict[str, Any]) -> float:
    """Return the sum of pairwise qualities under the best assignment, by loops."""

    def corners(item: dict[str, Any]) -> list[tuple[float, float]]:
        return [(c - e / 2, c + e / 2) for c, e in zip(item["centroid"], item["extent"], strict=True)]

    def volume(box: list[tuple[float, float]]) -> float:
        return (box[0][1] - box[0][0]) * (box[1][1] - box[1][0]) * (box[2][1] - box[2][0])

    estimates = result["results"]["objects"]
    labels = [[weight / sum(item["label_probs"]) for weight in item["label_probs"]] for item in estimates]
    table = []
    for true_object in truth["ground_truth"]["objects"]:
        row = []
        true_box = corners(true_object)
        for item, label in zip(estimates, labels, strict=True):
            box = corners(item)
            shared = 1.0
            for (low, high), (other_low, other_high) in zip(true_box, box, strict=True):
                shared *= max(min(high, other_high) - max(low, other_low), 0.0)
            iou = shared / (volume(true_box) + volume(box) - shared)
            row.append(1.0 - (iou * label[CLASSES.index(true_object["class"])]) ** 0.5)
        table.append(row)
    rows, columns = linear_sum_assignment(table)
    return float(sum(1.0 - table[row][column] for row, column in zip(rows, columns, strict=True)))


def seconds(call: Callable[[], Any], repeats: int) -> float:
    """Return the median time of a call."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return median(times)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="PATH", help="also write the table to this file")
    parser.add_argument("--plain-limit", type=int, default=200, metavar="OBJECTS")
    arguments = parser.parse_args()
    table = []
    for count in (20, 200, 2000):
        result, truth = scene(count)
        repeats = 5 if count <= 200 else 1
        row: dict[str, float | None] = {
            "objects": count,
            "omq_s": seconds(partial(omq.evaluate, result, [truth]), repeats),
            "plain_s": None,
            "ratio": None,
        }
        if count <= arguments.plain_limit:
            plain_s = seconds(partial(plain_score, result, truth), repeats)
            row |= {"plain_s": plain_s, "ratio": plain_s / (row["omq_s"] or 1.0)}
        table.append(row)
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(f"{'objects':>8} {'OMQ':>12} {'plain':>12} {'ratio':>8}")
    for row in table:
        plain, ratio = row["plain_s"], row["ratio"]
        print(
            f"{row['objects']:>8} {row['omq_s']:>10.4f} s "
            + (f"{plain:>10.4f} s {ratio:>8.1f}" if plain is not None else f"{'-':>12} {'-':>8}")
        )


if __name__ == "__main__":
    main()
