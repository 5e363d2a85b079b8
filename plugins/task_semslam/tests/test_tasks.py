"""The tasks are those of BenchBot 2, and the same again with a perfect segmentation sensor."""

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load

OBSERVATIONS = ["image_depth", "image_depth_info", "image_rgb", "image_rgb_info", "laser", "poses"]
PASSIVE, ACTIVE = ["move_next"], ["move_angle", "move_distance"]

# name, actions, localisation, results format, scenes
TABLE = [
    ("semantic_slam:passive:ground_truth", PASSIVE, "ground_truth", "object_map", 1),
    ("semantic_slam:active:ground_truth", ACTIVE, "ground_truth", "object_map", 1),
    ("semantic_slam:active:dead_reckoning", ACTIVE, "noisy", "object_map", 1),
    ("scd:passive:ground_truth", PASSIVE, "ground_truth", "object_map_with_states", 2),
    ("scd:active:ground_truth", ACTIVE, "ground_truth", "object_map_with_states", 2),
    ("scd:active:dead_reckoning", ACTIVE, "noisy", "object_map_with_states", 2),
]

COLLECTING = [
    ("data_collect:passive:ground_truth", PASSIVE, "ground_truth"),
    ("data_collect:active:ground_truth", ACTIVE, "ground_truth"),
    ("data_collect:active:dead_reckoning", ACTIVE, "noisy"),
]


@pytest.mark.parametrize(("name", "actions", "localisation", "results_format", "scenes"), TABLE)
@pytest.mark.parametrize(("suffix", "more"), [("", []), (":segmentation", ["image_segment", "image_segment_info"])])
def test_a_task_declares_what_it_did_in_benchbot_2(
    name: str, actions: list[str], localisation: str, results_format: str, scenes: int, suffix: str, more: list[str]
) -> None:
    task = Catalog(load()).get("tasks", name + suffix)

    assert task.data["actions"] == actions
    assert sorted(task.data["observations"]) == sorted(OBSERVATIONS + more)
    assert task.data["localisation"] == localisation
    assert task.data["results_format"] == results_format
    assert task.data["scene_count"] == scenes
    assert task.distribution == "benchbot-task-semslam"


def test_there_are_no_other_tasks() -> None:
    pool = Catalog(load()).pool("tasks").values()

    assert sum(task.distribution == "benchbot-task-semslam" for task in pool) == 2 * len(TABLE) + len(COLLECTING)


@pytest.mark.parametrize(("name", "actions", "localisation"), COLLECTING)
def test_a_task_that_collects_data_asks_for_no_result(name: str, actions: list[str], localisation: str) -> None:
    task = Catalog(load()).get("tasks", name)

    assert (task.data["actions"], task.data["localisation"]) == (actions, localisation)
    assert sorted(task.data["observations"]) == sorted([*OBSERVATIONS, "image_segment", "image_segment_info"])
    assert "results_format" not in task.data
