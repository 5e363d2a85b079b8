"""Boxes over pictures: what is hidden is dashed, what is all hidden is left out, and labels can be read."""

import numpy as np
import pytest

from benchbot.api import Observations
from benchbot.core.geometry import Pose
from benchbot.mapping import MappedObject, draw_boxes
from benchbot.plugins.drawing.palette import class_colors
from tests.plugins.mapping.casting import BOXES, OPTICAL, Box, observe

AHEAD = Pose.planar(0, 0, 0, z=1.2) @ OPTICAL
CHAIR = MappedObject.around(BOXES[0][1:], {"chair": 1.0})
SCREEN: Box = (0, (1.0, -3.0, 0.0), (1.1, 3.0, 2.5))


def gray(frame: Observations) -> np.ndarray:
    return np.full((*frame["image_depth"].shape, 3), 90, np.uint8)


def draw(boxes: list[Box], objects: list[MappedObject], *, depth: bool = True, width_px: int = 960) -> np.ndarray:
    frame = observe(boxes, AHEAD)
    depth_m = frame["image_depth"] if depth else None
    info, pose = frame["image_depth_info"], frame["poses"]["camera"]
    return draw_boxes(gray(frame), objects, info, pose, depth_m, width_px)


def colored(picture: np.ndarray, label: str, labels: list[str]) -> int:
    """Count the pixels of nearly the colour of a class."""
    color = np.array(class_colors(labels)[label], int)
    return int((np.abs(picture.astype(int) - color).max(axis=-1) < 40).sum())


def test_a_picture_keeps_its_size_or_gets_the_one_that_is_asked_for() -> None:
    frame = observe(BOXES, AHEAD)
    info, pose = frame["image_depth_info"], frame["poses"]["camera"]

    assert draw_boxes(gray(frame), [CHAIR], info, pose).shape == (90, 160, 3)
    assert draw_boxes(gray(frame), [CHAIR], info, pose, width_px=320).shape == (180, 320, 3)
    np.testing.assert_array_equal(draw_boxes(gray(frame), [], info, pose), gray(frame))


def test_hidden_edges_are_dashed_with_depth_and_without() -> None:
    seen, turned_away = draw(BOXES[:1], [CHAIR]), draw([], [CHAIR], depth=False)
    nothing_in_the_way = draw([], [CHAIR])
    counts = [colored(picture, "chair", ["chair"]) for picture in (seen, turned_away, nothing_in_the_way)]

    # Three of twelve edges are at the back of a box that is seen from above and from the front alone.
    assert counts[0] < 0.97 * counts[2]
    assert counts[1] < 0.97 * counts[2]


def test_what_stands_behind_a_wall_is_not_drawn() -> None:
    assert not (draw([SCREEN, *BOXES], [CHAIR]) != 90).any()


def test_what_is_behind_the_camera_is_not_drawn_and_what_is_beside_it_is_cut_off() -> None:
    behind = MappedObject({"table": 1.0}, np.array([-2.0, -1, 0]), np.array([-1.0, 1, 1]))
    around = MappedObject({"table": 1.0}, np.array([-2.0, -2, 0]), np.array([2.0, 2, 2]))

    assert not (draw([], [behind]) != 90).any()
    assert (draw([], [around]) != 90).any()


def test_labels_of_objects_in_one_place_can_all_be_read() -> None:
    labels = ["chair", "couch", "potted plant"]
    crowd = [MappedObject({label: 0.9, "background": 0.1}, CHAIR.lower, CHAIR.upper) for label in labels]
    picture = draw([], crowd)

    for label in labels:
        # The plate of a label is some 20 px high and as long as its text; were it covered, less would be left.
        assert colored(picture, label, labels) > 700, label


@pytest.mark.parametrize("width_px", [160, 320])
def test_a_label_that_has_no_room_is_left_out_rather_than_cut(width_px: int) -> None:
    names = [f"a class with a very long name {i}" for i in range(30)]
    crowd = [MappedObject({name: 1.0}, CHAIR.lower, CHAIR.upper) for name in names]

    assert draw([], crowd, width_px=width_px).shape[1] == width_px
