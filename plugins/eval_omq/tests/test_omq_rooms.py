"""Known faults in the map of a furnished house: each kind is found, with the right count and consistent costs."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import benchbot_envs_bear
from benchbot_eval_omq.explanation import explain
from benchbot_eval_omq.omq import evaluate

TRUTH = json.loads((Path(benchbot_envs_bear.__file__).parent / "ground_truths" / "house_1.json").read_text("utf-8"))
THINGS = TRUTH["ground_truth"]["objects"]
CLASSES = TRUTH["ground_truth"]["class_list"]


def degraded() -> tuple[Any, Counter[str]]:
    """Return a map of the house with 20 % of labels rotated, boxes shifted by 0.3 m, duplicates, ghosts, gaps."""
    random = np.random.default_rng(7)
    # A shift of 0.3 m leaves 0.1 to 0.5 of the overlap of boxes of this length.
    shiftable = [i for i, item in enumerate(THINGS) if 0.38 < item["extent"][0] < 0.85][:6]
    others = random.permutation([i for i in range(len(THINGS)) if i not in shiftable]).tolist()
    rotated, blind = others[: round(0.2 * len(THINGS))], others[-9:]
    # A second book of a pile counts neither for nor against.
    doubled = [i for i in others[len(rotated) : -9] if not THINGS[i].get("isgroup")][:5]
    objects = []
    for i, item in enumerate(THINGS):
        if i in blind:
            continue
        name = CLASSES.index(item["class"])
        place = list(item["centroid"])
        place[0] += 0.3 * (i in shiftable)
        label = (name + 1) % len(CLASSES) if i in rotated else name
        estimate = {"label_probs": np.eye(len(CLASSES))[label].tolist(), "centroid": place, "extent": item["extent"]}
        objects += [estimate] * (1 + (i in doubled))
    ghosts = [{**objects[i], "centroid": [30.0 + i, 0.0, 1.0]} for i in range(4)]
    counts = {"class": rotated, "location": shiftable, "duplicate": doubled, "missed": blind, "background": ghosts}
    result = {
        "task_details": {"name": "semantic_slam:passive:ground_truth", "results_format": "object_map"},
        "environment_details": [{"name": "house", "variant": 1}],
        "results": {"objects": objects + ghosts, "class_list": CLASSES},
    }
    return result, Counter({kind: len(found) for kind, found in counts.items()})


def test_each_kind_of_fault_is_found_with_its_count_and_its_cost() -> None:
    result, counts = degraded()

    diagnosis = explain(result, [TRUTH])["diagnosis"]

    errors = {error["kind"]: error for error in diagnosis["errors"]}
    assert {kind: errors[kind]["count"] for kind in counts} == counts
    assert errors.keys() - counts.keys() <= {"imprecise"}
    assert diagnosis["score"] == pytest.approx(evaluate(result, [TRUTH])["OMQ"])
    assert all(error["gain"] > 0 for kind, error in errors.items() if kind != "imprecise")
    assert any("outside the bounds" in hint for hint in diagnosis["hints"])
