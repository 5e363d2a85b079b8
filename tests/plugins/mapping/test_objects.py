"""The map of objects, on depth images of boxes."""

import numpy as np
import pytest

from benchbot.plugins.mapping.objects import ObjectMap, on_surfaces
from tests.plugins.mapping.casting import BOXES, observe, views


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
