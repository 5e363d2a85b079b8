"""The difference of two maps, made by hand and seen by a camera."""

from typing import Any

import numpy as np
import pytest

from benchbot.core.geometry import Pose
from benchbot.mapping import MappedObject, ObjectMap, Views, changes, confirmed, describe_changes
from benchbot.plugins.formats import object_map_with_states
from tests.plugins.mapping.casting import BOXES, OPTICAL, Box, observe, views


def a_box(label: str, x: float, size_m: float = 1.0) -> MappedObject:
    lower = np.array([x, 0, 0], np.float32)
    return MappedObject({label: 1.0}, lower, lower + np.float32(size_m), 100)


def named(found: list[tuple[MappedObject, str]]) -> list[tuple[str, str]]:
    return [(item.label, state) for item, state in found]


def test_changes_are_what_only_one_map_has() -> None:
    before = [a_box("chair", 0.0), a_box("table", 5.0)]
    after = [a_box("chair", 0.2), a_box("chair", 5.0)]

    assert named(changes(before, after)) == [("table", "removed"), ("chair", "added")]


def test_nothing_changes_in_a_scene_that_stays_the_same() -> None:
    scene = [a_box("chair", 0.0), a_box("chair", 0.3), a_box("table", 5.0)]

    assert changes(scene, scene[::-1]) == []


@pytest.mark.parametrize(("before", "after", "state"), [(1, 0, "removed"), (0, 1, "added")])
def test_an_empty_map_has_lost_or_gained_everything(before: int, after: int, state: str) -> None:
    chair = a_box("chair", 0.0)

    assert changes([chair] * before, [chair] * after) == [(chair, state)]


def test_nothing_has_no_changes() -> None:
    assert changes([], []) == []


def test_an_object_that_moved_is_removed_and_added() -> None:
    assert named(changes([a_box("cup", 0.0)], [a_box("cup", 3.0)])) == [("cup", "removed"), ("cup", "added")]


def test_two_objects_do_not_share_a_counterpart() -> None:
    before = [a_box("book", 0.0), a_box("book", 0.1)]

    assert [state for _, state in changes(before, [a_box("book", 0.05)])] == ["removed"]


def test_an_object_that_grew_a_little_is_the_same() -> None:
    assert changes([a_box("couch", 0.0)], [a_box("couch", -0.1, size_m=1.2)]) == []


def visit(boxes: list[Box], cameras: list[Pose]) -> tuple[ObjectMap, Views]:
    objects, seen = ObjectMap(), Views()
    for camera in cameras:
        frame = observe(boxes, camera)
        objects.add(frame)
        seen.add(frame)
    return objects, seen


def test_changes_that_both_visits_saw_are_confirmed() -> None:
    (before, views_before), (after, views_after) = visit(BOXES[:2], views()), visit(BOXES[1:], views())
    found = changes(before.objects, after.objects)

    assert named(confirmed(found, views_before, views_after)) == [("chair", "removed"), ("table", "added")]


def test_what_the_other_visit_never_looked_at_is_not_a_change() -> None:
    back = [Pose.planar(0, 0, np.pi, z=1.05) @ OPTICAL]
    (before, views_before), (after, views_after) = visit(BOXES, views()), visit(BOXES, back)
    found = changes(before.objects, after.objects)

    assert ("chair", "removed") in named(found)
    assert confirmed(found, views_before, views_after) == []


def test_an_object_hidden_by_another_is_not_gone() -> None:
    ahead = [Pose.planar(0, 0, 0, z=0.5) @ OPTICAL]
    screen: Box = (2001, (1.0, -2.0, 0.0), (1.1, 2.0, 2.0))
    (before, views_before), (after, views_after) = visit(BOXES[:1], ahead), visit([screen, BOXES[0]], ahead)
    found = confirmed(changes(before.objects, after.objects), views_before, views_after)

    assert "removed" not in dict(named(found)).values()


def test_an_object_that_is_still_there_was_not_seen_empty() -> None:
    objects, seen = visit(BOXES, views())

    assert not any(seen.seen_empty(item) for item in objects.objects)


def test_changes_are_written_as_their_format_has_them() -> None:
    results: dict[str, Any] = object_map_with_states.create()
    found = changes([a_box("table", 0.0)], [a_box("chair", 3.0)])
    results["objects"] = describe_changes(found, results)
    object_map_with_states.validate(results)

    described = [
        (results["class_list"][np.argmax(item["label_probs"])], results["state_list"][np.argmax(item["state_probs"])])
        for item in results["objects"]
    ]
    assert described == [("table", "removed"), ("chair", "added")]
