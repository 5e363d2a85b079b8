"""The example mapper, on depth images of boxes."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchbot.api import ActionResult
from benchbot_task_semslam.examples.segmentation_mapper import SegmentationMapper
from tests.plugins.mapping.casting import BOXES, observe, views


def empty_results(**keys: Any) -> dict[str, Any]:
    return {"results": {"objects": [], "class_list": ["chair", "table", "background"]} | keys}


def saved(agent: SegmentationMapper, path: Path, results: dict[str, Any]) -> list[dict[str, Any]]:
    agent.save_result(str(path), results, {})
    objects: list[dict[str, Any]] = json.loads(path.read_text())["results"]["objects"]
    return objects


def test_the_agent_follows_the_trajectory_and_saves_its_map(tmp_path: Path) -> None:
    agent = SegmentationMapper()
    for camera in views():
        assert agent.pick_action(observe(BOXES, camera), ["move_next"]) == ("move_next", {})
        assert not agent.is_done(ActionResult.SUCCESS)

    assert agent.is_done(ActionResult.FINISHED)
    objects = saved(agent, tmp_path / "result.json", empty_results())
    assert [item["label_probs"] for item in objects] == [[1, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert objects[0]["centroid"] == pytest.approx([2.1, 0.0, 0.45], abs=0.04)
    assert objects[0]["extent"] == pytest.approx([0.6, 0.6, 0.9], abs=0.08)


def test_the_agent_looks_once_around_when_it_may_drive_itself() -> None:
    agent, turned_deg = SegmentationMapper(), 0.0
    while not agent.is_done(ActionResult.SUCCESS):
        action, arguments = agent.pick_action(observe(BOXES, views()[0]), ["move_angle", "move_distance"])
        assert action == "move_angle"
        turned_deg += arguments["angle"]

    assert turned_deg == 360
    assert not agent.is_done(ActionResult.SUCCESS), "the next scene begins anew"


def test_the_agent_tells_what_changed_from_one_scene_to_the_next(tmp_path: Path) -> None:
    agent = SegmentationMapper()
    for scene_number, boxes in enumerate([BOXES[:2], BOXES[1:]]):
        for camera in views():
            agent.pick_action(observe(boxes, camera, scene_number), ["move_next"])

    objects = saved(agent, tmp_path / "result.json", empty_results(state_list=["added", "removed", "unchanged"]))

    assert [(item["label_probs"].index(1), item["state_probs"]) for item in objects] == [(0, [0, 1, 0]), (1, [1, 0, 0])]
