"""The example mapper, on depth images of boxes that are cast here ray by ray."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchbot.api import ActionResult
from benchbot.core.geometry import Pose
from benchbot_task_semslam.examples.segmentation_mapper import (
    MappedObject,
    ObjectMap,
    SegmentationMapper,
    changes,
    on_surfaces,
    rotation_matrix,
)

WIDTH, HEIGHT, FOCAL = 160, 90, 80.0
IDS = {"chair": 1, "table": 2}
# instance number, lower corner, upper corner
Box = tuple[int, tuple[float, float, float], tuple[float, float, float]]
BOXES: list[Box] = [
    (1001, (1.8, -0.3, 0.0), (2.4, 0.3, 0.9)),
    (1002, (0.2, 2.0, 0.0), (0.7, 2.5, 0.8)),
    (2001, (-2.6, -0.8, 0.1), (-1.6, 0.5, 0.7)),
]
# The optical frame of a camera that looks along the robot's x axis (REP-103): x right, y down, z forward.
OPTICAL = Pose(rotation_xyzw=(-0.5, 0.5, -0.5, 0.5))


def cast(boxes: Sequence[Box], camera: Pose) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
    """Return planar depth and instance numbers, (HEIGHT, WIDTH), seen from `camera`, an optical frame's pose."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u, float)], -1)
    directions = rays @ camera.matrix()[:3, :3].T
    origin = camera.matrix()[:3, 3]
    depth = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    numbers = np.zeros((HEIGHT, WIDTH), np.uint16)
    for number, lower, upper in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = (lower - origin) / directions, (upper - origin) / directions
        enter = np.minimum(near, far).max(-1)
        leave = np.maximum(near, far).min(-1)
        seen = (enter < leave) & (enter > 0) & (enter < depth)
        depth[seen], numbers[seen] = enter[seen], number
    return depth, numbers


def observe(boxes: Sequence[Box], camera: Pose, scene_number: int = 0) -> dict[str, Any]:
    depth, numbers = cast(boxes, camera)
    matrix = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])
    return {
        "image_depth": depth,
        "image_depth_info": {"height": HEIGHT, "width": WIDTH, "matrix_intrinsics": matrix},
        "image_segment": {
            "class_segment_img": (numbers // 1000).astype(np.uint8),
            "instance_segment_img": numbers,
            "class_ids": IDS,
        },
        "poses": {
            "camera": {
                "translation_xyz": np.array(camera.translation_xyz),
                "rotation_xyzw": np.array(camera.rotation_xyzw),
            }
        },
        "scene_number": scene_number,
    }


def views(height_m: float = 1.05) -> list[Pose]:
    """Return camera poses: from each of four places the whole way round."""
    places = [(0.0, 0.0), (0.5, -1.5), (1.5, 1.5), (-1.0, 1.5)]
    yaws = np.arange(0, 2 * np.pi, np.pi / 6)
    return [Pose.planar(x, y, yaw, z=height_m) @ OPTICAL for x, y in places for yaw in yaws]


def test_boxes_are_found_where_they_are() -> None:
    mapped = ObjectMap()
    for camera in views():
        mapped.add(observe(BOXES, camera))

    assert [item.label for item in mapped.objects] == ["chair", "chair", "table"]
    for item, (_, lower, upper) in zip(mapped.objects, BOXES, strict=True):
        # A pixel at 2.5 m is 3 cm wide here.
        assert item.lower == pytest.approx(lower, abs=0.04)
        assert item.upper == pytest.approx(upper, abs=0.04)


def test_the_order_of_frames_is_of_no_account() -> None:
    there, back = ObjectMap(), ObjectMap()
    for camera in views():
        there.add(observe(BOXES, camera))
    for camera in reversed(views()):
        back.add(observe(BOXES, camera))

    for one, other in zip(there.objects, back.objects, strict=True):
        assert one.label == other.label
        np.testing.assert_array_equal([one.lower, one.upper], [other.lower, other.upper])


def test_an_empty_view_adds_nothing() -> None:
    mapped = ObjectMap()
    mapped.add(observe([], views()[0]))

    assert mapped.objects == []


def test_pixels_that_blend_two_depths_are_left_out() -> None:
    depth = np.full((5, 6), 2.0, np.float32)
    depth[:, 3:] = 4.0
    depth[2, 3] = 3.0
    instances = np.full((5, 6), 1001, np.uint16)

    assert np.argwhere(~on_surfaces(depth, instances)).tolist() == [[2, 3]]


@pytest.mark.parametrize("invalid", [np.nan, np.inf, -np.inf, 0.0])
def test_pixels_without_depth_are_left_out(invalid: float) -> None:
    depth = np.full((3, 3), 1.0, np.float32)
    depth[1, 1] = invalid

    assert np.argwhere(~on_surfaces(depth, np.ones((3, 3), np.uint16))).tolist() == [[1, 1]]


def test_rotations_are_those_of_the_core() -> None:
    pose = Pose.planar(0, 0, 0.7) @ OPTICAL

    np.testing.assert_allclose(rotation_matrix(pose.rotation_xyzw), pose.matrix()[:3, :3], atol=1e-12)


def a_box(label: str, x: float) -> MappedObject:
    return MappedObject(label, np.array([x, 0, 0], np.float32), np.array([x + 1, 1, 1], np.float32), 100)


def test_changes_are_what_only_one_map_has() -> None:
    before = [a_box("chair", 0.0), a_box("table", 5.0)]
    after = [a_box("chair", 0.2), a_box("chair", 5.0)]

    assert [(item.label, state) for item, state in changes(before, after)] == [("table", "removed"), ("chair", "added")]


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
