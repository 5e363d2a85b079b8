"""Scores of runs worked out by hand: what is placed, picked, dropped and disturbed, and what counts as a success."""

from copy import deepcopy
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot_task_manipulation.evaluator import NAMES, combine, evaluate

TASK = "manipulation:tidy_up:ground_truth:segmentation"
LISTED = Catalog(load()).get("episodes", "tidy_up:tidyroom:1").data["episodes"]
NUMBER = 0
GOAL = LISTED[NUMBER]["goal"]
NAME = GOAL["fetch"]["name"]
X, Y, _ = GOAL["place"]["centroid"]
TOP_M = GOAL["place"]["centroid"][2] + GOAL["place"]["extent"][2] / 2
UPRIGHT = [0.0, 0.0, 0.0, 1.0]


def row(time_s: float, x: float, y: float, z: float) -> list[float]:
    return [time_s, x, y, z, *UPRIGHT]


def result(fetched: list[list[float]], bottle: list[list[float]] | None = None, **changes: Any) -> Any:
    """Return the result of a run of the first episode, in which objects were here and there."""
    episode = select(Catalog(load()), RunRequest(TASK, "carter_arm", "tidyroom:1", episode=NUMBER)).episode
    assert episode is not None
    objects = {NAME: fetched, "bottle": bottle or [row(0.0, 1.4, 0.0, 0.85)]}
    track = {
        "scene": "tidyroom:1",
        "path_length_m": 3.0,
        "collisions": 0,
        "rows": [[0, 0.0, 0, 0, 0], [1, 40.0, 1, 1, 0]],
        "objects": [{"name": name, "rows": rows} for name, rows in objects.items()],
        "held": [],
        "energy_j": 80.0,
        "end_effector_path_m": 6.0,
    }
    track |= {key: value for key, value in changes.items() if key in track}
    spent = {
        "steps": 30,
        "simulated_time_s": 40.0,
        "wall_time_s": 1.0,
        "collisions": track["collisions"],
        "restarts": 0,
    }
    provenance = {"selection": {"episode": episode.provenance()}, "failure": changes.get("failure")}
    provenance |= {"spent": {**spent, "path_length_m": 3.0}, "restarts": changes.get("restarts", 0)}
    return {"provenance": provenance, "track": [track]}


BEGUN = row(0.0, 1.5, 0.2, 0.785)
RAISED = row(20.0, 1.5, 0.2, 0.95)
THERE = row(39.0, X, Y, TOP_M + 0.04)


def scored(*rows: list[float], **changes: Any) -> dict[str, float]:
    return evaluate(result(list(rows), **changes), [])


def test_an_object_that_stands_on_its_place_is_a_success() -> None:
    scores = scored(BEGUN, RAISED, THERE)
    assert tuple(scores) == NAMES
    assert scores["success"] == scores["placed"] == scores["picked"] == 1.0
    assert (scores["time_s"], scores["energy_j"], scores["end_effector_path_m"]) == (40.0, 80.0, 6.0)
    assert scores["distance_m"] == scores["drops"] == scores["disturbed"] == scores["collisions"] == 0.0


@pytest.mark.parametrize(
    ("rows", "changes", "expected"),
    [
        ([BEGUN], {}, {"placed": 0, "picked": 0}),
        ([BEGUN, RAISED, THERE], {"held": [NAME]}, {"placed": 0, "picked": 1}),
        ([BEGUN, RAISED, row(39.0, X, Y, TOP_M + 0.4)], {}, {"placed": 0, "distance_m": 0}),
        ([BEGUN, RAISED, row(39.0, X, Y, 0.04)], {}, {"placed": 0, "drops": 1}),
        ([BEGUN, RAISED, row(39.0, X + 2, Y, TOP_M + 0.04)], {}, {"placed": 0, "drops": 0}),
        ([BEGUN, RAISED, THERE], {"failure": "timeout"}, {"placed": 1, "success": 0}),
        ([BEGUN, RAISED, THERE], {"collisions": 1}, {"placed": 1, "success": 0, "collisions": 1}),
        ([BEGUN, RAISED, THERE], {"restarts": 1}, {"placed": 1, "success": 0}),
        (
            [BEGUN, RAISED, THERE],
            {"bottle": [row(0.0, 1.4, 0.0, 0.85), row(30.0, 1.2, 0.0, 0.05)]},
            {"success": 1, "drops": 1, "disturbed": 1},
        ),
    ],
)
def test_what_is_not_as_it_should_be_is_told(
    rows: list[list[float]], changes: dict[str, Any], expected: dict[str, float]
) -> None:
    scores = scored(*rows, **changes)
    assert {name: scores[name] for name in expected} == expected
    if not expected.get("success", expected.get("placed")):
        assert scores["success"] == 0.0


def test_the_distance_is_to_the_edge_of_the_place() -> None:
    away_m = GOAL["place"]["extent"][0] / 2 + 0.3
    assert scored(BEGUN, row(39.0, X + away_m, Y, TOP_M))["distance_m"] == pytest.approx(0.3)


def test_nothing_that_a_solution_wrote_counts() -> None:
    document = result([BEGUN])
    honest = evaluate(deepcopy(document), [])
    document["results"] = {"success": 1.0}
    assert evaluate(document, []) == honest


def test_results_of_other_robots_and_lists_are_explained() -> None:
    document = result([BEGUN])
    del document["track"][0]["objects"]
    with pytest.raises(BenchbotError, match="does not say where the objects are"):
        evaluate(document, [])
    document = result([BEGUN])
    document["provenance"]["selection"]["episode"]["sha256"] = "0" * 64
    with pytest.raises(BenchbotError, match="are not those of this result"):
        evaluate(document, [])
    document = result([BEGUN])
    document["track"][0]["objects"] = []
    with pytest.raises(BenchbotError, match=f"where '{NAME}' is"):
        evaluate(document, [])


def test_a_missing_run_is_no_success_and_costs_nothing() -> None:
    good = scored(BEGUN, RAISED, THERE)
    combined = combine([good, {}])
    assert combined["success"] == 0.5
    assert combined["time_s"] == good["time_s"]
